"""What an environment's `render` shows: an engine's picture, with pushes, the time and the disturbances on top."""

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

RATE = 30.0  # pictures a simulated second
MAX_FPS, SLOW_FPS = 100.0, 50.0  # frames/s: what a video can have, and has in slow motion where steps are shorter
SIZES = (16, 4096)  # pixels, of a picture's sides
PUSH = (196, 22, 60)
PATH = (120, 130, 150)
INK = (27, 31, 36)
METRES_PER_NEWTON = 0.012  # of an arrow
ARROW = (0.16, 0.6)  # m, its shortest and longest
FINER = 3  # of the raster on which lines are drawn, so that their edges are smooth


class View:
    """Pictures of an engine's robot.

    Args:
        engine: which draws the robot.
        camera: distance, angles and size; its target is what the camera looks at while the robot is there.
        control_period: s.
        share: how much of the robot's way from there the camera leaves to it, 0 (always in the middle) to 1, up to
        slack: the farthest from the middle that the robot may go (m).

    Attributes:
        camera: where it is in the beginning.
        caption: words of the user's in every picture, such as the controller's name.

    Raises:
        OptionError: for a size out of range.
    """

    def __init__(self, engine: Engine, camera: Camera, control_period: float, share: float, slack: float) -> None:
        low, high = SIZES
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
        """Forget the last picture."""
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
        """The picture at a time: a new one `RATE` times a second, and in the end; in between the last one.

        Whoever asks after every step, as `RecordVideo` does, so need not wait for a thousand pictures a second.

        Args:
            home: where the robot is meant to be (m).
            pushes: that act now.
            disturbances: of the episode, sampled.
            path: (n, 3), drawn as a line (m).
            cable: points from the hook to the payload (m), none without a cable.
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
        """Where the camera is now."""
        position = np.asarray(self._engine.state().position)
        off = np.clip(self._share * (position - home), -self._slack, self._slack)
        x, y, _ = (position - off).tolist()
        return self.camera._replace(target=(x, y, self.camera.target[2]))


def _words(disturbances: Mapping[str, Any], time_s: float) -> list[str]:
    """What disturbs the robot at a time; pushes are shown where they act."""
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
    """A force (N) that presses on a point (m), longer for a larger one."""
    size = float(np.linalg.norm(force))
    if size == 0.0:
        return
    length = float(np.clip(METRES_PER_NEWTON * size, *ARROW))
    end = np.asarray(point)
    tail, tip = camera.pixels([end - length * np.asarray(force) / size, end])
    along = tip - tail
    seen = float(np.linalg.norm(along))
    if not seen > 1.0:
        return  # towards the eye
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
    """A polygon with smooth edges and a white rim."""
    points = [(FINER * float(x), FINER * float(y)) for x, y in corners]
    rim = Image.new("L", (FINER * picture.width, FINER * picture.height))
    ImageDraw.Draw(rim).line([*points, points[0]], 255, 2 * FINER, "curve")
    body = Image.new("L", rim.size)
    ImageDraw.Draw(body).polygon(points, 255)
    picture.paste((255, 255, 255), None, rim.reduce(FINER))
    picture.paste(color, None, body.reduce(FINER))


def _line(picture: Image.Image, points: Array, color: tuple[int, int, int]) -> None:
    """A thin line through pixels (n, 2), half transparent."""
    mask = Image.new("L", (FINER * picture.width, FINER * picture.height))
    whole = np.isfinite(points).all(axis=1)
    ImageDraw.Draw(mask).line([*map(tuple, (FINER * points[whole]).tolist())], 150, FINER)
    picture.paste(color, None, mask.reduce(FINER))


def _rope(picture: Image.Image, camera: Camera, points: Sequence[Vector]) -> None:
    """A cable up to the surface of its load."""
    ends = np.linalg.norm(np.subtract(points, points[-1]), axis=1) > PAYLOAD_LOOK
    seen = camera.pixels(np.asarray(points)[ends]) if ends.any() else np.zeros((0, 2))
    if len(seen) > 1 and np.isfinite(seen).all():
        mask = Image.new("L", (FINER * picture.width, FINER * picture.height))
        wide = max(2, round(FINER * picture.height / 240))
        ImageDraw.Draw(mask).line([*map(tuple, (FINER * seen).tolist())], 255, wide, "curve")
        picture.paste(INK, None, mask.reduce(FINER))


def _write(picture: Image.Image, lines: Sequence[str]) -> None:
    """Lines of text in the lower left corner, on a light ground."""
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
    """A font for pictures of a height."""
    return ImageFont.load_default(max(9.0, height / 30))
