"""Kinds of disturbances and their parameters: the schema for validation, documentation and sampling."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from numbers import Real
from types import MappingProxyType
from typing import Any

from artde_gym.arguments import check_name
from artde_gym.deprecation import renamed_arguments
from artde_gym.disturbances.friction import TERMS, friction
from artde_gym.disturbances.loads import Effect
from artde_gym.errors import OptionError
from artde_gym.kit import ROBOTS, Capability
from artde_gym.registry import Registry

NOTHING: Mapping[str, Any] = MappingProxyType({})


@renamed_arguments({"words": "choices"})
@dataclasses.dataclass(frozen=True)
class Parameter:
    """One parameter of a disturbance.

    Attributes:
        low, high: allowed range of each component.
        default: default value; None if the parameter is required.
        size: number of components; 0 for a word.
        nonzero: True if a zero vector is invalid.
        integer: True if the value is a whole number.
        choices: allowed words, or "site" or "joint" for the robot's names; rotors count as joints.
        smaller_is_harder: True if smaller values disturb a robot more.
        requires: capability that a robot needs for this parameter; None if the kind's own is enough.
        with_other: another parameter, and the default where that one is given and not zero.
    """

    name: str
    unit: str
    low: float
    high: float
    default: float | tuple[float, ...] | str | None
    text: str
    size: int = 1
    nonzero: bool = False
    integer: bool = False
    choices: tuple[str, ...] | str = ()
    smaller_is_harder: bool = False
    requires: Capability | None = None
    with_other: tuple[str, Any] | None = None


@renamed_arguments({"repeated": "multiple", "scalar": "shorthand"})
@dataclasses.dataclass(frozen=True)
class DisturbanceSpec:
    """A disturbance by name.

    Attributes:
        requires: capability that a robot needs for it.
        shorthand: parameter that a bare number sets.
        multiple: True if it takes a list of entries. For a joint, "all" means one entry per joint.
        one_of: parameters of which exactly one is given; the others are absent.
        effect: function that computes its loads; None for a kind that environments implement themselves.
        terms: parameters that are all zero where there is no effect; () for a kind that always has one.

    Raises:
        OptionError: for a name that cannot stand in a path.
    """

    name: str
    text: str
    parameters: tuple[Parameter, ...]
    requires: Capability
    shorthand: str | None = None
    multiple: bool = False
    one_of: tuple[str, ...] = ()
    effect: Effect | None = None
    terms: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in (self.name, *(parameter.name for parameter in self.parameters)):
            if "." in check_name("name of a disturbance or parameter", name):
                todo = "choose another name, as paths have dots"
                raise OptionError("name of a disturbance or parameter", name, todo, "contains a dot")

    def acts(self, entry: Mapping[str, Any]) -> bool:
        """Return True if a sampled entry has an effect."""
        return self.effect is not None and (not self.terms or any(entry[term] for term in self.terms))

    def parameters_for(self, robot: str | None) -> tuple[Parameter, ...]:
        """Return the parameters that a robot supports, or all for no particular robot (None)."""
        if robot is None:
            return self.parameters
        able = ROBOTS[robot].capabilities
        return tuple(one for one in self.parameters if one.requires is None or one.requires in able)

    def default_of(self, parameter: Parameter, robot: str | None, given: Mapping[str, Any] = NOTHING) -> Any:
        """Return a parameter's default for a robot, or for no particular robot (None), beside `given` parameters."""
        if parameter.with_other is not None:
            other, default = parameter.with_other
            value = given.get(other, 0.0)
            if not (isinstance(value, Real) and value == 0):
                return default
        own = {} if robot is None else ROBOTS[robot].defaults
        return own.get(f"{self.name}.{parameter.name}", parameter.default)

    def honored_by(self, robot: str | None) -> bool:
        """Return True if a robot supports this kind; None supports any."""
        needed = {self.requires} if self.effect is None else {self.requires, "effects"}
        return robot is None or needed <= ROBOTS[robot].capabilities


ALL = "all"
NEVER = 1e9  # s
HOOK = (0.0, 0.0, -0.05)  # m, where a cable begins
SHAPES = ("half_sine", "double_hump")
TRIGGERS = ("contact", "plan")


def _word(name: str, words: tuple[str, ...] | str, default: str | None, text: str) -> Parameter:
    return Parameter(name, "", 0, 0, default, text, size=0, choices=words)


def _time(name: str, default: float | None, text: str) -> Parameter:
    return Parameter(name, "s", 0.0, NEVER, default, text)


OWN: dict[str, DisturbanceSpec] = {
    kind.name: kind
    for kind in (
        DisturbanceSpec(
            "payload",
            "A ball fixed to the base, of an arm to its last link, or hanging under it on a cable, which neither "
            "stretches nor weighs anything and goes slack; see `artde_gym.sim.cable`. While it is there, the site "
            "`payload` is where it can be pushed.",
            (
                Parameter("mass", "kg", 1e-3, 5.0, None, "mass of the ball"),
                Parameter(
                    "position",
                    "m",
                    -0.5,
                    0.5,
                    (0.0, 0.0, 0.16),
                    "its center in the base frame, of an arm from the tool along its last link's axes; with a cable, "
                    "the hook's place",
                    size=3,
                    with_other=("cable", HOOK),
                ),
                _time("attach_time", 0.0, "attachment; at 0 the episode starts in equilibrium with the payload"),
                _time("detach_time", NEVER, "release; if not after `attach_time`, the payload never appears"),
                Parameter("cable", "m", 0.0, 2.0, 0.0, "length of the cable; 0: rigidly attached", requires="cable"),
            ),
            shorthand="mass",
            requires="payload",
        ),
        DisturbanceSpec(
            "push",
            "A constant force for a limited time, in world axes.",
            (
                _word("body", "site", "torso", "site of the robot at which it acts"),
                Parameter("magnitude", "N", 0.0, 500.0, None, "size of the force"),
                Parameter(
                    "direction",
                    "1",
                    -1e3,
                    1e3,
                    (1.0, 0.0, 0.0),
                    "direction of the force; any length. Two components {'normal': [0, 1]} and a zero give a uniformly "
                    "random horizontal direction",
                    size=3,
                    nonzero=True,
                ),
                _time("start", None, "start time"),
                Parameter("duration", "s", 1e-3, 60.0, 0.2, "duration"),
            ),
            multiple=True,
            requires="sites",
        ),
        DisturbanceSpec(
            "grf_pulse",
            "An extra upward force on the landing foot at its center of mass, one pulse per landing: the ground "
            "reaction model of the thesis. Off by default, since the engine already simulates contact forces. Exactly "
            "one of `magnitude` and `share` is given.",
            (
                _word("shape", SHAPES, "half_sine", "A sin(pi x), or A (sin(pi x) + q sin(3 pi x)), x = t / duration"),
                Parameter("magnitude", "N", 0.0, 500.0, None, "A"),
                Parameter("share", "1", 0.0, 5.0, None, "A over the nominal weight of the robot, 88.15 N"),
                Parameter("duration", "s", 0.005, 2.0, 0.1, "duration; for a double hump the stance's, about 1 s"),
                Parameter("q", "1", -1.0, 1.0, 0.4, "depth between the humps"),
                _word(
                    "trigger",
                    TRIGGERS,
                    "contact",
                    "start of a pulse: the foot's first contact after 0.25 s without load in its planned swing, or the "
                    "time at which the plan loads it again",
                ),
            ),
            shorthand="magnitude",
            one_of=("magnitude", "share"),
            requires="feet",
        ),
        DisturbanceSpec(
            "friction",
            "Friction between feet and ground.",
            (
                Parameter(
                    "coefficient", "1", 0.01, 2.0, None, "friction coefficient; nominal 0.8", smaller_is_harder=True
                ),
            ),
            shorthand="coefficient",
            requires="feet",
        ),
        DisturbanceSpec(
            "slope",
            "A slope. Gravity is tilted, so that heights and angles are relative to the ground.",
            (
                Parameter("pitch_deg", "deg", -20.0, 20.0, 0.0, "slope; positive: the ground rises forward"),
                Parameter("roll_deg", "deg", -20.0, 20.0, 0.0, "slope; positive: the ground rises to the left"),
            ),
            shorthand="pitch_deg",
            requires="feet",
        ),
        DisturbanceSpec(
            "wind",
            "Moving air: a steady wind, ambient turbulence (an Ornstein-Uhlenbeck process in each direction, zero at "
            "the start), and the jet of a fan (Gaussian across its axis, its speed another such process). It acts "
            "through the rotors' drag; see `artde_gym.disturbances.wind`.",
            (
                Parameter("scale", "1", 0.0, 10.0, 1.0, "factor of all velocities"),
                Parameter("steady", "m/s", -20.0, 20.0, (0.0, 0.0, 0.0), "velocity of the steady wind", size=3),
                Parameter("ambient", "m/s", 0.0, 10.0, 0.5, "standard deviation of each ambient component"),
                Parameter("ambient_time", "s", 0.01, 100.0, 1.0, "its correlation time"),
                Parameter("fan_speed", "m/s", 0.0, 20.0, 4.0, "mean speed on the jet's axis; 0 for no fan"),
                Parameter("fan_position", "m", -10.0, 10.0, (0.9, 0.0, 0.7), "a point on the jet's axis", size=3),
                Parameter(
                    "fan_direction",
                    "1",
                    -1e3,
                    1e3,
                    (0.0, 1.0, 0.0),
                    "direction of the jet; any length",
                    size=3,
                    nonzero=True,
                ),
                Parameter(
                    "fan_radius", "m", 0.05, 10.0, 0.3, "standard deviation of the jet's profile across its axis"
                ),
                Parameter("turbulence", "1", 0.0, 1.0, 0.25, "standard deviation of the jet's speed over its mean"),
                Parameter("turbulence_time", "s", 0.01, 10.0, 0.1, "its correlation time"),
            ),
            shorthand="scale",
            requires="rotors",
        ),
        DisturbanceSpec(
            "ground_effect",
            "Rotors have more thrust close to the ground; see `artde_gym.disturbances.ground_effect`.",
            (Parameter("strength", "1", 0.0, 10.0, 1.0, "factor of the published additional thrust"),),
            shorthand="strength",
            requires="rotors",
        ),
        DisturbanceSpec(
            "sensor_noise",
            "White Gaussian noise on measurements, given by standard deviations.",
            (
                Parameter("position", "rad or m", 0.0, 0.1, 0.0, "joint angles (rad), or a vehicle's position (m)"),
                Parameter(
                    "velocity",
                    "rad/s or m/s",
                    0.0,
                    10.0,
                    0.0,
                    "joint velocities (rad/s), or a vehicle's velocity (m/s)",
                ),
                Parameter("tilt", "rad", 0.0, 0.5, 0.0, "roll and pitch of the base, or a vehicle's whole attitude"),
                Parameter("angular_velocity", "rad/s", 0.0, 10.0, 0.0, "angular velocity of the base or vehicle"),
            ),
            shorthand="position",
            requires="sensors",
        ),
        DisturbanceSpec(
            "encoder_bits",
            "Joint encoders of finite resolution; joint velocities are then differences of counts.",
            (Parameter("bits", "1", 6, 32, None, "2^bits counts per turn", integer=True, smaller_is_harder=True),),
            shorthand="bits",
            requires="encoders",
        ),
        DisturbanceSpec(
            "action_delay",
            "Commands act with a delay.",
            (Parameter("steps", "1", 0, 100, None, "number of control periods", integer=True),),
            shorthand="steps",
            requires="actuators",
        ),
        DisturbanceSpec(
            "cable_delay",
            "The cable of a payload is measured late, as by a camera: vector, rate, and whether the load hangs.",
            (Parameter("steps", "1", 0, 20, None, "by so many control periods", integer=True),),
            shorthand="steps",
            requires="cable",
        ),
        DisturbanceSpec(
            "motor_lag",
            "Torques, or thrusts of rotors, follow commands as a first-order lag.",
            (Parameter("time_constant", "s", 0.0, 1.0, None, "time constant; rotors have 0.035 s by default"),),
            shorthand="time_constant",
            requires="actuators",
        ),
        DisturbanceSpec(
            "actuator_effectiveness",
            "A joint has only a share of the commanded torque, or a rotor of its thrust.",
            (
                _word("joint", "joint", None, f"joint or rotor, or {ALL!r}"),
                Parameter("factor", "1", 0.0, 1.0, 0.0, "remaining share", smaller_is_harder=True),
                _time("start", 0.0, "start time"),
            ),
            multiple=True,
            requires="actuators",
        ),
        DisturbanceSpec(
            "mass_scale",
            "The robot is heavier or lighter than the nominal model, in the masses and inertias of all links.",
            (Parameter("factor", "1", 0.5, 2.0, None, "true over nominal mass"),),
            shorthand="factor",
            requires="mass",
        ),
        DisturbanceSpec(
            "initial_pose",
            "The episode starts with an offset from the reference pose.",
            (
                _word("joint", "joint", ALL, f"joint, or {ALL!r}"),
                Parameter("offset", "rad", -0.5, 0.5, None, "added to the reference angle"),
            ),
            multiple=True,
            requires="joints",
        ),
        DisturbanceSpec(
            "initial_position",
            "The episode starts at rest with an offset from the reference path.",
            (Parameter("offset", "m", -0.3, 0.3, None, "added to the reference position", size=3),),
            requires="flight",
        ),
        DisturbanceSpec(
            "rotor_inertia",
            'Rotor inertia that differs from the nominal model\'s. Requires `actuator_inertia="rotor"`; `mass_scale` '
            "scales it, too.",
            (Parameter("inertia", "kg m^2", 0.005, 0.5, None, "reflected inertia of each leg joint; nominal 0.045"),),
            shorthand="inertia",
            requires="armature",
        ),
        DisturbanceSpec(
            "mass_distribution",
            "Mass and inertia moved between the legs and the rest of the robot; the total mass is unchanged.",
            (Parameter("legs", "1", 0.5, 1.5, None, "true over nominal mass of each link of the legs"),),
            shorthand="legs",
            requires="legs",
        ),
        DisturbanceSpec(
            "contact",
            "Softer or stiffer contact between feet and ground.",
            (
                Parameter(
                    "time_constant",
                    "s",
                    0.002,
                    0.05,
                    None,
                    "time constant of the contact: in MuJoCo that of its critically damped contacts (default 0.005 s), "
                    "in Bullet 0.001 s over the share of the depth corrected in that time (default 0.0125 s)",
                ),
            ),
            shorthand="time_constant",
            requires="contact",
        ),
        DisturbanceSpec(
            "joint_friction",
            "More friction in each joint than in the nominal model, viscous, Coulomb and Stribeck; see "
            "`artde_gym.disturbances.friction`. Where joints have some already, `scale` makes that larger or smaller.",
            (
                Parameter(
                    "scale", "1", 0.0, 10.0, 1.0, "true over nominal viscous and dry friction", requires="friction"
                ),
                Parameter("viscous", "Nm s/rad", 0.0, 100.0, 0.0, "added viscous friction (N s/m of a sliding joint)"),
                Parameter("coulomb", "Nm", 0.0, 100.0, 0.0, "added dry friction (N of a sliding joint)"),
                Parameter("stribeck", "Nm", 0.0, 100.0, 0.0, "by how much dry friction is larger at rest"),
                Parameter("stribeck_velocity", "rad/s", 1e-3, 10.0, 0.1, "speed at which that has fallen to 37 %"),
                Parameter("slip", "rad/s", 1e-3, 1.0, 0.05, "speed at which dry friction reaches 76 % of its size"),
            ),
            shorthand="scale",
            requires="joints",
            effect=friction,
            terms=TERMS,
        ),
        DisturbanceSpec(
            "torque_limit",
            "Actuators saturate below the bounds of the action.",
            (Parameter("limit", "Nm", 1.0, 40.0, None, "largest torque of each joint", smaller_is_harder=True),),
            shorthand="limit",
            requires="torque_limit",
        ),
    )
}
"""This project's kinds by name."""

DISTURBANCES: Registry[DisturbanceSpec] = Registry(
    "disturbance", "artde_gym.disturbances", lambda loaded: {kind.name: kind for kind in kinds_of(loaded)}, OWN
)
"""All kinds by name: this project's, plug-ins' and registered ones."""


def register_disturbance(kind: DisturbanceSpec, effect: Effect, *, replace: bool = False) -> None:
    """Register a kind of disturbance for the grammar, environments and the command line.

    Environments of robots that have its capability and "effects" apply it from the first step of an episode on.

    Args:
        kind: its name and parameters.
        effect: function that computes its loads on n robots.
        replace: whether it may replace a kind of the same name.

    Raises:
        OptionError: if its name is taken and `replace` is not given, or belongs to this project.
    """
    if kind.name in OWN:
        raise OptionError("disturbance", kind.name, f"a name that is not taken, any except {', '.join(OWN)}")
    DISTURBANCES.register(kind.name, dataclasses.replace(kind, effect=effect), replace=replace)


def kinds_of(loaded: Any) -> tuple[DisturbanceSpec, ...]:
    """Validate the object of an entry point of the group `artde_gym.disturbances`: kinds with effects.

    Raises:
        OptionError: if it is anything else.
    """
    kinds = loaded if isinstance(loaded, tuple) else (loaded,)
    for kind in kinds:
        if not (isinstance(kind, DisturbanceSpec) and kind.effect is not None):
            raise OptionError(
                "entry point of artde_gym.disturbances", kind, "a DisturbanceSpec with an effect, or a tuple of them"
            )
    return kinds


def in_order() -> list[DisturbanceSpec]:
    """Return all kinds in the order of sampling, which differs from that of registration."""
    return [*OWN.values(), *(DISTURBANCES[name] for name in sorted(DISTURBANCES.keys() - OWN.keys()))]


INTRODUCTION = """\
# Disturbances

Disturbances of a robot are data in one JSON-able grammar for all environments, accepted by
`gymnasium.make(..., disturbances=...)`, by `env.reset(options={"disturbances": ...})` and by the command line.

    {"payload": 1.3,
     "push": [{"body": "chest", "magnitude": {"uniform": [5, 40]}, "direction": [1, 0, 0], "start": 28.0}],
     "friction": {"coefficient": {"choice": [0.7, 0.8, 0.9]}},
     "initial_pose": {"joint": "all", "offset": {"normal": [0, 0.001]}}}

Any number may be a distribution: `{"uniform": [low, high]}`, `{"normal": [mean, std]}` (truncated to the allowed range
by resampling) or `{"choice": [...]}`, whose items are vectors if the parameter is a vector. Values are sampled at each
reset from the environment's seeded generator; `env.unwrapped.sampled_disturbances` has them in the same grammar, and
`info` as numbers (`disturbance.payload.mass`). Disturbances passed to `reset` override those of this and the following
episodes; nothing is merged.

Several kinds act together; kinds marked *list* take several entries. Anything outside the grammar, or a kind that the
robot does not support, raises `DisturbanceError` when the environment is made or reset, with the key, the value and
what is allowed.

"""


def page() -> str:
    """Return the grammar as a Markdown page."""
    lines = [f"| kind | {' | '.join(f'`{robot}`' for robot in ROBOTS)} |", "|---|" + "---|" * len(ROBOTS)]
    for kind in DISTURBANCES.values():
        marks = ("yes" if kind.honored_by(robot) else "" for robot in ROBOTS)
        lines += [f"| `{kind.name}` | {' | '.join(marks)} |"]
    lines += [""]
    for kind in DISTURBANCES.values():
        marks = " (list)" if kind.multiple else ""
        lines += [f"## `{kind.name}`{marks}", "", kind.text, "", "| parameter | unit | allowed | default | meaning |"]
        lines += ["|---|---|---|---|---|"]
        for parameter in kind.parameters:
            default = f"`{parameter.default}`"
            if parameter.default is None:
                default = "one of these" if parameter.name in kind.one_of else "required"
            if parameter.with_other is not None:
                default += f"; with `{parameter.with_other[0]}`: `{parameter.with_other[1]}`"
            default += "".join(f"; {robot}: `{value}`" for robot, value in other_defaults(kind, parameter).items())
            text = parameter.text + ("" if parameter.requires is None else f" ({_known_by(kind, parameter)} only)")
            text += " (set by a bare number)" if parameter.name == kind.shorthand else ""
            row = (f"`{parameter.name}`", parameter.unit, allowed(parameter), default, text)
            lines.append("| " + " | ".join(row) + " |")
        lines.append("")
    return INTRODUCTION + "\n".join(lines)


def _known_by(kind: DisturbanceSpec, parameter: Parameter) -> str:
    """Name the robots that know a parameter."""
    return ", ".join(robot for robot in ROBOTS if kind.honored_by(robot) and parameter in kind.parameters_for(robot))


def parameters_of(kind: str, given: Any) -> dict[str, Any]:
    """Return a disturbance's parameters, expanding the shorthand of a bare number or distribution."""
    if given is None:
        return {}
    scalar = DISTURBANCES[kind].shorthand
    names = {parameter.name for parameter in DISTURBANCES[kind].parameters}
    if isinstance(given, Mapping) and (scalar is None or not names.isdisjoint(given)):
        return dict(given)
    return {str(scalar): given}


def other_defaults(kind: DisturbanceSpec, parameter: Parameter) -> dict[str, Any]:
    """Return the robots' defaults of a parameter that differ from the kind's."""
    path = f"{kind.name}.{parameter.name}"
    return {name: kit.defaults[path] for name, kit in ROBOTS.items() if path in kit.defaults}


def allowed(parameter: Parameter) -> str:
    """Describe the valid values of a parameter."""
    if isinstance(parameter.choices, str):
        return f"a {parameter.choices} of the robot"
    if parameter.choices:
        return ", ".join(parameter.choices)
    unit = "" if parameter.unit in ("", "1") else f" {parameter.unit}"
    number = "whole numbers " if parameter.integer else ""
    each = f"{parameter.size} numbers, each " if parameter.size > 1 else ""
    return f"{each}{number}{parameter.low:g} to {parameter.high:g}{unit}, or a distribution of such values"
