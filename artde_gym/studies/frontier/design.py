"""The design of a frontier: the test common to all levels, and the number varied in it."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

from artde_gym.errors import DisturbanceError, OptionError, suggest_names
from artde_gym.evaluation.cells import Cell
from artde_gym.evaluation.environments import arguments_of
from artde_gym.evaluation.plan import Plan
from artde_gym.studies.frontier.axis import GAINS, Axis
from artde_gym.studies.frontier.standard import standard_test


@dataclasses.dataclass(frozen=True)
class Design:
    """A test in which one number is varied.

    Attributes:
        axis: the varied number.
        survival: share of episodes without a fall at which a level counts as survived.
        disturbances: of the test.
        arguments: of its environment.
    """

    axis: Axis
    survival: float
    disturbances: Mapping[str, Any]
    arguments: Mapping[str, Any]

    @classmethod
    def of(cls, plan: Plan, axis: Axis, survival: float, scenario: str | None = None) -> Design:
        """Make a design from a plan with one cell; without disturbances of its own, it is the robot's standard test.

        Raises:
            UnknownNameError, OptionError, DisturbanceError, GainError: if the test, or an end of the axis, is not
                allowed.
        """
        if not (isinstance(survival, (int, float)) and 0 < survival <= 1):
            raise OptionError("survival", survival, "above 0 up to 1")
        (cell,) = plan.cells
        arguments = dict(cell.kwargs)
        disturbances = arguments.pop("disturbances", None)
        _check_arguments(cell.env_id, plan.vectorized, axis, arguments)
        for name, gains in plan.gains.items():
            if axis.kind == GAINS and axis.name in gains:
                raise OptionError(f"gain of {name!r}", axis.name, "leave it out", "is varied")
        is_standard = disturbances is None
        if disturbances is None:
            disturbances, arguments = standard_test(cell.env_id, axis.path, arguments, scenario)
        elif scenario is not None:
            raise OptionError(
                "disturbances", disturbances, "leave out one of them", f"come with scenario {scenario!r}, too"
            )
        design = cls(axis, survival, disturbances, arguments)
        for end in (axis.levels[0], axis.levels[-1]):
            gains = design.gains_at(end, plan)
            try:
                dataclasses.replace(plan, cells=(design.at(end, cell),), gains=gains).try_out()
            except DisturbanceError as error:
                if not is_standard:
                    raise
                remedy = "pass `disturbances`, or a scenario that has the whole of it"
                raise OptionError("vary", axis.path, remedy, f"makes no standard test ({error})") from error
        return design

    def gains_at(self, value: float, plan: Plan) -> Mapping[str, dict[str, Any]]:
        """Return the gains of a plan's controllers at one level."""
        if self.axis.kind != GAINS:
            return plan.gains
        return {name: {**plan.gains.get(name, {}), self.axis.name: value} for name in plan.controllers}

    def at(self, value: float, cell: Cell) -> Cell:
        """Return a cell with this test at one level."""
        disturbances, arguments = self.axis.place(value, self.disturbances, self.arguments)
        return cell._replace(kwargs={**arguments, "disturbances": disturbances})


def _check_arguments(env_id: str, vectorized: bool, axis: Axis, given: Mapping[str, Any]) -> None:
    known = arguments_of(env_id, vectorized)
    for name in given:
        if name not in known:
            raise OptionError(f"argument of {env_id}", name, suggest_names(name, known))
        if axis.kind is None and name == axis.name:
            raise OptionError("argument in env_kwargs", name, "leave it out", "is varied")
