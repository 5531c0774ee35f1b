"""The arm swings along a given motion; a payload comes and goes at its tip, and pushes act there."""

import math

import gymnasium as gym
import numpy as np
from PIL import Image, ImageDraw

from artde_gym.arguments import action_array
from artde_gym.disturbances import Disturbances
from artde_gym.disturbances.numeric import numeric
from artde_gym.disturbances.schedule import Push, Schedule
from artde_gym.info import EpisodeInfo
from artde_gym.layout import Field, Layout
from artde_gym.metrics_spec import EffortSignal, MetricsSpec, TrackedSignal
from artde_gym.motion.motion import Pose
from two_link_arm.model import LENGTH, TORQUE, Arm
from two_link_arm.scene import HEIGHT

JOINTS = ("shoulder", "elbow")
OBSERVATION = Layout(
    (
        Field("q", 2, "rad", -20.0, 20.0, "joint angles"),
        Field("qd", 2, "rad/s", -100.0, 100.0, "joint rates"),
        Field("q_ref", 2, "rad", -4.0, 4.0, "reference"),
        Field("qd_ref", 2, "rad/s", -20.0, 20.0, "its rate"),
        Field("qdd_ref", 2, "rad/s^2", -100.0, 100.0, "its acceleration"),
        Field("tau_applied", 2, "Nm", -TORQUE, TORQUE, "torques of the last control period"),
    )
)
ACTION = Layout((Field("tau", 2, "Nm", -TORQUE, TORQUE, "torques of the motors"),))
_AXES: dict[str, int] = dict(zip(JOINTS, (0, 1), strict=True))
TIME_STEP = 0.001  # s


def reference(time):
    """Return angles, rates and accelerations (..., 2) of a swing of 2 s, from rest."""
    phase, size = math.pi * np.asarray(time)[..., None], np.array([0.6, 0.9])
    rates = math.pi * size * np.sin(phase), math.pi**2 * size * np.cos(phase)
    return size * (1 - np.cos(phase)), *rates


class TwoLinkArmEnv(gym.Env):
    """The environment at the top; `fell` means that the arm is off its reference by more than 1 rad."""

    metadata = {"render_modes": ["rgb_array"], "render_fps": 50}
    robot_name = "two-link-arm"
    observation_layout, action_layout, nominal_robot = OBSERVATION, ACTION, Arm()
    words = {"site": ("tip",), "joint": JOINTS}
    metrics_spec = MetricsSpec(
        errors=(TrackedSignal("deg", 180.0 / math.pi, _AXES, lambda fields: fields["q_ref"] - fields["q"]),),
        norm=False,
        settling_band=0.01,
        efforts=(EffortSignal("torque", "nm", "tau_applied", slice(2), _AXES),),
        power=lambda fields: np.abs(fields["tau_applied"] * fields["qd"]).sum(axis=-1),
        saturated_field="tau_applied",
        saturation_margin=0.0,
        tde_errors={"tde_error_rms": "sigma"},
        diagnostic_means={"robust_gain_mean": "c"},
    )

    def __init__(self, duration=4.0, control_period=0.002, disturbances=None, render_mode=None, width=640, height=480):
        self.duration, self.control_period, self.render_mode = duration, control_period, render_mode
        self.width, self.height = width, height
        self.observation_space, self.action_space = OBSERVATION.box(), ACTION.box()
        self._substeps = round(control_period / TIME_STEP)
        self._disturbances = self._parsed({"payload": 0.5} if disturbances is None else disturbances)

    def reset(self, *, seed=None, options=None):
        """Start an episode at rest, where the reference begins; options may hold `disturbances`."""
        super().reset(seed=seed)
        given = (options or {}).get("disturbances")
        disturbances = self._disturbances if given is None else self._parsed(given)
        self.sampled_disturbances = disturbances.sample(self.np_random)
        self._step, self._q, self._qd, self._tau = 0, np.zeros(2), np.zeros(2), np.zeros(2)
        self._arm, self._force = Arm(), np.zeros(2)
        self._schedule = Schedule(self.sampled_disturbances, TIME_STEP)
        self._schedule.start(self)
        self._info = EpisodeInfo(numeric(self.sampled_disturbances, self.words), ("lost",))
        return self._observation(), self._info.told(0.0, {"tracking": 0.0})

    def step(self, action):
        """Let torques act for one control period."""
        self._tau = np.clip(action_array(action, 2, "torques in Nm"), -TORQUE, TORQUE)
        events = [event for _ in range(self._substeps) for event in self._advance()]
        error = reference(self._time)[0] - self._q
        lost = float(np.abs(error).max()) > 1.0
        terms = {"tracking": self.control_period * math.exp(-float(error @ error) / 0.01)}
        info = self._info.told(self._time, terms, events, [lost])
        return self._observation(), terms["tracking"], lost, not lost and self._time >= self.duration - 1e-9, info

    def render(self):
        """Draw the arm (height, width, 3), its reference in gray."""
        picture = Image.new("RGB", (self.width, self.height), "white")
        for angles, color in ((reference(self._time)[0], "lightgray"), (self._q, "steelblue")):
            points = self.nominal_robot.points(angles) * (1, -1) * self.height / (4.4 * LENGTH)
            pixels = [tuple(point) for point in np.add(points, (self.width / 2, self.height / 2)).tolist()]
            ImageDraw.Draw(picture).line(pixels, color, self.height // 40, "curve")
        return np.asarray(picture)

    def pose(self):
        """Return where the arm and its payload are, for replays."""
        x, z = self.nominal_robot.points(self._q)[2]
        payload = (x, 0.0, HEIGHT + z) if self._arm.payload else None
        return Pose((0.0, 0.0, HEIGHT), (0.0, 0.0, 0.0, 1.0), self._q, payload)

    def push(self, site, force, duration):
        """Push the tip now, for live play, as the two methods below."""
        self._schedule.add(Push(site, force, self._step, self._step + round(duration / TIME_STEP)))

    def add_payload(self, payload):
        """Attach a payload now; return False if the episode had one."""
        given = self._parsed({"payload": {**payload, "attach_time": self._time}}).sample(self.np_random)
        added = self._schedule.attach(self._step, given["payload"])
        self.sampled_disturbances |= given if added else {}
        return added

    def drop_payload(self):
        """Drop the payload now; return False if there is none."""
        dropped = self._schedule.drop(self._step)
        if dropped:
            self.sampled_disturbances["payload"]["detach_time"] = self._time
        return dropped

    def _parsed(self, disturbances):
        return Disturbances.parse(disturbances, self.words["site"], JOINTS, self.robot_name)

    @property
    def _time(self):
        return self._step * TIME_STEP

    def attach_payload(self, mass, position):
        """Put a payload on the tip, wherever else it is meant to be; called by the schedule, as is the rest."""
        self._arm = Arm(mass)

    def release_payload(self):
        self._arm = Arm()

    def apply_force(self, site, force):
        """Push the tip with a force (N), of which the plane of the arm takes x and z."""
        self._force = np.add(self._force, (force[0], force[2]))

    def _advance(self):
        """Integrate one time step, and return what happens in it."""
        self._force = np.zeros(2)
        events = self._schedule.apply(self._step, self)
        points = self._arm.points(self._q)
        levers = points[2] - points[:2]
        pushed = levers[:, 0] * self._force[1] - levers[:, 1] * self._force[0]
        torque = self._tau + pushed - self._arm.bias(self._q, self._qd)
        self._qd = self._qd + TIME_STEP * np.linalg.solve(self._arm.joint_inertia(self._q), torque)
        self._q = self._q + TIME_STEP * self._qd
        self._step += 1
        return events

    def _observation(self):
        return np.concatenate([self._q, self._qd, *reference(self._time), self._tau])
