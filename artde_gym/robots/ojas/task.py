"""Walking task of Ojas for single and vector environments: layouts, reward, termination, walk and documentation."""

from __future__ import annotations

import dataclasses
import math
import pickle
import weakref
from collections.abc import Callable, Mapping
from typing import Any, Literal, Self, TypeVar, get_args

import numpy as np

from artde_gym.arguments import check_bool, check_choice, steps_per_period
from artde_gym.arrays import Array
from artde_gym.disturbances import Disturbances
from artde_gym.disturbances.actuation import Actuation
from artde_gym.disturbances.friction import KIND as JOINT_FRICTION
from artde_gym.disturbances.friction import check_friction
from artde_gym.disturbances.ground import GrfPulses
from artde_gym.disturbances.sensing import Sensing
from artde_gym.errors import DisturbanceError
from artde_gym.layout import Field, Layout
from artde_gym.metrics_spec import EffortSignal, MetricsSpec, TrackedSignal
from artde_gym.multibody.dynamics import GRAVITY, RigidBodyTree, joint_space_inertia
from artde_gym.multibody.spec import Vector
from artde_gym.multibody.support import Supported
from artde_gym.robots.joint_task import TIME_STEP, JointTask
from artde_gym.robots.ojas import model as robot
from artde_gym.robots.ojas.model import ActuatorInertia, ojas
from artde_gym.robots.ojas.walking import WalkingPattern, hip_height_above_ankle, walking_pattern
from artde_gym.sim.engine import World

Arms = Literal["fixed", "revolute"]

FRICTION = 0.8  # coefficient between feet and ground
FALL_TILT_DEG = 35.0
FALL_HEIGHT = 0.25  # m, of the base; while walking, the hips are at 0.395 m or higher
SETTLE_STEPS = 300  # physics steps before the first control period, in which feet and payload settle
SETTLE_POSE_STEPS = 1000  # the same on a slope or in another pose, where the robot rocks first
SETTLE_STIFFNESS = 420.0  # Nm/rad, that of TDE at 1 ms, Kd m_bar / L
SETTLE_DAMPING = 10.0  # Nm s/rad
BARE_DAMPING = 0.5  # Nm s/rad, without rotors: held for a step, more than 2 M / TIME_STEP diverges for a foot
MAX_SPEED = 200.0  # rad/s, bound of observed joint speeds

N_JOINTS = 12

OBSERVATION = Layout(
    (
        Field("q", N_JOINTS, "rad", -2 * math.pi, 2 * math.pi, "leg joint angles, left q1..q6 then right q1..q6"),
        Field("qd", N_JOINTS, "rad/s", -MAX_SPEED, MAX_SPEED, "leg joint velocities"),
        Field("q_ref", N_JOINTS, "rad", -math.pi, math.pi, "reference angles"),
        Field("qd_ref", N_JOINTS, "rad/s", -50.0, 50.0, "reference velocities"),
        Field("qdd_ref", N_JOINTS, "rad/s^2", -1000.0, 1000.0, "reference accelerations"),
        Field(
            "tau_applied",
            N_JOINTS,
            "Nm",
            -robot.TORQUE_LIMIT,
            robot.TORQUE_LIMIT,
            "torques applied over the last control period",
        ),
        Field("base_height", 1, "m", -1.0, 2.0, "base origin (middle of the hip line) above the ground"),
        Field("tilt", 2, "rad", -math.pi, math.pi, "roll about x and pitch about y of the base"),
        Field("base_velocity", 3, "m/s", -100.0, 100.0, "velocity of the base origin, world axes"),
        Field("base_angular_velocity", 3, "rad/s", -MAX_SPEED, MAX_SPEED, "angular velocity of the base, world axes"),
        Field("contact", 2, "1", 0.0, 1.0, "1 if the left, right foot carries more than 1 N"),
        Field("load_left_ref", 1, "1", 0.0, 1.0, "planned share of the weight on the left foot"),
        Field("phase", 1, "1", 0.0, 1.0, "progress within a stride of two steps; 0 while standing"),
    )
)
GROUND_FORCE = Field(
    "ground_force", 6, "N", -1e4, 1e4, "force of the ground on the left and the right foot, world axes"
)
ACTION = Layout(
    (Field("tau", N_JOINTS, "Nm", -robot.TORQUE_LIMIT, robot.TORQUE_LIMIT, "leg joint torques, left then right"),)
)

_RIGHT_LEG = {f"q{i + 1}": N_JOINTS // 2 + i for i in range(N_JOINTS // 2)}  # as in the thesis' tables
METRICS_SPEC = MetricsSpec(
    errors=(TrackedSignal("deg", 180.0 / math.pi, _RIGHT_LEG, lambda fields: fields["q_ref"] - fields["q"]),),
    norm=False,
    settling_band=math.radians(0.5),
    efforts=(EffortSignal("torque", "nm", "tau_applied", slice(N_JOINTS), _RIGHT_LEG),),
    power=lambda fields: np.abs(fields["tau_applied"] * fields["qd"]).sum(axis=-1),
    saturated_field="tau_applied",
    saturation_margin=0.0,
    tde_errors={"tde_error_rms": "sigma"},
    diagnostic_means={"robust_gain_mean": "c"},
    recorded_info=("foot_loads",),
    speed=lambda fields: fields["base_velocity"][..., 0],
)

REWARD_SCALES: dict[str, float] = {
    "alive": 1.0,
    "tracking": 2.0,
    "upright": 0.5,
    "effort": -0.05,
    "smoothness": -0.05,
}
"""The reward of a control period L is L times the sum of these scales times their terms (see `DOCUMENTATION`)."""
FALL_REASONS = ("tilt", "height", "speed")

Number = TypeVar("Number", float, Array)

DOCUMENTATION = """\
## Action
`tau`, `Box(-40, 40, (12,), float64)`: joint torques in Nm, left leg then right leg, each q1..q6 = hip yaw, hip roll,
hip pitch, knee, ankle pitch, ankle roll. Held for one control period; clipped to the bounds. Use Gymnasium's
`RescaleAction` for [-1, 1].

## Observation
{observation}

`tau_applied` are the torques that acted, after saturation, as needed by the time-delay estimate.

## Reward
For a control period L, L times the sum of scale x term; `info` has each term (`reward_alive`, ...):

| term | scale | value |
|---|---|---|
| `alive` | 1 | 1 |
| `tracking` | 2 | exp(-e^T e / 0.02), e = q_ref - q in rad |
| `upright` | 0.5 | exp(-tilt^2 / 0.05) |
| `effort` | -0.05 | mean of (tau / 40 Nm)^2 |
| `smoothness` | -0.05 | mean of (change of tau / 40 Nm)^2 |

A walk of 58 s without an error earns a little under 203.

## Start
The robot stands on both feet in the pattern's first pose, at rest, in equilibrium with its payload.

## End
*Terminated* by a fall: tilt above 35 degrees (`info["fell_tilt"]`), base below 0.25 m (`fell_height`), or joint speeds
with a norm above 200 rad/s (`fell_speed`: the motion has diverged). *Truncated* at the end of the walk.

## Arguments
| name | default | allowed | meaning |
|---|---|---|---|
| `disturbances` | {default} | see `artde_gym.disturbances` | disturbances; `{{}}` for none |
| `control_period` | 0.001 | whole multiples of 0.001 s up to 0.05 | control period L |
| `actuator_inertia` | "rotor" | "rotor", "lumped", "none" | geared rotors, discs (3x faster), none |
| `arms` | "fixed" | "fixed", "revolute" | "revolute": all 20 joints, with arms held by motors |
| `self_collision` | False | False, True | whether the feet collide or overlap |
| `speed` | 0.1 | 0 to 0.25 m/s | walking speed |
| `step_duration` | 1.0 | 0.6 to 2 s | duration of one step |
| `duration` | 58.0 | 0.1 to 1800 s | duration of the walk; 2 s of standing at either end, so no step below 5 s |
| `observe_ground_force` | False | False, True | append the ground's force on each foot to the observation |"""
"""Text of all pages, with `{observation}` and `{default}` to be filled in; further arguments follow."""


@dataclasses.dataclass(frozen=True)
class Walk(JointTask):
    """A walk of Ojas; all environments of a process that walk alike share its read-only `plan`, (samples, 38).

    Attributes:
        pattern: walking pattern.
        position: position of the base at the start (m), with the robot upright.
        stand: joint torques (12,) (Nm) that balance the pattern's first pose.
        damping: damping of the joints while the robot settles (Nm s/rad).
    """

    pattern: WalkingPattern
    position: Vector
    stand: Array
    damping: float

    @classmethod
    def of(
        cls,
        control_period: float,
        actuator_inertia: ActuatorInertia,
        arms: Arms,
        self_collision: bool,
        speed: float,
        step_duration: float,
        duration: float,
    ) -> Self:
        """Build it from the arguments of an environment.

        Raises:
            OptionError: for an argument out of range.
        """
        check_choice("actuator_inertia", actuator_inertia, get_args(ActuatorInertia))
        check_choice("arms", arms, get_args(Arms))
        nominal = ojas(actuator_inertia)
        collide = check_bool("self_collision", self_collision)
        model = dataclasses.replace(ojas(actuator_inertia, arms=arms), feet_collide=collide)
        substeps = steps_per_period(control_period, TIME_STEP)
        pattern = walking_pattern(speed, step_duration, duration, TIME_STEP)
        plan = _shared_plan(pattern, (float(speed), float(step_duration), float(duration), substeps))
        hip_height = robot.ANKLE_HEIGHT + hip_height_above_ankle(speed)
        rest = np.zeros(N_JOINTS)
        stand = Supported(nominal).torque(0.5, pattern.q[0], rest, rest)
        damping = BARE_DAMPING if actuator_inertia == "none" else SETTLE_DAMPING
        place = (float(pattern.base[0, 0]), 0.0, hip_height)
        arguments = (control_period, actuator_inertia, arms, self_collision, speed, step_duration, duration)
        return cls(nominal, model, substeps, plan, arguments, pattern, place, stand, damping)

    def parse(self, disturbances: Mapping[str, Any]) -> Disturbances:
        parsed = super().parse(disturbances)
        if not any(self.nominal_robot.armature) and any(kind == "rotor_inertia" for kind, _ in parsed.entries):
            problem = "needs rotors, which discs and bare links have not"
            raise DisturbanceError("disturbances", "rotor_inertia", "choose actuator_inertia='rotor'", problem)
        if any(kind == JOINT_FRICTION for kind, _ in parsed.entries):
            inertia = joint_space_inertia(RigidBodyTree(self.nominal_robot).mass_matrix(self.start))
            check_friction(parsed.entries, float(1.0 / np.diagonal(np.linalg.inv(inertia)).max()), TIME_STEP)
        return parsed

    def set_up(self, world: World, sampled: Mapping[str, Any]) -> None:
        """Apply sampled disturbances to a world, except the payload."""
        world.set_friction(sampled.get("friction", {}).get("coefficient", FRICTION))
        world.set_gravity(gravity(**sampled.get("slope", {})))
        factor = sampled.get("mass_scale", {}).get("factor", 1.0)
        rotors = sampled.get("rotor_inertia", {}).get("inertia", robot.ARMATURE) / robot.ARMATURE
        world.scale_masses(factor, self._mass_factors(sampled), rotors)
        world.set_contact_time(sampled.get("contact", {}).get("time_constant"))

    def _mass_factors(self, sampled: Mapping[str, Any]) -> dict[str, float]:
        """Return factors of the links' masses by name; the rest of the robot compensates for the legs' masses."""
        if "mass_distribution" not in sampled:
            return {}
        legs = sampled["mass_distribution"]["legs"]
        masses = {link.name: link.mass for link in self.robot.links}
        of_legs = math.fsum(masses[name] for name in self.robot.actuated)
        rest = 1.0 + (1.0 - legs) * of_legs / (math.fsum(masses.values()) - of_legs)
        return {name: legs if name in self.robot.actuated else rest for name in masses}

    def pulses(self, n: int) -> GrfPulses:
        """Return the ground reaction pulses of `n` robots on this walk."""
        return GrfPulses(n, self.pattern.load_left, TIME_STEP)

    def hold(self, pose: Array, q: Array, qd: Array) -> Array:
        """Return torques (..., 12) (Nm) of joint springs with which the robot settles in a pose.

        Springs share the load evenly between the legs. A rigid hold would not: legs and ground are a closed chain, in
        which any initial error causes antagonistic torques of several Nm.
        """
        return self.stand + SETTLE_STIFFNESS * (pose - q) - self.damping * qd


_plans: weakref.WeakValueDictionary[tuple[float, ...], Array] = weakref.WeakValueDictionary()
"""Plans of the environments that exist, by the walk's arguments and the substeps."""


def _shared_plan(pattern: WalkingPattern, key: tuple[float, ...]) -> Array:
    """Return the plan of a walk, `Walk.plan`."""
    plan = _plans.get(key)
    if plan is None:
        columns = (pattern.q, pattern.qd, pattern.qdd, pattern.load_left[:, None], pattern.phase[:, None])
        plan = np.concatenate([column[:: int(key[-1])] for column in columns], axis=1)
        plan.setflags(write=False)
        _plans[key] = plan
    return plan


def torque_limit(sampled: Mapping[str, Any]) -> float:
    """Return the largest torque (Nm) of a joint for sampled disturbances."""
    return sampled.get("torque_limit", {}).get("limit", robot.TORQUE_LIMIT)


def settling(sampled: Mapping[str, Any]) -> int:
    """Return the time steps that a robot at rest on level ground needs to settle with sampled disturbances."""
    if not sampled.keys().isdisjoint(("slope", "initial_pose")):
        return SETTLE_POSE_STEPS
    return (
        0
        if sampled.keys().isdisjoint(("payload", "friction", "mass_scale", "mass_distribution", "contact"))
        else SETTLE_STEPS
    )


LATER = ("push", "grf_pulse", *Actuation.KINDS, *Sensing.KINDS)
"""Disturbances that do not act before the first control period."""


def settled_by(sampled: Mapping[str, Any]) -> bytes:
    """Return a key of all sampled disturbances that may act while the robot settles; unknown ones are among them."""
    return pickle.dumps(sorted((kind, value) for kind, value in sampled.items() if kind not in LATER))


def reward_terms(
    error: Number, tilt: Number, effort: Number, change: Number, exp: Callable[[Number], Number]
) -> dict[str, Number]:
    """Return the reward's terms in the order of `REWARD_SCALES`, elementwise.

    Args:
        error: squared norm of the tracking error (rad^2).
        tilt: squared angle of the tilt (rad^2).
        effort, change: squared norms of the torques and of their change in a control period (Nm^2).
        exp: the exponential function for this type of number.
    """
    return {
        "alive": 0.0 * tilt + 1.0,
        "tracking": exp(-error / 0.02),
        "upright": exp(-tilt / 0.05),
        "effort": effort * _EFFORT_SCALE,
        "smoothness": change * _EFFORT_SCALE,
    }


def falls(quat_xyzw: tuple[Number, Number, Number, Number], height: Number, speed: Number) -> tuple[Any, Any, Any]:
    """Return which of `FALL_REASONS` hold, elementwise; a state with NaN has fallen.

    Args:
        quat_xyzw: attitude of the base.
        height: height of the base (m).
        speed: squared norm of the joint velocities (rad^2/s^2).
    """
    x, y, _, _ = quat_xyzw
    up = 1.0 - 2.0 * (x * x + y * y)  # world z component of the base's z axis
    return (up >= _COS_FALL) ^ True, height < FALL_HEIGHT, (speed <= MAX_SPEED * MAX_SPEED) ^ True


def observation_layout(ground_force: bool) -> Layout:
    """Return the observation's layout, with or without the ground's force on each foot."""
    return Layout((*OBSERVATION.fields, GROUND_FORCE)) if ground_force else OBSERVATION


def gravity(pitch_deg: float = 0.0, roll_deg: float = 0.0) -> Vector:
    """Return gravity (m/s^2) in the axes of a ground that rises by `pitch_deg` forward and `roll_deg` to the left."""
    ahead, left = math.tan(math.radians(pitch_deg)), math.tan(math.radians(roll_deg))
    size = GRAVITY / math.sqrt(1.0 + ahead * ahead + left * left)
    return (-size * ahead, -size * left, -size)


_COS_FALL = math.cos(math.radians(FALL_TILT_DEG))
_EFFORT_SCALE = 1.0 / (N_JOINTS * robot.TORQUE_LIMIT**2)
