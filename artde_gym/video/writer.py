"""Video files: MP4 and WebM through ffmpeg, GIF and WebP without it."""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from artde_gym.arguments import check_number
from artde_gym.errors import OptionError
from artde_gym.extras import needs
from artde_gym.files import check_replaceable

Picture = NDArray[np.uint8]

CODECS: dict[str, list[str]] = {
    ".mp4": ["-c:v", "libx264", "-crf", "24", "-preset", "veryfast", "-pix_fmt", "yuv420p", "-movflags", "+faststart"],
    ".webm": ["-c:v", "libvpx-vp9", "-crf", "36", "-b:v", "0", "-cpu-used", "5", "-row-mt", "1", "-pix_fmt", "yuv420p"],
}
SUFFIXES = (*CODECS, ".gif", ".webp", ".png")
UNITS = {".gif": 100, ".webp": 1000}
"""Suffix -> units per second in which the files count the duration of a frame."""
MAX_FPS = {".gif": 50.0, ".webp": 90.0}
"""Suffix -> most frames per second: browsers show frames shorter than 2 and 11 units for a tenth of a second."""
RATES = (0.01, 1000.0)
"""Lowest and highest frame rate (frames per second)."""
GIF_COLORS = 192
GIF_PALETTE_FRAMES = 12  # frames from which a GIF's palette is computed
WEBP_QUALITY = 75


def check(out: Path) -> None:
    """Check that a file can be made.

    Raises:
        OptionError: for a suffix that nothing is known for, or ffmpeg that is missing.
        StoreError: if it would take the place of a folder or a device.
    """
    if out.suffix not in SUFFIXES:
        raise OptionError("out", str(out), f"a file that ends in {', '.join(SUFFIXES)}")
    check_replaceable(out)
    if out.suffix in CODECS:
        ffmpeg(out)


def frame_rate(out: Path, fps: float) -> float:
    """Return the closest supported frame rate: MP4 and WebM take hundredths, GIF and WebP have a highest rate.

    Raises:
        OptionError: for a rate outside `RATES`.
    """
    slowest, fastest = RATES
    given = check_number("fps", fps, slowest, fastest, f"a number from {slowest:g} to {fastest:g}")
    return round(given, 2) if out.suffix in CODECS else min(given, MAX_FPS.get(out.suffix, fastest))


def durations(count: int, fps: float, units: int) -> list[int]:
    """Return the duration of each frame, in units of which a second has `units`, as (count,) numbers.

    Rounding errors do not accumulate: each frame begins within half a unit of its time.
    """
    ends = (round(i * units / fps) for i in range(count + 1))
    return [end - start for start, end in itertools.pairwise(ends)]


def write(out: Path, pictures: Iterator[Picture], fps: float) -> None:
    """Write frames of one size to a file, completely or not at all; PNG takes the first one.

    Raises:
        OptionError, StoreError: as `check`.
    """
    check(out)
    check_replaceable(out)
    writers: dict[str, Callable[[Path, Iterator[Picture], float], None]] = {
        ".gif": _gif, ".webp": _webp, ".png": _png
    }  # fmt: skip
    out.parent.mkdir(parents=True, exist_ok=True)
    part = out.with_name(f".{out.stem}.{os.getpid()}.part{out.suffix}")  # two commands may write one video
    try:
        writers.get(out.suffix, _encode)(part, pictures, fps)
        os.replace(part, out)
    finally:
        part.unlink(missing_ok=True)


def _encode(out: Path, pictures: Iterator[Picture], fps: float) -> None:
    library, first = ffmpeg(out), next(pictures)
    height, width, _ = first.shape
    pipe = library.write_frames(
        str(out), (width, height), fps=fps, codec=None, quality=None, macro_block_size=2,
        ffmpeg_log_level="error", output_params=CODECS[out.suffix],
    )  # fmt: skip
    pipe.send(None)
    try:
        pipe.send(np.ascontiguousarray(first))
        for picture in pictures:
            pipe.send(np.ascontiguousarray(picture))
    finally:
        pipe.close()


def _gif(out: Path, pictures: Iterator[Picture], fps: float) -> None:
    """Write a GIF with one palette for all frames, rare colors included, so that still parts stay still."""
    frames = [Image.fromarray(picture) for picture in pictures]
    sample = np.concatenate(
        [np.asarray(frame) for frame in frames[:: -(-len(frames) // GIF_PALETTE_FRAMES)] + frames[-1:]]
    )
    palette = Image.fromarray(sample).quantize(GIF_COLORS, Image.Quantize.MAXCOVERAGE)
    _animate(out, [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames], fps, optimize=True)


def _webp(out: Path, pictures: Iterator[Picture], fps: float) -> None:
    _animate(out, [Image.fromarray(picture) for picture in pictures], fps, quality=WEBP_QUALITY, method=4)


def _animate(out: Path, frames: list[Image.Image], fps: float, **options: Any) -> None:
    """Save frames as an endless loop; Pillow takes milliseconds for both formats."""
    units = UNITS[out.suffix]
    shown = [1000 // units * duration for duration in durations(len(frames), fps, units)]
    first, *rest = frames
    first.save(out, save_all=True, append_images=rest, duration=shown, loop=0, **options)


def _png(out: Path, pictures: Iterator[Picture], _fps: float) -> None:
    Image.fromarray(next(pictures)).save(out, optimize=True)


def ffmpeg(out: Path) -> Any:
    """Import the library that provides ffmpeg.

    Raises:
        OptionError: if it is missing (MissingDependencyError), or has no ffmpeg.
    """
    others = ", or choose .gif, .webp or .png"
    with needs("video", others):
        import imageio_ffmpeg
    try:
        imageio_ffmpeg.get_ffmpeg_exe()
    except RuntimeError as error:  # a package without a binary, on a system without one
        raise OptionError("out", str(out), f"install ffmpeg{others}", "needs ffmpeg, which is missing") from error
    return imageio_ffmpeg
