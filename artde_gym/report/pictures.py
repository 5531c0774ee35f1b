"""Frames and a video of the episode that a report shows, rerun from its seed.

Episodes repeat bit for bit, so that a frame is of the very run whose signals are plotted. An episode that does not
repeat, e.g. on another machine or with another release of an engine, is recognized by its fall and not shown.
"""

from __future__ import annotations

import base64
import dataclasses
import io
import math
import tempfile
from collections.abc import Callable, Iterable, Mapping
from html import escape
from pathlib import Path
from typing import Any, NamedTuple

from PIL import Image

from artde_gym.errors import ArtdeGymError
from artde_gym.evaluation.environments import robot_of
from artde_gym.evaluation.metrics import Span, events_of
from artde_gym.kit import ROBOTS
from artde_gym.registration import registered_controllers
from artde_gym.report.answer import metric_of, ranking
from artde_gym.report.html import figure, paragraph
from artde_gym.report.run import Run, nested
from artde_gym.scenarios import CUSTOM
from artde_gym.video.frames import Frame, render_frames
from artde_gym.video.recording import video

WIDTH = 320  # pixels, of a snapshot
PANEL = 400  # pixels, of a controller in a video
FPS = 20.0  # of a video
QUALITY = 72  # of a snapshot as WebP
BEFORE_FALL = (1.2, 0.8, 0.4, 0.2, 0.0)  # s
BEFORE_EVENT, AFTER_EVENT = 0.1, (0.3, 0.8, 1.5)  # s
MOTION = 6  # snapshots of the undisturbed motion
LENGTH, LEAD = 10.0, 6.0  # s, of a video, and its part before the moment of interest

Progress = Callable[[str], None]


class Snapshot(NamedTuple):
    """One frame of a strip: its time (s), and a description."""

    strip: str
    time_s: float
    text: str


@dataclasses.dataclass(frozen=True)
class SnapshotSet:
    """Snapshots, and optionally videos, of a run.

    Attributes:
        pictures, videos: whether to draw them.
        on_progress: called with the figure being drawn.
    """

    run: Run
    pictures: bool = True
    videos: bool = False
    on_progress: Progress = lambda _: None

    def figures(self, scenario: str) -> list[str]:
        """Return the figures of a scenario; a sentence for those that cannot be drawn here."""
        parts: list[str] = []
        for wanted, draw in ((self.videos, self._video), (self.pictures, self._pictures)):
            if wanted:
                try:
                    parts += draw(scenario)
                except (ArtdeGymError, ValueError) as error:  # no OpenGL, no ffmpeg, a controller that no longer exists
                    parts.append(paragraph(f"Nothing is drawn here: {error}.", "soft"))
        return parts

    def _pictures(self, scenario: str) -> list[str]:
        number = self._number(scenario)
        figures, missed = [], []
        for place, name in enumerate(self._drawable(scenario)):
            row = self._row(scenario, name, number)
            snapshots = _falling(name, row)
            if place == 0:  # the best one
                snapshots = [*self._moving(scenario, name, row), *_events(name, row), *snapshots]
            if not snapshots:
                continue
            self.on_progress(f"pictures of {name} in {scenario}")
            seen = self._seen(scenario, name, row, snapshots)
            if not _repeats(row, seen):
                missed.append(name)
                continue
            strips: dict[str, dict[str, str]] = {}
            for snapshot in snapshots:
                strips.setdefault(snapshot.strip, {})[snapshot.text] = _image(seen[snapshot.time_s], snapshot)
            figures += [
                figure(f"{strip}, episode {number}.", images, kind="snapshots") for strip, images in strips.items()
            ]
        if missed:
            said = (
                "did not repeat the stored episode (another machine, or other versions?), so there is no picture of it"
            )
            figures.append(paragraph(f"{', '.join(missed)} {said}.", "soft"))
        return figures

    def _video(self, scenario: str) -> list[str]:
        number, names = self._number(scenario), self._drawable(scenario)
        if not names:
            return []
        self.on_progress(f"video of {scenario}")
        start = max(0.0, self._moment(scenario, [self._row(scenario, name, number) for name in names]) - LEAD)
        kwargs = dict(self.run.cell(scenario)["kwargs"])
        with tempfile.TemporaryDirectory() as folder:
            file = video(
                names,
                Path(folder) / "video.mp4",
                self.run.cell(scenario)["env_id"],
                scenario=None if scenario == CUSTOM else scenario,
                disturbances=kwargs.pop("disturbances", None),
                env_kwargs=kwargs,
                gains=self.run.gains(scenario),
                seed=self.run.record["configuration"]["seed"],
                episode=number,
                start=start,
                end=start + LENGTH,
                width=PANEL,
                fps=FPS,
                columns=min(3, len(names)),
            )
            data = base64.b64encode(file.read_bytes()).decode()
        label = escape(f"{scenario}: {', '.join(names)} on the same seed", quote=True)
        moving = f'<video controls muted playsinline aria-label="{label}" src="data:video/mp4;base64,{data}"></video>'
        caption = f"{', '.join(names)} on the same seed, episode {number}, from {start:.0f} s."
        return [figure(caption, {"": moving}, kind="video")]

    def _moment(self, scenario: str, rows: list[Row]) -> float:
        """Return the moment that a video must show: the first fall, else the first later event, else the motion."""
        falls = [float(row["time_to_fall_s"]) for row in rows if row["fell"]]
        if falls:
            return min(falls)
        _, settled, _ = ROBOTS[robot_of(self.run.cell(scenario)["env_id"])].motion
        later = [begin for begin, _ in _spans(rows[0]).values() if begin > settled]
        return min([*later, settled + LEAD])

    def _moving(self, scenario: str, name: str, row: Row) -> list[Snapshot]:
        """Return snapshots of one period of the motion."""
        motion, settled, period = ROBOTS[robot_of(self.run.cell(scenario)["env_id"])].motion
        start, span = min(settled, 0.3 * row["duration_s"]), min(period, 0.6 * row["duration_s"])
        times = [start + span * i / MOTION for i in range(MOTION)]
        return [Snapshot(f"The {motion} under {name}", time, f"{time:.2f} s") for time in times]

    def _seen(self, scenario: str, name: str, row: Row, snapshots: Iterable[Snapshot]) -> dict[float, Frame]:
        """Return frames by their requested times; none after the end of an episode that ended earlier."""
        cell, times = self.run.cell(scenario), sorted({snapshot.time_s for snapshot in snapshots})
        spec, gains = registered_controllers()[name], self.run.gains(scenario).get(name, {})
        return dict(
            zip(
                times,
                render_frames(cell["env_id"], cell["kwargs"], spec, gains, int(row["seed"]), times, WIDTH),
                strict=False,
            )
        )

    def _number(self, scenario: str) -> int:
        """Return the episode that the report's plots show, or the first one."""
        shown = self.run.episode(scenario)
        return shown.number if shown else min(self.run.result.episodes["episode"].tolist())

    def _row(self, scenario: str, name: str, number: int) -> Row:
        return {str(key): value for key, value in self.run.result.rows(scenario, name).loc[number].items()}

    def _drawable(self, scenario: str) -> list[str]:
        """Return controllers that finished the episode and can be built by name, the best first."""
        number, result = self._number(scenario), self.run.result
        order = ranking(result, scenario, metric_of(self.run.tracking(scenario)))
        done = [name for name in order if number in result.rows(scenario, name).index]
        return [name for name in done if name in registered_controllers()]


Row = Mapping[str, Any]


def _falling(name: str, row: Row) -> list[Snapshot]:
    if not row["fell"]:
        return []
    fall, strip = float(row["time_to_fall_s"]), f"The fall of {name}"
    times = [(before, fall - before) for before in BEFORE_FALL if before < fall]
    return [Snapshot(strip, time, f"{before:g} s before" if before else f"at {fall:.2f} s") for before, time in times]


def _events(name: str, row: Row) -> list[Snapshot]:
    """Return snapshots before, during and after each push and drop that the episode reached."""
    snapshots = []
    for event, (begin, end) in _spans(row).items():
        strip = f"{event} at {begin:g} s{_force(row, event)} under {name}"
        times = {"before": begin - BEFORE_EVENT, "in the middle": (begin + end) / 2}
        times |= {f"{after:g} s after": end + after for after in AFTER_EVENT}
        snapshots += [Snapshot(strip, time, text) for text, time in times.items() if 0 <= time <= row["duration_s"]]
    return snapshots


def _force(row: Row, event: str) -> str:
    size, body = (row.get(f"disturbance.push.{event.removeprefix('push')}.{key}") for key in ("magnitude", "body"))
    return "" if size is None else f" ({size:.3g} N on {str(body).replace('_', ' ')})"


def _spans(row: Row) -> Mapping[str, Span]:
    """Return the episode's pushes and drop."""
    drawn = nested({key: value for key, value in row.items() if key.startswith("disturbance.")})
    return {event: span for event, span in events_of(drawn).items() if span[0] < row["duration_s"]}


def _repeats(row: Row, seen: Mapping[float, Frame]) -> bool:
    """Return whether a run matches the stored one: the same fall at the same time, or none."""
    falls = [frame.time_s for frame in seen.values() if frame.over and frame.fall_reason]
    expected = [float(row["time_to_fall_s"])] if row["fell"] else []
    return len(falls) == len(expected) and all(map(math.isclose, falls, expected))


def _image(frame: Frame, snapshot: Snapshot) -> str:
    buffer = io.BytesIO()
    Image.fromarray(frame.picture).save(buffer, "WEBP", quality=QUALITY, method=6)
    text = escape(f"{snapshot.strip}: {snapshot.text}", quote=True)
    height, width, _ = frame.picture.shape
    data = base64.b64encode(buffer.getvalue()).decode()
    return f'<img alt="{text}" width="{width}" height="{height}" src="data:image/webp;base64,{data}">'
