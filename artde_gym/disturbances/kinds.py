"""The kinds of disturbances and their parameters: the one schema that checks, documents and draws them."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from numbers import Real
from types import MappingProxyType
from typing import Any, NamedTuple

from artde_gym.arrays import Array
from artde_gym.deprecation import renamed_arguments
from artde_gym.errors import OptionError
from artde_gym.kit import ROBOTS, Capability
from artde_gym.registry import Registry


class RobotStates(NamedTuple):
    """The states of n robots, as an effect sees them; of the base link's origin, in world axes.

    Attributes:
        time: since the start of each episode (n,) (s).
        q, qd: of the actuated joints (n, joints) (rad, rad/s).
        position, velocity: (n, 3) (m, m/s).
        quat_xyzw: attitude of the base (n, 4).
        angular_velocity: of the base (n, 3) (rad/s).
    """

    time: Array
    q: Array
    qd: Array
    position: Array
    quat_xyzw: Array
    velocity: Array
    angular_velocity: Array


class Load(NamedTuple):
    """Loads on n robots, beside those of actuators and ground; None for none.

    Attributes:
        tau: on the actuated joints (n, joints) (Nm).
        force: at the center of mass of the base link (n, 3) (N), world axes.
        torque: on the base link (n, 3) (Nm), world axes.
    """

    tau: Array | None = None
    force: Array | None = None
    torque: Array | None = None


Effect = Callable[[Mapping[str, Array], RobotStates], Load]
"""Computes what a disturbance does during the next physics step, from its sampled values and the states of n robots.

A value is (n,), or (n, size); a word is its place among those allowed. The function is pure: no memory, no randomness.
"""


NOTHING: Mapping[str, Any] = MappingProxyType({})


@renamed_arguments({"words": "choices"})
@dataclasses.dataclass(frozen=True)
class Parameter:
    """One value of a disturbance.

    Attributes:
        low, high: allowed range of each component.
        default: used where the parameter is left out; None if it must be given.
        size: number of components; 0 for a word.
        nonzero: whether a vector of zeros is refused.
        integer: whether the value is a whole number.
        choices: allowed words, or "site" or "joint" for the names that the robot has; rotors count as joints.
        requires: the capability without which a robot does not know this parameter; None if the kind's own is enough.
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
    requires: Capability | None = None
    with_other: tuple[str, Any] | None = None


@renamed_arguments({"repeated": "multiple", "scalar": "shorthand"})
@dataclasses.dataclass(frozen=True)
class DisturbanceSpec:
    """A disturbance by name.

    Attributes:
        requires: the capability of a robot that it takes.
        shorthand: the parameter that a bare number stands for.
        multiple: whether it takes a list of entries. Where it names a joint, "all" stands for one entry a joint.
        one_of: parameters of which exactly one is given; the others are absent.
        effect: of a registered kind; environments act by themselves on those of this project.
    """

    name: str
    text: str
    parameters: tuple[Parameter, ...]
    requires: Capability
    shorthand: str | None = None
    multiple: bool = False
    one_of: tuple[str, ...] = ()
    effect: Effect | None = None

    def parameters_for(self, robot: str | None) -> tuple[Parameter, ...]:
        """Return the parameters that a robot knows; all of them for no robot in particular."""
        if robot is None:
            return self.parameters
        able = ROBOTS[robot].capabilities
        return tuple(one for one in self.parameters if one.requires is None or one.requires in able)

    def default_of(self, parameter: Parameter, robot: str | None, given: Mapping[str, Any] = NOTHING) -> Any:
        """Return a parameter's default for a robot, or for none in particular, beside `given` parameters."""
        if parameter.with_other is not None:
            other, default = parameter.with_other
            value = given.get(other, 0.0)
            if not (isinstance(value, Real) and value == 0):
                return default
        own = {} if robot is None else ROBOTS[robot].defaults
        return own.get(f"{self.name}.{parameter.name}", parameter.default)

    def honored_by(self, robot: str | None) -> bool:
        """Return whether a robot has what this takes; any kind may be read for no robot in particular."""
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
            "A ball fixed to the base, or hanging under it on a cable, which neither stretches nor weighs anything and "
            "goes slack; see `artde_gym.sim.cable`. While it is there, the site `payload` is where it can be pushed.",
            (
                Parameter("mass", "kg", 1e-3, 5.0, None, "mass of the ball"),
                Parameter(
                    "position",
                    "m",
                    -0.5,
                    0.5,
                    (0.0, 0.0, 0.16),
                    "its center in the base frame; with a cable, the hook's place",
                    size=3,
                    with_other=("cable", HOOK),
                ),
                _time("attach_time", 0.0, "from when; at 0 the episode starts in balance with it"),
                _time("detach_time", NEVER, "until when; not after `attach_time`, it never appears"),
                Parameter(
                    "cable", "m", 0.0, 2.0, 0.0, "length of the cable; 0 for a ball that is fixed", requires="cable"
                ),
            ),
            shorthand="mass",
            requires="payload",
        ),
        DisturbanceSpec(
            "push",
            "A constant force for a while, in world axes.",
            (
                _word("body", "site", "torso", "named site of the robot at which it acts"),
                Parameter("magnitude", "N", 0.0, 500.0, None, "size of the force"),
                Parameter(
                    "direction",
                    "1",
                    -1e3,
                    1e3,
                    (1.0, 0.0, 0.0),
                    "along which it acts; any length. Two components {'normal': [0, 1]} and a zero make a uniform "
                    "random direction in the ground plane",
                    size=3,
                    nonzero=True,
                ),
                _time("start", None, "first instant"),
                Parameter("duration", "s", 1e-3, 60.0, 0.2, "how long"),
            ),
            multiple=True,
            requires="sites",
        ),
        DisturbanceSpec(
            "grf_pulse",
            "An extra upward force on the foot that lands, through its center of mass, one pulse a landing: the ground "
            "reaction model of the thesis. The engine has contact forces of its own, so this counts them twice; off by "
            "default. Exactly one of `magnitude` and `share` is given.",
            (
                _word("shape", SHAPES, "half_sine", "A sin(pi x), or A (sin(pi x) + q sin(3 pi x)), x = t / duration"),
                Parameter("magnitude", "N", 0.0, 500.0, None, "A"),
                Parameter("share", "1", 0.0, 5.0, None, "A over the weight of the robot as specified, 88.15 N"),
                Parameter("duration", "s", 0.005, 2.0, 0.1, "how long; for a double hump the stance, about 1 s"),
                Parameter("q", "1", -1.0, 1.0, 0.4, "depth between the humps"),
                _word(
                    "trigger",
                    TRIGGERS,
                    "contact",
                    "what starts a pulse: a foot's first contact after 0.25 s of its planned swing in the air, or the "
                    "instant at which the plan puts load on it again",
                ),
            ),
            shorthand="magnitude",
            one_of=("magnitude", "share"),
            requires="feet",
        ),
        DisturbanceSpec(
            "friction",
            "Friction coefficient of the pair foot and ground.",
            (Parameter("coefficient", "1", 0.01, 2.0, None, "instead of the nominal 0.8"),),
            shorthand="coefficient",
            requires="feet",
        ),
        DisturbanceSpec(
            "slope",
            "A slope; gravity is tilted, so that heights and angles are measured from the ground.",
            (
                Parameter("pitch_deg", "deg", -20.0, 20.0, 0.0, "above zero the ground rises ahead"),
                Parameter("roll_deg", "deg", -20.0, 20.0, 0.0, "above zero the ground rises to the left"),
            ),
            shorthand="pitch_deg",
            requires="feet",
        ),
        DisturbanceSpec(
            "wind",
            "Moving air: a steady wind, ambient air that wanders (an Ornstein-Uhlenbeck process in each direction, "
            "calm at the start), and the jet of a fan (Gaussian across its axis, its speed fluctuating likewise). It "
            "acts through the rotors' drag; see `artde_gym.disturbances.wind`.",
            (
                Parameter("scale", "1", 0.0, 10.0, 1.0, "times which all of it is stronger"),
                Parameter("steady", "m/s", -20.0, 20.0, (0.0, 0.0, 0.0), "velocity of the steady wind", size=3),
                Parameter("ambient", "m/s", 0.0, 10.0, 0.5, "standard deviation of each component of the ambient air"),
                Parameter("ambient_time", "s", 0.01, 100.0, 1.0, "its correlation time"),
                Parameter("fan_speed", "m/s", 0.0, 20.0, 4.0, "mean speed on the jet's axis; 0 for no fan"),
                Parameter("fan_position", "m", -10.0, 10.0, (0.9, 0.0, 0.7), "a point on the jet's axis", size=3),
                Parameter(
                    "fan_direction",
                    "1",
                    -1e3,
                    1e3,
                    (0.0, 1.0, 0.0),
                    "along which the jet blows; any length",
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
            "Rotors lift more close above the ground; see `artde_gym.disturbances.ground_effect`.",
            (Parameter("strength", "1", 0.0, 10.0, 1.0, "times which the published gain of thrust is larger"),),
            shorthand="strength",
            requires="rotors",
        ),
        DisturbanceSpec(
            "sensor_noise",
            "White Gaussian noise on measurements, by standard deviation.",
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
                Parameter("angular_velocity", "rad/s", 0.0, 10.0, 0.0, "of the base or vehicle"),
            ),
            shorthand="position",
            requires="sensors",
        ),
        DisturbanceSpec(
            "encoder_bits",
            "Joint encoders of so many counts a turn; joint velocities are then differences of counts.",
            (Parameter("bits", "1", 6, 32, None, "2^bits counts a turn", integer=True),),
            shorthand="bits",
            requires="encoders",
        ),
        DisturbanceSpec(
            "action_delay",
            "Commands act late.",
            (Parameter("steps", "1", 0, 100, None, "by so many control periods", integer=True),),
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
            (Parameter("time_constant", "s", 0.0, 1.0, None, "of the lag; for rotors in place of their own 0.035 s"),),
            shorthand="time_constant",
            requires="actuators",
        ),
        DisturbanceSpec(
            "actuator_effectiveness",
            "A joint gives a share of the commanded torque only, or a rotor a share of its thrust.",
            (
                _word("joint", "joint", None, f"which one, or {ALL!r}"),
                Parameter("factor", "1", 0.0, 1.0, 0.0, "share that is left"),
                _time("start", 0.0, "from when"),
            ),
            multiple=True,
            requires="actuators",
        ),
        DisturbanceSpec(
            "mass_scale",
            "The robot is heavier or lighter than the nominal model, in all links, inertia included.",
            (Parameter("factor", "1", 0.5, 2.0, None, "true over nominal mass"),),
            shorthand="factor",
            requires="mass",
        ),
        DisturbanceSpec(
            "initial_pose",
            "The episode starts off the reference pose.",
            (
                _word("joint", "joint", ALL, f"which one, or {ALL!r}"),
                Parameter("offset", "rad", -0.5, 0.5, None, "added to the reference angle"),
            ),
            multiple=True,
            requires="joints",
        ),
        DisturbanceSpec(
            "initial_position",
            "The episode starts off the reference path, at rest.",
            (Parameter("offset", "m", -0.3, 0.3, None, "added to the reference position", size=3),),
            requires="flight",
        ),
        DisturbanceSpec(
            "rotor_inertia",
            'Rotors of another inertia than the nominal model\'s. It needs `actuator_inertia="rotor"`; `mass_scale` '
            "scales it, too.",
            (Parameter("inertia", "kg m^2", 0.005, 0.5, None, "reflected to each leg joint, instead of 0.045"),),
            shorthand="inertia",
            requires="armature",
        ),
        DisturbanceSpec(
            "mass_distribution",
            "Mass moves between the legs and the rest of the robot, inertia with it; the whole mass stays.",
            (Parameter("legs", "1", 0.5, 1.5, None, "mass of each link of the legs over the nominal one"),),
            shorthand="legs",
            requires="legs",
        ),
        DisturbanceSpec(
            "contact",
            "Softer or stiffer contact of feet and ground.",
            (
                Parameter(
                    "time_constant",
                    "s",
                    0.002,
                    0.05,
                    None,
                    "with which the ground pushes a foot out: in MuJoCo of its critically damped contacts (its own is "
                    "0.005 s), in Bullet 0.001 s over the share of the depth that it corrects in that time (0.0125 s)",
                ),
            ),
            shorthand="time_constant",
            requires="contact",
        ),
        DisturbanceSpec(
            "torque_limit",
            "Actuators that saturate below the bounds of the action.",
            (Parameter("limit", "Nm", 1.0, 40.0, None, "largest torque of each joint"),),
            shorthand="limit",
            requires="torque_limit",
        ),
    )
}
"""The kinds of this project by name."""

DISTURBANCES: Registry[DisturbanceSpec] = Registry(
    "disturbance", "artde_gym.disturbances", lambda loaded: {kind.name: kind for kind in kinds_of(loaded)}, OWN
)
"""All kinds by name: those of this project, of plug-ins, and those registered."""


def register_disturbance(kind: DisturbanceSpec, effect: Effect, *, replace: bool = False) -> None:
    """Make a kind of disturbance known to the grammar, to environments and to the command line.

    Environments of robots that have its capability, and "effects", apply it from the first step of an episode on.

    Args:
        kind: its name and parameters.
        effect: computes what it does to n robots.
        replace: whether it may take the place of one of the same name.

    Raises:
        OptionError: if its name is taken and `replace` is not given, or is one of this project's.
    """
    if kind.name in OWN:
        raise OptionError("disturbance", kind.name, f"a new name; these are taken: {', '.join(OWN)}")
    DISTURBANCES.register(kind.name, dataclasses.replace(kind, effect=effect), replace=replace)


def kinds_of(loaded: Any) -> tuple[DisturbanceSpec, ...]:
    """Check what an entry point of the group `artde_gym.disturbances` has brought: a kind with an effect, or several.

    Raises:
        OptionError: if it is anything else.
    """
    kinds = loaded if isinstance(loaded, tuple) else (loaded,)
    for kind in kinds:
        if not (isinstance(kind, DisturbanceSpec) and kind.effect is not None):
            raise OptionError(
                "entry point of artde_gym.disturbances", kind, "a Kind with an effect, or a tuple of them"
            )
    return kinds


def in_order() -> list[DisturbanceSpec]:
    """Return all kinds in the order in which their values are drawn, which is not that of their registration."""
    return [*OWN.values(), *(DISTURBANCES[name] for name in sorted(DISTURBANCES.keys() - OWN.keys()))]


INTRODUCTION = """\
# Disturbances

What happens to a robot beyond its own dynamics, as data: one JSON-able grammar for all environments, accepted by
`gymnasium.make(..., disturbances=...)`, by `env.reset(options={"disturbances": ...})` and by the command line.

    {"payload": 1.3,
     "push": [{"body": "chest", "magnitude": {"uniform": [5, 40]}, "direction": [1, 0, 0], "start": 28.0}],
     "friction": {"coefficient": {"choice": [0.7, 0.8, 0.9]}},
     "initial_pose": {"joint": "all", "offset": {"normal": [0, 0.001]}}}

In place of any number stands a number or a distribution: `{"uniform": [low, high]}`, `{"normal": [mean, std]}` (drawn
again until it lies in the allowed range) or `{"choice": [...]}`, whose items are vectors where the parameter is one.
Values are drawn at each reset from the environment's own seeded generator; `env.unwrapped.sampled_disturbances` holds
what was drawn, in the same grammar, and `info` the same as numbers (`disturbance.payload.mass`). What `reset` is given
replaces the disturbances of this and the following episodes; nothing is merged.

Several kinds act together; kinds marked *list* take several entries. Anything outside the grammar, or a kind that the
environment's robot does not honor, raises `DisturbanceError` when the environment is made or reset, with the key, the
value and what is allowed.

"""


def page() -> str:
    """The grammar as a Markdown page, from the tables that check it."""
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
            text += " (what a bare number stands for)" if parameter.name == kind.shorthand else ""
            row = (f"`{parameter.name}`", parameter.unit, allowed(parameter), default, text)
            lines.append("| " + " | ".join(row) + " |")
        lines.append("")
    return INTRODUCTION + "\n".join(lines)


def _known_by(kind: DisturbanceSpec, parameter: Parameter) -> str:
    """Name the robots that know a parameter."""
    return ", ".join(robot for robot in ROBOTS if kind.honored_by(robot) and parameter in kind.parameters_for(robot))


def parameters_of(kind: str, given: Any) -> dict[str, Any]:
    """Return a disturbance's parameters, also from the short form of a bare number or distribution."""
    if given is None:
        return {}
    scalar = DISTURBANCES[kind].shorthand
    names = {parameter.name for parameter in DISTURBANCES[kind].parameters}
    if isinstance(given, Mapping) and (scalar is None or not names.isdisjoint(given)):
        return dict(given)
    return {str(scalar): given}


def other_defaults(kind: DisturbanceSpec, parameter: Parameter) -> dict[str, Any]:
    """Return a parameter's defaults of robots that have another one than the kind."""
    path = f"{kind.name}.{parameter.name}"
    return {name: kit.defaults[path] for name, kit in ROBOTS.items() if path in kit.defaults}


def allowed(parameter: Parameter) -> str:
    """What a parameter accepts, in words."""
    if isinstance(parameter.choices, str):
        return f"a {parameter.choices} of the robot"
    if parameter.choices:
        return ", ".join(parameter.choices)
    unit = "" if parameter.unit in ("", "1") else f" {parameter.unit}"
    number = "whole numbers " if parameter.integer else ""
    each = f"{parameter.size} numbers, each " if parameter.size > 1 else ""
    return f"{each}{number}{parameter.low:g} to {parameter.high:g}{unit}, or a distribution of such values"
