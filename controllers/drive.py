"""All that `controllers` knows of a robot, in one frozen object that a plug-in can bring."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias

from artde_gym.doctor.check_result import CheckResult
from artde_gym.registry import Registry
from controllers.loop import Loop, SupportPhase
from controllers.policies import Policy
from controllers.workspace_design import WorkspaceDesign


@dataclasses.dataclass(frozen=True)
class Preset:
    """Gains (a frozen dataclass of `controllers.laws`) and where they come from."""

    gains: Any
    source: str


Ranges: TypeAlias = dict[str, tuple[float, float]]
"""Gain, named as an override names it -> lowest and highest value for tuning."""


@dataclasses.dataclass(frozen=True)
class Drive:
    """Presets, tuning ranges and policies of one robot.

    Attributes:
        robot: by the environments' `robot_name`.
        presets: (law, preset) -> gains; a law's first preset is its default.
        ranges: law -> ranges in which tuning searches its gains.
        make: builds its policies, called as make(env, law=..., **options); None for one law on all joints, see
            `controllers.joint_space.make_joint_space`.
        feedback: returns k_p and k_d as designed for an environment; None for the preset's.
        period: sampling period of its environments where nothing else is asked for (s).
        loops: for `artde-gym design`: lists its parts, each with its inertia along the reference, which the keyword
            arguments describe; None if the robot has no such model.
        supports: for `artde-gym design` of laws that switch: lists the phases of support of a stride, which the keyword
            arguments describe; None for a robot that does not walk.
        workspace: for `artde-gym design` of an environment: called with its nominal robot, the control period (s),
            gains in place of the designed ones, and the bits of its encoders or None, returns a
            `controllers.workspace_design.WorkspaceDesign`; None for a robot without a workspace.
        stability: for `artde-gym doctor`: tells whether time-delay estimation converges at the presets; None to judge
            all presets of all loops.
    """

    robot: str
    presets: Mapping[tuple[str, str], Preset]
    ranges: Mapping[str, Ranges] = dataclasses.field(default_factory=dict[str, Ranges])
    make: Callable[..., Policy] | None = None
    period: float = 0.001
    feedback: Callable[[Any], dict[str, Any]] | None = None
    loops: Callable[..., list[Loop]] | None = None
    supports: Callable[..., list[SupportPhase]] | None = None
    workspace: Callable[[Any, float, Mapping[str, Any], float | None], WorkspaceDesign] | None = None
    stability: Callable[[], Sequence[CheckResult]] | None = None


DRIVES: Registry[Drive] = Registry("drive", "artde_gym.drives", lambda drive: {drive.robot: drive})
"""All drives by robot."""
