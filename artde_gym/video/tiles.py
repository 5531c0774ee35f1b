"""One or several controllers on the same seed in one picture: side by side, each under its name in its color."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageEnhance, ImageFont

from artde_gym.palette import styles
from artde_gym.video.frames import Frame

INK = (27, 31, 36)
SOFT = (91, 100, 112)
FALLEN = (163, 39, 28)
HEAD = 15  # a head's height is the width of a panel by this
GAP = 4  # pixels, between tiles


def tile_frames(shown: Mapping[str, Frame], title: str, columns: int) -> NDArray[np.uint8]:
    """Pictures of one instant by controller, under a common title; both sides are even, as video codecs want them.

    Args:
        shown: controller -> its picture; one that has ended is its last.
        title: of all.
        columns: tiles in a row.
    """
    height, width, _ = next(iter(shown.values())).picture.shape
    head = max(20, width // HEAD)
    rows = -(-len(shown) // columns)
    size = (columns * (width + GAP) - GAP, head + rows * (head + height + GAP) - GAP)
    page = Image.new("RGB", (size[0] + size[0] % 2, size[1] + size[1] % 2), "white")
    draw, colors = ImageDraw.Draw(page), styles(shown)
    _text(draw, (head // 3, head // 2), title, SOFT, head, 0.5, "lm", limit=size[0] - head // 2)
    for number, (name, frame) in enumerate(shown.items()):
        x, y = number % columns * (width + GAP), head + number // columns * (head + height + GAP)
        _text(draw, (x + head // 3, y + head // 2), name, colors[name].color, head, 0.68, "lm", stroke=head / 100)
        picture = Image.fromarray(frame.picture)
        if frame.over:
            picture = ImageEnhance.Color(picture).enhance(0.25)
            said = f"fell at {frame.time_s:.2f} s" if frame.fall_reason else f"end, {frame.time_s:.1f} s"
            ink = FALLEN if frame.fall_reason else SOFT
            _text(draw, (x + width - head // 3, y + head // 2), said, ink, head, 0.6, "rm", stroke=head / 150)
            if frame.fall_reason:
                edge = max(2, width // 160)
                ImageDraw.Draw(picture).rectangle((0, 0, width - 1, height - 1), None, FALLEN, edge)
        page.paste(picture, (x, y + head))
    return np.asarray(page)


def _text(
    draw: ImageDraw.ImageDraw,
    place: tuple[int, int],
    text: str,
    color: Any,
    head: int,
    share: float,
    anchor: str,
    *,
    stroke: float = 0.0,
    limit: float = float("inf"),
) -> None:
    """Text of a share of a head's height, shortened at the end to a limit (pixels)."""
    font = _font(share * head)
    while draw.textlength(text, font) > limit and len(text) > 4:
        text = text[:-4] + "..."
    draw.text(place, text, color, font, anchor, stroke_width=stroke)


@functools.lru_cache(maxsize=16)
def _font(size: float) -> Any:
    return ImageFont.load_default(size)
