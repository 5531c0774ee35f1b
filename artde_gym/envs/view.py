"""Frames for `render`: an engine's image, overlaid with pushes, the time and the disturbances."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image, ImageDraw, ImageFont

from artde_gym.arrays import Array
from artde_gym.disturbances.schedule import Push
from artde_gym.errors import OptionError
from artde_gym.multibody.spec import Vector
from artde_gym.sim.camera import Camera
from artde_gym.sim.engine import PAYLOAD_LOOK, Engine

RATE = 30.0  # frames per simulated second
MAX_FPS, SLOW_FPS = 100.0, 50.0  # frames/s: the most that a video can have; its rate in slow motion
FRAME_SIZES = (16, 4096)  # pixels, smallest and largest width or height
PUSH = (196, 22, 60)
PATH = (120, 130, 150)
INK = (27, 31, 36)
METERS_PER_NEWTON = 0.012  # length of a push's arrow
ARROW_LENGTHS = (0.16, 0.6)  # m, smallest and largest
OVERSAMPLING = 3  # of drawn lines, for smooth edges


class View:
    """Frames of an engine's robot.

    Args:
        engine: engine that draws the robot.
        camera: distance, angles, size, and the target while the robot is at its nominal position.
        control_period: control period (s).
        share: share of the robot's offset from its nominal position that the camera does not follow: from 0 (the robot
            stays in the center of the frame) to 1.
        slack: largest distance of the robot from the center of the frame (m).

    Attributes:
        camera: the camera's initial pose.
        caption: the user's text in every frame, such as the controller's name.

    Raises:
        OptionError: for a size out of range.
    """

    def __init__(self, engine: Engine, camera: Camera, control_period: float, share: float, slack: float) -> None:
        low, high = FRAME_SIZES
        for name in ("width", "height"):
            size = getattr(camera, name)
            if not (isinstance(size, int) and low <= size <= high):
                raise OptionError(name, size, f"a whole number from {low} to {high}")
        self.caption = ""
        self._engine, self.camera = engine, camera
        self._share, self._slack = share, slack
        rate = 1.0 / control_period
        self.metadata = {"render_fps": SLOW_FPS if rate > MAX_FPS + 1e-9 else rate}
        self._last: tuple[Any, NDArray[np.uint8]] | None = None

    def reset(self) -> None:
        """Discard the last frame."""
        self._last = None

    def picture(
        self,
        time_s: float,
        home: Vector,
        pushes: Sequence[Push],
        disturbances: Mapping[str, Any],
        *,
        path: ArrayLike | None = None,
        cable: Sequence[Vector] = (),
        over: bool = False,
    ) -> NDArray[np.uint8]:
        """Return the frame at a time: a new one `RATE` times per second and at the end, else the last one.

        This keeps callers fast that ask after every step, as `RecordVideo` does.

        Args:
            time_s: simulated time (s).
            home: nominal position of the robot (m).
            pushes: active pushes.
            disturbances: sampled disturbances of the episode.
            path: points (n, 3) of a line (m).
            cable: points from the hook to the payload (m); empty without a cable.
            over: whether the episode has ended.
        """
        key = (int(time_s * RATE + 1e-6), over)
        if self._last is None or self._last[0] != key:
            camera = self.following(home)
            drawn = Image.fromarray(self._engine.render(camera))
            if path is not None:
                _line(drawn, camera.pixels(path), PATH)
            if cable:
                _rope(drawn, camera, cable)
            for push in pushes:
                _arrow(drawn, camera, self._engine.site(push.site), push.force)
            acting = [f"push {np.linalg.norm(push.force):.3g} N" for push in pushes]
            words = ", ".join([*_words(disturbances, time_s), *acting])
            head = f"{self.caption}   t = {time_s:.2f} s" if self.caption else f"t = {time_s:.2f} s"
            _write(drawn, [head, words] if words else [head])
            self._last = key, np.array(drawn)
        return self._last[1].copy()

    def following(self, home: Vector) -> Camera:
        """Return the current camera."""
        position = np.asarray(self._engine.state().position)
        off = np.clip(self._share * (position - home), -self._slack, self._slack)
        x, y, _ = (position - off).tolist()
        return self.camera._replace(target=(x, y, self.camera.target[2]))


def _words(disturbances: Mapping[str, Any], time_s: float) -> list[str]:
    """Return labels of the active disturbances; pushes are drawn where they act."""
    words = []
    for kind, values in disturbances.items():
        if kind == "payload":
            if values["attach_time"] <= time_s < values["detach_time"]:
                words.append(f"payload {values['mass']:.2f} kg")
        elif kind == "friction":
            words.append(f"friction {values['coefficient']:.2f}")
        elif kind not in ("push", "initial_position"):
            words.append(kind.replace("_", " "))
    return words


def _arrow(picture: Image.Image, camera: Camera, point: Vector, force: Vector) -> None:
    """Draw a force (N) on a point (m) as an arrow; a larger force is longer."""
    size = float(np.linalg.norm(force))
    if size == 0.0:
        return
    length = float(np.clip(METERS_PER_NEWTON * size, *ARROW_LENGTHS))
    end = np.asarray(point)
    tail, tip = camera.pixels([end - length * np.asarray(force) / size, end])
    along = tip - tail
    seen = float(np.linalg.norm(along))
    if not seen > 1.0:
        return  # points at the camera
    along /= seen
    across = np.array([-along[1], along[0]])
    wide = picture.height / 110
    head = min(4 * wide, 0.6 * seen)
    neck = tip - head * along
    corners = [tail + wide * across, neck + wide * across, neck + 2.2 * wide * across, tip,
               neck - 2.2 * wide * across, neck - wide * across, tail - wide * across]  # fmt: skip
    _fill(picture, corners, PUSH)
    draw, font = ImageDraw.Draw(picture), _font(picture.height)
    x, y = (tail - 1.6 * font.size * along).tolist()
    draw.text((x, y), f"{size:.3g} N", PUSH, font, "mm", stroke_width=2, stroke_fill="white")


def _fill(picture: Image.Image, corners: Sequence[Array], color: tuple[int, int, int]) -> None:
    """Draw a polygon with smooth edges and a white rim."""
    points = [(OVERSAMPLING * float(x), OVERSAMPLING * float(y)) for x, y in corners]
    rim = Image.new("L", (OVERSAMPLING * picture.width, OVERSAMPLING * picture.height))
    ImageDraw.Draw(rim).line([*points, points[0]], 255, 2 * OVERSAMPLING, "curve")
    body = Image.new("L", rim.size)
    ImageDraw.Draw(body).polygon(points, 255)
    picture.paste((255, 255, 255), None, rim.reduce(OVERSAMPLING))
    picture.paste(color, None, body.reduce(OVERSAMPLING))


def _line(picture: Image.Image, points: Array, color: tuple[int, int, int]) -> None:
    """Draw a thin, half-transparent line through pixels (n, 2)."""
    mask = Image.new("L", (OVERSAMPLING * picture.width, OVERSAMPLING * picture.height))
    whole = np.isfinite(points).all(axis=1)
    ImageDraw.Draw(mask).line([*map(tuple, (OVERSAMPLING * points[whole]).tolist())], 150, OVERSAMPLING)
    picture.paste(color, None, mask.reduce(OVERSAMPLING))


def _rope(picture: Image.Image, camera: Camera, points: Sequence[Vector]) -> None:
    """Draw a cable up to the surface of its load."""
    ends = np.linalg.norm(np.subtract(points, points[-1]), axis=1) > PAYLOAD_LOOK
    seen = camera.pixels(np.asarray(points)[ends]) if ends.any() else np.zeros((0, 2))
    if len(seen) > 1 and np.isfinite(seen).all():
        mask = Image.new("L", (OVERSAMPLING * picture.width, OVERSAMPLING * picture.height))
        wide = max(2, round(OVERSAMPLING * picture.height / 240))
        ImageDraw.Draw(mask).line([*map(tuple, (OVERSAMPLING * seen).tolist())], 255, wide, "curve")
        picture.paste(INK, None, mask.reduce(OVERSAMPLING))


def _write(picture: Image.Image, lines: Sequence[str]) -> None:
    """Write lines of text in the lower left corner on a light background."""
    draw, font = ImageDraw.Draw(picture, "RGBA"), _font(picture.height)
    step, margin = 1.35 * font.size, 0.5 * font.size
    wide = max(draw.textlength(line, font) for line in lines)
    top = picture.height - step * len(lines) - 2 * margin
    box = (margin, top, margin + wide + 2 * margin, picture.height - margin)
    draw.rounded_rectangle(box, margin, (255, 255, 255, 190))
    for number, line in enumerate(lines):
        draw.text((2 * margin, top + margin / 2 + step * (number + 0.5)), line, INK, font, "lm")


@functools.lru_cache(maxsize=8)
def _font(height: int) -> Any:
    """Return a font for frames of a given height (pixels)."""
    return ImageFont.load_default(max(9.0, height / 30))
