"""Video of one episode, of one controller or of several on the same seed."""

from __future__ import annotations

import itertools
import math
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artde_gym.arguments import check_integer, check_number
from artde_gym.errors import OptionError
from artde_gym.evaluation.cells import Cell, validate_cell
from artde_gym.evaluation.environments import arguments_of
from artde_gym.evaluation.plan import Plan
from artde_gym.evaluation.rollout import Policy
from artde_gym.evaluation.seeds import episode_seed
from artde_gym.scenarios import SCENARIOS
from artde_gym.video import writer
from artde_gym.video.frames import Frame, render_frames
from artde_gym.video.tiles import tile_frames

SPEED_RANGE = (0.001, 1000.0)
"""Lowest and highest speed, as shown over simulated time."""
MAX_FRAMES = 20_000  # frames: eleven minutes at thirty per second
TIME_TOLERANCE_S = 1e-9  # by which a sample may precede its time
END_HOLD_S = 1.0  # for which the last frame is shown after all have ended


def video(
    controllers: Sequence[str | Policy] | Mapping[str, str | Policy],
    out: str | Path,
    env_id: str | None = None,
    *,
    scenario: str | None = None,
    seed: int = 0,
    episode: int = 0,
    start: float = 0.0,
    end: float = math.inf,
    speed: float = 1.0,
    fps: float = 30.0,
    width: int = 640,
    columns: int | None = None,
    disturbances: Mapping[str, Any] | None = None,
    env_kwargs: Mapping[str, Any] | None = None,
    gains: Mapping[str, Mapping[str, Any]] | None = None,
    on_progress: Callable[[float], None] | None = None,
) -> Path:
    """Record an episode as `evaluate` runs it with the same arguments; several controllers side by side.

    A robot that falls stays in the frame as it fell, with the time.

    Args:
        controllers, env_id, scenario, disturbances, env_kwargs, gains: as for `evaluate`.
        out: .mp4 or .webm (which need ffmpeg), .gif, .webp, or .png for a single frame at `start`.
        seed, episode: base seed and number of an evaluation's episode.
        start, end: part to show (s); the simulation always begins at 0.
        speed: 0.5 is half speed.
        fps: frames per second; 50 at most in a GIF and 90 in a WebP, since browsers slow down faster ones.
        width: of one controller's tile (pixels), whose height is three quarters of it.
        columns: tiles per row; None for all in one row.
        on_progress: called with the simulated time (s) of each frame.

    Returns:
        The video's file.

    Raises:
        UnknownNameError, OptionError, DisturbanceError, GainError: for an invalid argument, also if an engine cannot
            render or ffmpeg is missing.
    """
    out = Path(out)
    speed = check_number("speed", speed, *SPEED_RANGE, "a number from {:g} to {:g}".format(*SPEED_RANGE))
    start = check_number("start", start, 0.0, sys.float_info.max, "a finite number >= 0 (s)")
    end = check_number("end", end, math.nextafter(start, math.inf), math.inf, f"a number > the start, {start:g} (s)")
    columns = None if columns is None else check_integer("columns", columns, 1)
    own_seed = episode_seed(check_integer("seed", seed, 0), check_integer("episode", episode, 0))
    writer.check(out)
    plan = Plan.of(
        controllers, env_id, scenario=scenario, seed=seed, disturbances=disturbances, env_kwargs=env_kwargs, gains=gains
    )
    (cell,) = plan.cells
    fps = writer.frame_rate(out, fps)
    _check_part(out, cell, start, end, speed / fps)
    videos = {
        name: render_frames(
            cell.env_id,
            cell.kwargs,
            policy,
            plan.gains.get(name, {}),
            own_seed,
            _times(start, end, speed / fps),
            width,
        )
        for name, policy in plan.controllers.items()
    }
    entry = SCENARIOS.get(cell.name)
    title = f"{entry.name}: {entry.text}" if entry else cell.env_id
    title += f"; seed {seed}, episode {episode}" + ("" if speed == 1 else f"; {speed:g} x speed")

    def pictures() -> Iterator[NDArray[np.uint8]]:
        for shown in _together(videos, held=math.ceil(END_HOLD_S * fps)):
            reached = max(frame.time_s for frame in shown.values())
            if reached < start - TIME_TOLERANCE_S:  # all episodes have ended
                raise OptionError("start", start, f"up to the end of the episode, {reached:g} s")
            if on_progress is not None:
                on_progress(reached)
            yield tile_frames(shown, title, min(columns or len(shown), len(shown)))

    writer.write(out, pictures(), fps)
    return out


def _check_part(out: Path, cell: Cell, start: float, end: float, step: float) -> None:
    """Check that the part to show begins within the episode, and that it has not too many frames."""
    validate_cell(False, cell)
    duration = cell.kwargs.get("duration", arguments_of(cell.env_id)["duration"].default)
    if start > duration:
        raise OptionError("start", start, f"up to the end of the episode, {duration:g} s")
    count = math.ceil((min(end, duration) - start) / step)
    if out.suffix != ".png" and count > MAX_FRAMES:
        todo = "shorten the part, raise the speed or lower the fps"
        raise OptionError("number of pictures", count, todo, f"is above {MAX_FRAMES}")


def _times(start: float, end: float, step: float) -> Iterator[float]:
    return itertools.takewhile(lambda time: time < end, (start + step * i for i in itertools.count()))


def _together(videos: Mapping[str, Iterator[Frame]], held: int) -> Iterator[dict[str, Frame]]:
    """Yield all videos' frames at each instant, the last one after an episode's end; `held` more at the end."""
    shown: dict[str, Frame] = {}
    while True:
        fresh = {name: frame for name, video in videos.items() if (frame := next(video, None)) is not None}
        if not fresh:
            break
        shown = {name: fresh.get(name) or shown[name] for name in videos}
        yield shown
    if any(frame.over for frame in shown.values()):
        yield from itertools.repeat(shown, held)
