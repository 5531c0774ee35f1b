"""Tracking task of an arm for single and vector environments: layouts, reward, termination, friction, documentation."""

from __future__ import annotations

import dataclasses
import functools
import math
import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Self, TypeVar

import numpy as np

from artde_gym.arguments import check_number, steps_per_period
from artde_gym.arrays import Array
from artde_gym.disturbances import Disturbances
from artde_gym.disturbances.friction import KIND as FRICTION
from artde_gym.disturbances.friction import check_friction
from artde_gym.errors import DisturbanceError, OptionError
from artde_gym.layout import Field, Layout
from artde_gym.metrics_spec import EffortSignal, Fields, MetricsSpec, TrackedSignal
from artde_gym.multibody.dynamics import GRAVITY, RigidBodyTree
from artde_gym.multibody.manipulator import TOOL
from artde_gym.multibody.spec import RobotSpec, Vector
from artde_gym.robots.arm.drawing import drawn
from artde_gym.robots.arm.panda import panda
from artde_gym.robots.arm.reader import read_arm
from artde_gym.robots.arm.reference import reference
from artde_gym.robots.arm.tool import Tool
from artde_gym.robots.arm.workspace import smallest_inertia
from artde_gym.robots.joint_task import TIME_STEP, JointTask
from artde_gym.sim.engine import World

MAX_SPEED = 200.0  # rad/s or m/s, bound of observed joint speeds; of joints without a limit of their own the fastest
TURN = 2 * math.pi  # rad, bound of observed angles of joints without limits
FAR = 10.0  # m, bound of observed positions of the tool

REWARD_SCALES: dict[str, float] = {"alive": 1.0, "tracking": 2.0, "effort": -0.05, "smoothness": -0.05}
"""The reward of a control period L is L times the sum of these scales times their terms (see `DOCUMENTATION`)."""
FALL_REASONS = ("position", "speed")

Number = TypeVar("Number", float, Array)

DOCUMENTATION = """\
## Robot
`robot="panda"`, the built-in arm with seven joints (`artde_gym.robots.arm.panda` cites its parameters), or the path of
a URDF or MJCF file; `artde_gym.robots.arm.reader.read_arm` says what it may contain. The joints from the base to the
tip are actuated. Engines without joint friction get it as a torque: damping x qd + coulomb x tanh(qd / slip).

## Action
`tau`: torque (Nm) or force (N) of each joint, held for one control period and clipped to the joint's limit.

## Observation
That of the built-in arm; with n joints each field of joints has n components.

{observation}

`tau_applied` are the motors' torques that acted, after saturation, without friction.

## Reward
For a control period L, L times the sum of scale x term; `info` has each term (`reward_alive`, ...):

| term | scale | value |
|---|---|---|
| `alive` | 1 | 1 |
| `tracking` | 2 | exp(-e^T e / 0.002), e = q_ref - q in rad or m |
| `effort` | -0.05 | mean of (tau / limit)^2 |
| `smoothness` | -0.05 | mean of (change of tau / limit)^2 |

## Start
The arm rests in the reference's first pose, in equilibrium with a payload that is attached from the start.

## End
*Terminated* when a joint leaves its limits of position (`info["fell_position"]`) or of speed (`fell_speed`), at which a
real arm stops. *Truncated* at the end of the reference. Limits are no contacts, and links pass through each other.

## Arguments
| name | default | allowed | meaning |
|---|---|---|---|
| `robot` | "panda" | "panda", path | the arm |
| `tip` | None | link of the file | end of the chain of joints; None: where it ends or branches |
| `armature` | None | kg m^2, one number or one for each joint | reflected rotor inertia; None: the file's |
| `joints` | None | names of joints on one way from the base | those that move; None: all to the tip |
| `reference` | "pick-and-place" | see `artde_gym.robots.arm.reference` | reference of the joints |
| `disturbances` | {default} | see `artde_gym.disturbances` | disturbances; `{{}}` for none but nominal friction |
| `control_period` | 0.001 | whole multiples of 0.001 s up to 0.05 | control period L |
| `duration` | 12.0 | 0.1 to 1800 s | duration of an episode |"""
"""Text of all pages, with `{observation}` and `{default}` to be filled in; further arguments follow."""


def observation_layout(spec: RobotSpec) -> Layout:
    """Return the layout of an arm's observations."""
    n, links = len(spec.actuated), [spec.by_name[name] for name in spec.actuated]
    low = tuple(link.limits[0] - 1.0 if math.isfinite(link.limits[0]) else -10 * TURN for link in links)
    high = tuple(link.limits[1] + 1.0 if math.isfinite(link.limits[1]) else 10 * TURN for link in links)
    effort = spec.torque_limits
    units = _units(spec)
    return Layout(
        (
            Field("q", n, units[0], low, high, "joint positions"),
            Field("qd", n, units[1], -MAX_SPEED, MAX_SPEED, "joint velocities"),
            Field("q_ref", n, units[0], low, high, "reference positions"),
            Field("qd_ref", n, units[1], -MAX_SPEED, MAX_SPEED, "reference velocities"),
            Field("qdd_ref", n, units[2], -1e4, 1e4, "reference accelerations"),
            Field("tau_applied", n, units[3], tuple(-one for one in effort), effort, "torques of the last period"),
            Field("tool", 3, "m", -FAR, FAR, "position of the tool, world axes"),
            Field("tool_ref", 3, "m", -FAR, FAR, "its reference"),
        )
    )


def action_layout(spec: RobotSpec) -> Layout:
    """Return the layout of an arm's actions."""
    effort = spec.torque_limits
    low = tuple(-one for one in effort)
    return Layout((Field("tau", len(effort), _units(spec)[3], low, effort, "torques of the joints, base to tip"),))


def _units(spec: RobotSpec) -> tuple[str, str, str, str]:
    """Return the units of position, velocity, acceleration and torque."""
    sliding = {spec.by_name[name].prismatic for name in spec.actuated}
    if sliding == {False}:
        return "rad", "rad/s", "rad/s^2", "Nm"
    if sliding == {True}:
        return "m", "m/s", "m/s^2", "N"
    return "rad or m", "rad/s or m/s", "rad/s^2 or m/s^2", "Nm or N"


def _tool_error(fields: Fields) -> Array:
    return fields["tool_ref"] - fields["tool"]


def _angle_error(columns: Sequence[int], fields: Fields) -> Array:
    return (fields["q_ref"] - fields["q"])[..., columns]


def _power(fields: Fields) -> Array:
    return np.abs(fields["tau_applied"] * fields["qd"]).sum(axis=-1)


def metrics_spec(spec: RobotSpec) -> MetricsSpec:
    """Return the tracked signals of an arm: the tool's position, its turning joints, and all torques."""
    turning = {f"q{i + 1}": i for i, name in enumerate(spec.actuated) if not spec.by_name[name].prismatic}
    columns = list(turning.values())
    joints = {name: number for number, name in enumerate(turning)}
    tool = TrackedSignal("mm", 1e3, {"x": 0, "y": 1, "z": 2}, _tool_error)
    angles = TrackedSignal("deg", 180.0 / math.pi, joints, functools.partial(_angle_error, columns))
    n = len(spec.actuated)
    return MetricsSpec(
        errors=(tool, angles) if turning else (tool,),
        norm=True,
        settling_band=0.001,
        efforts=(EffortSignal("torque", "nm", "tau_applied", slice(n), {f"q{i + 1}": i for i in range(n)}),),
        power=_power,
        saturated_field="tau_applied",
        saturation_margin=0.0,
        tde_errors={"tde_error_rms": "sigma"},
        diagnostic_means={"robust_gain_mean": "c"},
    )


@dataclasses.dataclass(frozen=True)
class Tracking(JointTask):
    """An arm that follows a reference.

    Attributes:
        tool: reference of the tool in the observation, one row per control period: (samples, 3).
        damping, coulomb, slip: joint friction (n,).
    """

    tool: Array
    damping: Array
    coulomb: Array
    slip: Array

    @classmethod
    def of(
        cls,
        robot: str | os.PathLike[str],
        tip: str | None,
        armature: float | Sequence[float] | None,
        joints: Sequence[str] | None,
        given: Any,
        control_period: float,
        duration: float,
    ) -> Self:
        """Build it from the arguments of an environment.

        Raises:
            OptionError: for an argument out of range.
            RobotError: for a file that cannot be simulated.
        """
        substeps = steps_per_period(control_period, TIME_STEP)
        seconds = check_number("duration", duration, 0.1, 1800.0, "0.1 to 1800 s")
        spec = arm(robot, tip, armature, joints)
        period = substeps * TIME_STEP
        last = max(1, round(seconds / period))
        found = reference(spec, given, period * np.arange(last + 1))
        plan = np.concatenate(found, axis=1)
        arguments = (robot, tip, armature, joints, given, control_period, duration)
        tool = Tool(spec).position(found.q)
        return cls(spec, spec, substeps, plan, arguments, tool, *_friction(spec))

    def parse(self, disturbances: Mapping[str, Any]) -> Disturbances:
        parsed = super().parse(disturbances)
        check_friction(parsed.entries, float(smallest_inertia(self.nominal_robot).min()), TIME_STEP)
        for kind, entry in parsed.entries:
            if kind == "sensor_noise" and (entry["tilt"] != 0 or entry["angular_velocity"] != 0):
                raise DisturbanceError("sensor_noise", dict(entry), "position, velocity: the base of an arm is fixed")
        return parsed

    def set_up(self, world: World, sampled: Mapping[str, Any]) -> None:
        """Apply sampled disturbances to a world, except the payload."""
        world.scale_masses(sampled.get("mass_scale", {}).get("factor", 1.0))

    def placed(self, sampled: Mapping[str, Any]) -> Mapping[str, Any]:
        if "payload" not in sampled:
            return sampled
        payload = sampled["payload"]
        place = np.add(payload["position"], self.tool_point).tolist()
        return {**sampled, "payload": {**payload, "position": place}}

    @property
    def tool_point(self) -> Vector:
        """Position of the tool in the frame of the link that carries it (m)."""
        return next(point for name, _, point in self.nominal_robot.sites if name == TOOL)

    def balance(self, sampled: Mapping[str, Any]) -> Array:
        """Return torques (n,) that hold the arm at the start, within their limits."""
        tree, q = RigidBodyTree(self.nominal_robot), self.pose(sampled)
        tau = sampled.get("mass_scale", {}).get("factor", 1.0) * tree.joint_torques(q, 0 * q, 0 * q)
        payload = self.placed(sampled).get("payload")
        if payload is not None and payload["attach_time"] == 0 and payload["detach_time"] > 0:
            link = self.nominal_robot.payload_link
            jacobian = tree.jacobian(link, q)[:, 6:]
            arm = tree.rotation(link, q) @ np.asarray(payload["position"])
            tau = tau + payload["mass"] * GRAVITY * (jacobian[2] + np.cross(jacobian[3:].T, arm)[:, 2])
        limit = np.array(self.nominal_robot.torque_limits)
        return np.clip(tau, -limit, limit)

    def friction(self, scale: Array | float, qd: Array) -> Array:
        """Return the torques of joint friction (..., n) (Nm), against the motion."""
        return -scale * (self.damping * qd + self.coulomb * np.tanh(qd / self.slip))


def friction_scale(sampled: Mapping[str, Any]) -> float:
    """Return the factor of the nominal joint friction."""
    return sampled.get(FRICTION, {}).get("scale", 1.0)


def arm(
    robot: str | os.PathLike[str] = "panda",
    tip: str | None = None,
    armature: float | Sequence[float] | None = None,
    joints: Sequence[str] | None = None,
) -> RobotSpec:
    """Return a built-in arm or one from a file.

    Raises:
        OptionError: for anything but a name or a path, or a tip, armature or joints of a built-in arm.
        RobotError: for a file that cannot be simulated.
    """
    if not isinstance(robot, (str, os.PathLike)):
        raise OptionError("robot", robot, "'panda', or the path of a URDF or MJCF file")
    if robot != "panda":
        return drawn(read_arm(robot, tip=tip, armature=armature, joints=joints))
    for name, value in (("tip", tip), ("armature", armature), ("joints", joints)):
        if value is not None:
            raise OptionError(name, value, "None with a built-in arm")
    return panda()


def _friction(spec: RobotSpec) -> tuple[Array, Array, Array]:
    """Return damping, dry friction and slip (n,); slip is raised where an explicit step would be unstable.

    Raises:
        OptionError: for a damping that is too large for a time step.
    """
    links, inertia = [spec.by_name[name] for name in spec.actuated], smallest_inertia(spec)
    damping, coulomb, slip = (
        np.array([getattr(link, name) for link in links]) for name in ("damping", "coulomb", "slip")
    )
    for name, value, most in zip(spec.actuated, damping, inertia / TIME_STEP, strict=True):
        if value > most:
            allowed = f"at most {most:.3g}, its smallest inertia over {TIME_STEP} s; servos' models carry such values"
            raise OptionError(f"damping of joint {name!r}", float(value), allowed)
    return damping, coulomb, np.maximum(slip, coulomb * TIME_STEP / inertia)


def reward_terms(error: Number, effort: Number, change: Number, exp: Callable[[Number], Number]) -> dict[str, Number]:
    """Return the reward's terms in the order of `REWARD_SCALES`, elementwise.

    Args:
        error: squared norm of the tracking error (rad^2).
        effort, change: mean squares of the torques and of their change in a control period, over the limits.
        exp: the exponential function for this type of number.
    """
    return {"alive": 0.0 * effort + 1.0, "tracking": exp(-error / 0.002), "effort": effort, "smoothness": change}


class Limits:
    """Limits of position and speed whose violation ends an episode."""

    def __init__(self, spec: RobotSpec) -> None:
        links = [spec.by_name[name] for name in spec.actuated]
        self._low, self._high = np.array([link.limits for link in links]).T
        self._speed = np.minimum([link.speed for link in links], MAX_SPEED)

    def falls(self, q: Array, qd: Array) -> tuple[Any, Any]:
        """Return which of `FALL_REASONS` hold (...); a state with NaN violates both."""
        inside = ((q >= self._low) & (q <= self._high)).all(axis=-1)
        return inside ^ True, (np.abs(qd) <= self._speed).all(axis=-1) ^ True
