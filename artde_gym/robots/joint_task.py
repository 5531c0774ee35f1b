"""Tasks whose actions are joint torques: what the robots of `artde_gym.sim` with joints share."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any, Self

from artde_gym.arrays import Array
from artde_gym.disturbances import Disturbances
from artde_gym.disturbances.numeric import Words
from artde_gym.multibody.spec import RobotSpec

TIME_STEP = 0.001  # s, of the physics


@dataclasses.dataclass(frozen=True)
class JointTask:
    """Everything that is the same in all episodes of an environment.

    Attributes:
        nominal_robot: the robot, known to controllers.
        robot: simulated model.
        substeps: physics steps per control period.
        plan: references in the observation, one row per control period: (samples, size), joint positions first.
        arguments: arguments of `of`.
    """

    nominal_robot: RobotSpec
    robot: RobotSpec
    substeps: int
    plan: Array
    arguments: tuple[Any, ...]

    @classmethod
    def of(cls, *args: Any, **kwargs: Any) -> Self:
        """Build it from the arguments of an environment."""
        raise NotImplementedError

    def __deepcopy__(self, _: dict[int, Any]) -> Self:
        return self  # immutable

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self).of, self.arguments  # a thousandth of the data

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.nominal_robot.actuated)

    @property
    def start(self) -> Array:
        """Joint positions (n,) at the start."""
        return self.plan[0, : self.n]

    @property
    def control_period(self) -> float:
        return self.substeps * TIME_STEP

    @property
    def last(self) -> int:
        """Index of the last control period."""
        return len(self.plan) - 1

    @property
    def words(self) -> Words:
        """Names of sites and joints."""
        return {"site": tuple(name for name, _, _ in self.robot.sites), "joint": self.nominal_robot.actuated}

    def parse(self, disturbances: Mapping[str, Any]) -> Disturbances:
        """Parse disturbances of this robot."""
        return Disturbances.parse(disturbances, self.words["site"], self.words["joint"], self.nominal_robot.name)

    def placed(self, sampled: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return sampled disturbances with the payload's position in the frame of the link that carries it."""
        return sampled

    def pose(self, sampled: Mapping[str, Any]) -> Array:
        """Return joint positions (n,) in which an episode starts."""
        pose = self.start.copy()
        for entry in sampled.get("initial_pose", ()):
            pose[self.nominal_robot.actuated.index(entry["joint"])] += entry["offset"]
        return pose
