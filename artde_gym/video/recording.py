"""A video of one episode, of one controller or of several on the same seed."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artde_gym.errors import OptionError
from artde_gym.evaluation.evaluate import cells_of, checked_gains, named_controllers
from artde_gym.evaluation.rollout import Policy
from artde_gym.evaluation.seeds import episode_seed
from artde_gym.scenarios import SCENARIOS
from artde_gym.video import writer
from artde_gym.video.frames import Shot, shots
from artde_gym.video.tiles import panels

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
        fps: pictures a second of the video.
        width: of one controller's panel (pixels), whose height is three quarters of it.
        columns: panels in a row; None for all of them.
        on_progress: called with the simulated time (s) of each picture.

    Returns:
        The file.

    Raises:
        UnknownNameError, OptionError, DisturbanceError, GainError: for a bad argument, also where an engine cannot draw
            or ffmpeg is missing.
    """
    out = Path(out)
    for name, value in {"speed": speed, "fps": fps}.items():
        if not 0 < value < math.inf:
            raise OptionError(name, value, "a finite number > 0")
    if not 0 <= start < math.inf:
        raise OptionError("start", start, "a finite number >= 0 (s)")
    if not end > start:
        raise OptionError("end", end, f"a number > the start, {start:g} (s)")
    if not (columns is None or (isinstance(columns, int) and columns >= 1)):
        raise OptionError("columns", columns, "a whole number >= 1")
    writer.check(out)
    named = named_controllers(controllers)
    gains = checked_gains(gains, named)
    (cell,) = cells_of(env_id, scenario, dict(env_kwargs or {}), disturbances)
    fps = writer.frame_rate(out, fps)
    films = {
        name: shots(
            cell.env_id,
            cell.kwargs,
            policy,
            gains.get(name, {}),
            episode_seed(seed, episode),
            _times(start, end, speed / fps),
            width,
        )
        for name, policy in named.items()
    }
    entry = SCENARIOS.get(cell.name)
    title = f"{entry.name}: {entry.text}" if entry else cell.env_id
    title += f"; seed {seed}, episode {episode}" + ("" if speed == 1 else f"; {speed:g} x speed")

    def pictures() -> Iterator[NDArray[np.uint8]]:
        for shown in _together(films, held=math.ceil(HELD * fps)):
            if on_progress is not None:
                on_progress(max(shot.time_s for shot in shown.values()))
            yield panels(shown, title, min(columns or len(shown), len(shown)))

    writer.write(out, pictures(), fps)
    return out


def _times(start: float, end: float, step: float) -> Iterator[float]:
    return itertools.takewhile(lambda time: time < end, (start + step * i for i in itertools.count()))


def _together(films: Mapping[str, Iterator[Shot]], held: int) -> Iterator[dict[str, Shot]]:
    """Instant by instant what each film shows, its last picture after its end; `held` more in the very end."""
    shown: dict[str, Shot] = {}
    while True:
        fresh = {name: shot for name, film in films.items() if (shot := next(film, None)) is not None}
        if not fresh:
            break
        shown = {name: fresh.get(name) or shown[name] for name in films}
        yield shown
    if any(shot.over for shot in shown.values()):
        yield from itertools.repeat(shown, held)
