"""A video of one episode, of one controller or of several on the same seed."""

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

SPEEDS = (0.001, 1000.0)
"""Slowest and fastest, shown over simulated time."""
MOST = 20_000  # pictures: eleven minutes at thirty a second
EARLY = 1e-9  # s, that a sample may lie before its time
HELD = 1.0  # s, for which the last picture is shown after everybody has ended


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
    """Show an episode as `evaluate` runs it with the same arguments, side by side for several controllers.

    Who falls stays in the picture as it fell, with the time.

    Args:
        controllers, env_id, scenario, disturbances, env_kwargs, gains: as of `evaluate`.
        out: .mp4 or .webm (which need ffmpeg), .gif, .webp, or .png for one picture, that at `start`.
        seed, episode: which one of an evaluation's episodes.
        start, end: part that is shown (s); the simulation begins at 0 nevertheless.
        speed: 0.5 shows it half as fast.
        fps: pictures a second of the video; 50 at most in a GIF and 90 in a WebP, as browsers slow down faster ones.
        width: of one controller's panel (pixels), whose height is three quarters of it.
        columns: tiles in a row; None for all of them.
        on_progress: called with the simulated time (s) of each picture.

    Returns:
        The file.

    Raises:
        UnknownNameError, OptionError, DisturbanceError, GainError: for a bad argument, also where an engine cannot draw
            or ffmpeg is missing.
    """
    out = Path(out)
    speed = check_number("speed", speed, *SPEEDS, "a number from {:g} to {:g}".format(*SPEEDS))
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
        for shown in _together(videos, held=math.ceil(HELD * fps)):
            reached = max(frame.time_s for frame in shown.values())
            if reached < start - EARLY:  # nobody is there any more
                raise OptionError("start", start, f"up to the end of the episode, {reached:g} s")
            if on_progress is not None:
                on_progress(reached)
            yield tile_frames(shown, title, min(columns or len(shown), len(shown)))

    writer.write(out, pictures(), fps)
    return out


def _check_part(out: Path, cell: Cell, start: float, end: float, step: float) -> None:
    """See that the part to be shown begins within the episode, and that its pictures are not too many."""
    validate_cell(False, cell)
    duration = cell.kwargs.get("duration", arguments_of(cell.env_id)["duration"].default)
    if start > duration:
        raise OptionError("start", start, f"up to the end of the episode, {duration:g} s")
    count = math.ceil((min(end, duration) - start) / step)
    if out.suffix != ".png" and count > MOST:
        raise OptionError("number of pictures", count, f"at most {MOST}: a shorter part, less slow, or fewer a second")


def _times(start: float, end: float, step: float) -> Iterator[float]:
    return itertools.takewhile(lambda time: time < end, (start + step * i for i in itertools.count()))


def _together(videos: Mapping[str, Iterator[Frame]], held: int) -> Iterator[dict[str, Frame]]:
    """Instant by instant what each video shows, its last picture after its end; `held` more in the very end."""
    shown: dict[str, Frame] = {}
    while True:
        fresh = {name: frame for name, video in videos.items() if (frame := next(video, None)) is not None}
        if not fresh:
            break
        shown = {name: fresh.get(name) or shown[name] for name in videos}
        yield shown
    if any(frame.over for frame in shown.values()):
        yield from itertools.repeat(shown, held)
