"""The arm swings along a given motion; a payload comes and goes at its tip, and pushes act there."""

import math

import numpy as np
from PIL import Image, ImageDraw

from artde_gym.disturbances.schedule import Schedule
from artde_gym.envs.single import BaseEnv
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


class TwoLinkArmEnv(BaseEnv):
    """The environment at the top; `lost` means that the arm is off its reference by more than 1 rad."""

    robot_name = "two-link-arm"
    observation_layout, action_layout, nominal_robot = OBSERVATION, ACTION, Arm()
    words = {"site": ("tip",), "joint": JOINTS}
    time_step, allowed_action = TIME_STEP, "torques in Nm"
    reward_scales, fall_reasons = {"tracking": 1.0}, ("lost",)
    default_disturbances = {"payload": 0.5}
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
        self.duration, self.width, self.height = duration, width, height
        substeps, last = round(control_period / TIME_STEP), round(duration / control_period)
        period = {"control_period": control_period, "substeps": substeps, "last": last}
        super().__init__(disturbances, **period, render_mode=render_mode)

    def _begin(self, sampled):
        """Start an episode at rest, where the reference begins."""
        self._q, self._qd, self._tau = np.zeros(2), np.zeros(2), np.zeros(2)
        self._arm, self._force = Arm(), np.zeros(2)
        self.schedule = Schedule(sampled, TIME_STEP)
        self.schedule.start(self)

    def _simulate(self, command):
        """Let torques act for one control period, and return what happens in it."""
        self._tau = command
        steps = range(self.elapsed, self.elapsed + self._substeps)
        return [event for step in steps for event in self._advance(step)]

    def _measure(self):
        return np.concatenate([self._q, self._qd, *reference(self._time), self._tau])

    def _reward_terms(self):
        error = reference(self._time)[0] - self._q
        return {"tracking": math.exp(-float(error @ error) / 0.01)}

    def _falls(self):
        return [float(np.abs(reference(self._time)[0] - self._q).max()) > 1.0]

    def _draw(self):
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

    @property
    def _time(self):
        return self.elapsed * TIME_STEP

    def attach_payload(self, mass, position):
        """Put a payload on the tip, wherever else it is meant to be; called by the schedule, as is the rest."""
        self._arm = Arm(mass)

    def release_payload(self):
        self._arm = Arm()

    def apply_force(self, site, force):
        """Push the tip with a force (N), of which the plane of the arm takes x and z."""
        self._force = np.add(self._force, (force[0], force[2]))

    def _advance(self, step):
        """Integrate one time step, and return what happens in it."""
        self._force = np.zeros(2)
        events = self.schedule.apply(step, self)
        points = self._arm.points(self._q)
        levers = points[2] - points[:2]
        pushed = levers[:, 0] * self._force[1] - levers[:, 1] * self._force[0]
        torque = self._tau + pushed - self._arm.bias(self._q, self._qd)
        self._qd = self._qd + TIME_STEP * np.linalg.solve(self._arm.joint_inertia(self._q), torque)
        self._q = self._q + TIME_STEP * self._qd
        return events
