"""Ojas walks along a given pattern under joint torques: what all its tasks share."""

from __future__ import annotations

import dataclasses
import math
import operator
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Literal

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from artde_gym.arrays import Array
from artde_gym.disturbances import Disturbances
from artde_gym.disturbances.actuation import Actuation
from artde_gym.disturbances.ground import LOADED, GrfPulse
from artde_gym.disturbances.schedule import Schedule
from artde_gym.disturbances.sensing import Sensing
from artde_gym.envs.documentation import filled
from artde_gym.envs.live import Live
from artde_gym.envs.options import disturbances_in, steps_per_period
from artde_gym.envs.view import View
from artde_gym.errors import ActionError, OptionError
from artde_gym.layout import Field, Layout
from artde_gym.references.walking import WalkingPattern, hip_height_above_ankle, walking_pattern
from artde_gym.robots import ojas as robot
from artde_gym.robots.dynamics import GRAVITY
from artde_gym.robots.ojas import ActuatorInertia, ojas
from artde_gym.robots.support import Supported
from artde_gym.sim.engine import Camera, Engine, State
from artde_gym.sim.factory import EngineName, make_engine
from artde_gym.tracking import Effort, Tracked, Tracking

TIME_STEP = 0.001  # s, of the physics
FRICTION = 0.8  # of feet and ground
FALL_TILT_DEG = 35.0
FALL_HEIGHT = 0.25  # m, of the base; the hips walk at 0.395 m or higher
SETTLE = 0.3  # s, before the first step, for feet and payload to come to rest
SETTLE_POSE = 1.0  # s, likewise on a slope or in another pose, where the robot rocks first
SETTLE_STIFFNESS = 420.0  # Nm/rad: what TDE at 1 ms has, Kd m_bar / L
SETTLE_DAMPING = 10.0  # Nm s/rad
BARE_DAMPING = 0.5  # Nm s/rad, likewise without rotors: held for a step, more than 2 M / TIME_STEP of a foot diverges
MAX_SPEED = 200.0  # rad/s, bound of observed joint speeds

CAMERA_HEIGHT = 0.42  # m, of what it looks at
LEEWAY = 0.15  # m, that the robot may be off its pattern before the camera goes with it

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
            "torques really applied over the last control period",
        ),
        Field("base_height", 1, "m", -1.0, 2.0, "base origin (middle of the hip line) above the ground"),
        Field("tilt", 2, "rad", -math.pi, math.pi, "roll about x and pitch about y of the base"),
        Field("base_velocity", 3, "m/s", -100.0, 100.0, "of the base origin, world axes"),
        Field("base_angular_velocity", 3, "rad/s", -MAX_SPEED, MAX_SPEED, "of the base, world axes"),
        Field("contact", 2, "1", 0.0, 1.0, "1 where the left, right foot carries more than 1 N"),
        Field("load_left_ref", 1, "1", 0.0, 1.0, "share of the weight that the pattern puts on the left foot"),
        Field("phase", 1, "1", 0.0, 1.0, "progress within a stride of two steps; 0 while standing"),
    )
)
GROUND_FORCE = Field(
    "ground_force", 6, "N", -1e4, 1e4, "force of the ground on the left and the right foot, world axes"
)
ACTION = Layout(
    (Field("tau", N_JOINTS, "Nm", -robot.TORQUE_LIMIT, robot.TORQUE_LIMIT, "leg joint torques, left then right"),)
)
FOOT_SITES = ("left_foot", "right_foot")

_RIGHT_LEG = {f"q{i + 1}": N_JOINTS // 2 + i for i in range(N_JOINTS // 2)}  # what the thesis' tables show
TRACKING = Tracking(
    errors=(Tracked("deg", 180.0 / math.pi, _RIGHT_LEG, lambda fields: fields["q_ref"] - fields["q"]),),
    norm=False,
    band=math.radians(0.5),
    efforts=(Effort("torque", "nm", "tau_applied", slice(N_JOINTS), _RIGHT_LEG),),
    power=lambda fields: np.abs(fields["tau_applied"] * fields["qd"]).sum(axis=-1),
    limited="tau_applied",
    near=0.0,
    tde_errors={"tde_error_rms": "sigma"},
    means={"robust_gain_mean": "c"},
    told=("foot_loads",),
    speed=lambda fields: fields["base_velocity"][..., 0],
)

REWARD_SCALES: dict[str, float] = {
    "alive": 1.0,
    "tracking": 2.0,
    "upright": 0.5,
    "effort": -0.05,
    "smoothness": -0.05,
}
"""The reward of a control period L is L times the sum of these scales times their terms (see `TASK_DOCUMENTATION`)."""

TASK_DOCUMENTATION = """\
## Action
`Box(-40, 40, (12,), float64)`, joint torques in Nm, left leg then right leg, each q1..q6 = hip yaw, hip roll, hip
pitch, knee, ankle pitch, ankle roll. Held for one control period; clipped to the bounds. Use Gymnasium's
`RescaleAction` for [-1, 1].

## Observation
{observation}

`tau_applied` is what really acted, after saturation: the time-delay estimate needs just that.

## Reward
Over a control period L, L times the sum of scale x term; each term is in `info["reward_terms"]`:

| term | scale | value |
|---|---|---|
| `alive` | 1 | 1 |
| `tracking` | 2 | exp(-|e|^2 / 0.02), e = q_ref - q in rad |
| `upright` | 0.5 | exp(-tilt^2 / 0.05) |
| `effort` | -0.05 | mean of (tau / 40 Nm)^2 |
| `smoothness` | -0.05 | mean of (change of tau / 40 Nm)^2 |

A walk of 58 s without an error earns a little under 203.

## Start
The robot stands on both feet in the pattern's first pose, at rest, in balance with its payload.

## End
*Terminated* when it has fallen: tilt above 35 degrees (`info["fall_reason"] == "tilt"`), base below 0.25 m
(`"height"`), or joint speeds whose norm passes 200 rad/s (`"speed"`: it has diverged). *Truncated* at the end of the
walk.

## Arguments
| name | default | allowed | meaning |
|---|---|---|---|
| `disturbances` | {default} | see `artde_gym.disturbances` | what happens besides; `{{}}` for nothing |
| `control_period` | 0.001 | whole multiples of 0.001 s up to 0.05 | time between two actions, L |
| `actuator_inertia` | "rotor" | "rotor", "lumped", "none" | geared rotors, discs (3x faster), nothing |
| `arms` | "fixed" | "fixed", "revolute" | all 20 joints with "revolute": arms held by motors |
| `self_collision` | False | False, True | whether the feet stop each other, or overlap |
| `speed` | 0.1 | 0 to 0.25 m/s | walking speed |
| `step_duration` | 1.0 | 0.6 to 2 s | time of one step |
| `duration` | 58.0 | from 0.1 s | length of the walk |
| `observe_ground_force` | False | False, True | append the ground's force on each foot to the observation |
| `engine` | "bullet" | "bullet", "mujoco" | physics engine; see docs/engines.md |
| `width`, `height` | 640, 480 | 16 to 4096 | pixels of a picture |
| `window` | False | False, True | a window of Bullet's own, on a display; see `artde-gym play` |

With `render_mode="rgb_array"`, `render` draws 30 pictures a simulated second; asked more often, it gives the last one
again. Words of your own in `env.unwrapped.view.caption` are written into each of them.

`reset(options={{"disturbances": ..., "scenario": "S2"}})` replaces the disturbances of this and the following
episodes, by a mapping or by those of a named scenario.

## Info
`time_s`, `reward_terms`, `foot_loads` (normal force on each foot, N); at reset `disturbances` (realised values, as
the grammar writes them); `events` when a push or a payload begins or ends; after a fall `fall_reason`.
"""
"""Sections of a task's documentation that are the same for all; `{observation}` and `{default}` are filled in."""


class BipedEnv(Live, gym.Env[NDArray[Any], NDArray[Any]]):
    """What all tasks of Ojas share; a subclass says what disturbs the walk by default.

    Args:
        disturbances: in place of the task's own; see `artde_gym.disturbances`.
        control_period: time between two actions (s), a whole multiple of the physics' 0.001 s.
        actuator_inertia: see `artde_gym.robots.ojas`.
        arms: see `artde_gym.robots.ojas`.
        self_collision: whether the feet stop each other; a walk as planned never lets them touch.
        speed: see `artde_gym.references.walking`, also for `step_duration` and `duration`.
        observe_ground_force: whether the observation ends with the ground's force on each foot.
        engine: physics engine.
        width, height: of pictures (pixels).
        window: whether Bullet shows the robot in a window of its own.
        render_mode: "rgb_array" or None.

    Raises:
        OptionError: for an argument out of range.
        DisturbanceError: for a malformed disturbance.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 50}

    default_disturbances: ClassVar[Mapping[str, Any]] = {}
    action_layout = ACTION
    robot_name = "ojas"
    tracking = TRACKING

    def __init__(
        self,
        *,
        disturbances: Mapping[str, Any] | None = None,
        control_period: float = 0.001,
        actuator_inertia: ActuatorInertia = "rotor",
        arms: Literal["fixed", "revolute"] = "fixed",
        self_collision: bool = False,
        speed: float = 0.1,
        step_duration: float = 1.0,
        duration: float = 58.0,
        observe_ground_force: bool = False,
        engine: EngineName = "bullet",
        width: int = 640,
        height: int = 480,
        window: bool = False,
        render_mode: Literal["rgb_array"] | None = None,
    ) -> None:
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise OptionError("render_mode", render_mode, "None, 'rgb_array'")
        self.render_mode = render_mode
        self.nominal_robot = ojas(actuator_inertia)
        model = dataclasses.replace(ojas(actuator_inertia, arms=arms), feet_collide=self_collision)
        self._sites = [name for name, _, _ in model.sites]
        self._disturbances = self._parse(self.default_disturbances if disturbances is None else disturbances)
        self._settle_damping = BARE_DAMPING if actuator_inertia == "none" else SETTLE_DAMPING
        self._substeps = steps_per_period(control_period, TIME_STEP)
        self.control_period = self._substeps * TIME_STEP
        self._engine: Engine = make_engine(engine, model, TIME_STEP, renders=render_mode is not None, window=window)
        camera = Camera((0.0, 0.0, CAMERA_HEIGHT), width=width, height=height)
        self.view = View(self._engine, camera, self.control_period, share=1.0, slack=LEEWAY)
        self.metadata = {**self.metadata, **self.view.metadata}
        self.pattern = walking_pattern(speed, step_duration, duration, TIME_STEP)
        self._plan = _plan(self.pattern, self._substeps)
        self._last = len(self._plan) - 1
        self.observe_ground_force = observe_ground_force
        self.observation_layout = Layout((*OBSERVATION.fields, GROUND_FORCE)) if observe_ground_force else OBSERVATION
        self.observation_space = self.observation_layout.box()
        self.action_space = ACTION.box()
        self._low, self._high = self.action_space.low, self.action_space.high
        hip_height = robot.ANKLE_HEIGHT + hip_height_above_ankle(speed)
        start, rest = self.pattern.q[0], np.zeros(N_JOINTS)
        self._stand = Supported(self.nominal_robot).torque(0.5, start, rest, rest)
        self._engine.set_friction(FRICTION)
        self._engine.place((float(self.pattern.base[0, 0]), 0.0, hip_height), start)
        self._still = self._settle(start)
        self._settled = self._engine.snapshot()
        self._k = self._last  # no step before the first reset
        self._state, self._schedule, self._realised = self._engine.read(), Schedule({}, TIME_STEP), {}

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Array, dict[str, Any]]:
        """Start a walk; `options` are those of the class' documentation.

        Raises:
            OptionError: for an unknown option, or a scenario that needs another environment.
            DisturbanceError: for a malformed disturbance.
        """
        super().reset(seed=seed)
        disturbances = disturbances_in(options or {}, self)
        if disturbances is not None:
            self._disturbances = self._parse(disturbances)
        realised = self._disturbances.draw(self.np_random)
        self._k = 0
        self._realised = realised
        self._tau = self._begin(realised)
        self.view.reset()
        info: dict[str, Any] = {"time_s": 0.0, "disturbances": realised}
        return self._measure(info), info

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Apply joint torques for one control period.

        Raises:
            ActionError: for a wrong shape or a value that is not finite.
            gymnasium.error.ResetNeeded: after the end of the walk, or before the first reset.
        """
        if self._k >= self._last:
            raise gym.error.ResetNeeded("the walk is over or has not begun: call reset()")
        action = np.asarray(action, dtype=np.float64)
        if action.shape != (N_JOINTS,):
            raise ActionError("shape of the action", action.shape, f"({N_JOINTS},)")
        if not math.isfinite(action.dot(action)):
            raise ActionError("action", action.tolist(), "finite torques (Nm)")
        previous = self._tau
        events = self._simulate(np.minimum(np.maximum(action, self._low), self._high))
        self._k += 1
        info: dict[str, Any] = {"time_s": self._k * self.control_period}
        observation = self._measure(info)
        terms = info["reward_terms"] = self._reward_terms(previous)
        reward = self.control_period * sum(map(operator.mul, REWARD_SCALES.values(), terms.values()))
        if events:
            info["events"] = events
        fall = self._fall()
        if fall:
            info["fall_reason"] = fall
        return observation, reward, fall is not None, self._k >= self._last, info

    def render(self) -> NDArray[np.uint8] | None:
        """A picture from a camera that walks along; None without a render mode."""
        if self.render_mode is None:
            return None
        step = self._elapsed
        home = (float(self.pattern.base[step, 0]), 0.0, CAMERA_HEIGHT)
        pushes = self._schedule.acting(step)
        over = self._k >= self._last or self._fall() is not None
        return self.view.picture(step * TIME_STEP, home, pushes, self._realised, over=over)

    def close(self) -> None:
        self._engine.close()

    @property
    def _elapsed(self) -> int:
        return self._k * self._substeps

    def _parse(self, disturbances: Mapping[str, Any]) -> Disturbances:
        return Disturbances.parse(disturbances, self._sites, self.nominal_robot.actuated, self.robot_name)

    def _begin(self, realised: Mapping[str, Any]) -> Array:
        """Set an episode up and let the robot come to rest in it; returns the joint torques in the end."""
        engine, joints = self._engine, self.nominal_robot.actuated
        engine.restore(self._settled)
        engine.set_friction(realised.get("friction", {}).get("coefficient", FRICTION))
        engine.set_gravity(_gravity(**realised.get("slope", {})))
        engine.scale_masses(realised.get("mass_error", {}).get("factor", 1.0))
        self._schedule = Schedule(realised, TIME_STEP)
        self._schedule.start(engine)
        self._pulse = GrfPulse(realised["grf_pulse"], TIME_STEP) if "grf_pulse" in realised else None
        pose = self.pattern.q[0].copy()
        for entry in realised.get("initial_pose", ()):
            pose[joints.index(entry["joint"])] += entry["offset"]
        at_rest = realised.keys().isdisjoint(("payload", "friction", "slope", "mass_error", "initial_pose"))
        rocks = not realised.keys().isdisjoint(("slope", "initial_pose"))
        tau = self._still if at_rest else self._settle(pose, SETTLE_POSE if rocks else SETTLE)
        self._actuation = self._sensing = None
        if not realised.keys().isdisjoint(Actuation.KINDS):
            self._actuation = Actuation(realised, joints, TIME_STEP)
            self._actuation.start(tau)
        if not realised.keys().isdisjoint(Sensing.KINDS):
            self._sensing = Sensing(realised, OBSERVATION, self.control_period, self.np_random)
        return tau

    def _settle(self, pose: Array, duration: float = SETTLE) -> Array:
        """Stand still under springs on the joints; returns the torques in the end.

        Springs share the load of the two legs evenly. A rigid hold would not: the legs and the ground are a closed
        chain, in which any start error turns into antagonistic torques of several Nm.
        """
        tau = self._stand
        for _ in range(round(duration / TIME_STEP)):
            state = self._engine.read()
            tau = self._stand + SETTLE_STIFFNESS * (pose - state.q) - self._settle_damping * state.qd
            self._engine.step(tau)
        return np.clip(tau, -robot.TORQUE_LIMIT, robot.TORQUE_LIMIT)

    def _simulate(self, command: Array) -> list[str]:
        """Let `command` act for one control period, with what disturbs it; returns what began or ended meanwhile."""
        engine, first = self._engine, self._k * self._substeps
        events: list[str] = []
        actuation, applied = self._actuation, command
        target = command if actuation is None else actuation.target(command)
        total = 0.0
        for step in range(first, first + self._substeps):
            events += self._schedule.apply(step, engine)
            if self._pulse is not None:
                for site, force in zip(FOOT_SITES, self._pulse.forces(engine.foot_loads()), strict=True):
                    if force:
                        engine.push(site, (0.0, 0.0, force))
            if actuation is not None:
                applied = actuation.advance(target, step)
                total = total + applied
            engine.step(applied)
        # the mean torque of the period belongs to its mean acceleration
        self._tau = command if actuation is None else np.asarray(total / self._substeps)
        return events

    def _measure(self, info: dict[str, Any]) -> Array:
        """Read the engine; returns the observation and puts into `info` what policies are not meant to see."""
        state = self._state = self._engine.read()
        loads = info["foot_loads"] = self._engine.foot_loads()
        self._tilt = _roll_pitch(state)
        contact = [load > LOADED for load in loads]
        plan = self._plan[self._k]
        base = (state.position[2], *self._tilt, *state.velocity, *state.angular_velocity, *contact)
        parts = [state.q, state.qd, plan[:-2], self._tau, base, plan[-2:]]
        if self.observe_ground_force:
            parts.append(self._engine.ground_forces().ravel())
        observation = np.concatenate(parts)
        return observation if self._sensing is None else self._sensing.disturb(observation)

    def _reward_terms(self, previous: Array) -> dict[str, float]:
        error = self._plan[self._k, :N_JOINTS] - self._state.q
        change = self._tau - previous
        roll, pitch = self._tilt
        return {  # in the order of REWARD_SCALES
            "alive": 1.0,
            "tracking": math.exp(-error.dot(error) / 0.02),
            "upright": math.exp(-(roll * roll + pitch * pitch) / 0.05),
            "effort": float(self._tau.dot(self._tau)) * _EFFORT_SCALE,
            "smoothness": float(change.dot(change)) * _EFFORT_SCALE,
        }

    def _fall(self) -> str | None:
        x, y = self._state.quat_xyzw[:2]
        up = 1.0 - 2.0 * (x * x + y * y)  # the world's z component of the base's z axis
        if not up >= _COS_FALL:  # comparisons the way round that a state which is no number any more counts as fallen
            return "tilt"
        if self._state.position[2] < FALL_HEIGHT:
            return "height"
        speeds = self._state.qd
        if not speeds.dot(speeds) <= MAX_SPEED * MAX_SPEED:
            return "speed"
        return None


_COS_FALL = math.cos(math.radians(FALL_TILT_DEG))
_EFFORT_SCALE = 1.0 / (N_JOINTS * robot.TORQUE_LIMIT**2)


def _gravity(pitch_deg: float = 0.0, roll_deg: float = 0.0) -> tuple[float, float, float]:
    """Free fall in the axes of a ground that rises by `pitch_deg` ahead and by `roll_deg` to the left."""
    ahead, left = math.tan(math.radians(pitch_deg)), math.tan(math.radians(roll_deg))
    size = GRAVITY / math.sqrt(1.0 + ahead * ahead + left * left)
    return (-size * ahead, -size * left, -size)


def _plan(pattern: WalkingPattern, substeps: int) -> Array:
    """What the observation takes from the pattern, one row a control period."""
    columns = (pattern.q, pattern.qd, pattern.qdd, pattern.load_left[:, None], pattern.phase[:, None])
    return np.concatenate([column[::substeps] for column in columns], axis=1)


def _roll_pitch(state: State) -> tuple[float, float]:
    x, y, z, w = state.quat_xyzw
    roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = math.asin(max(-1.0, min(1.0, 2 * (w * y - z * x))))
    return roll, pitch


def document(default: str) -> Callable[[type[BipedEnv]], type[BipedEnv]]:
    """Class decorator: fill the sections that all tasks share into a docstring, at `{shared}`."""
    return filled(shared=TASK_DOCUMENTATION.format(observation=OBSERVATION.table(), default=default))
