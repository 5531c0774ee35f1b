"""Videos as their viewers have them: read back from the files, frame by frame."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.wrappers import RecordVideo
from PIL import Image
from typer.testing import CliRunner

import controllers
from artde_gym.cli import app
from artde_gym.errors import OptionError, UnknownNameError
from artde_gym.evaluation import evaluate
from artde_gym.palette import STYLES
from artde_gym.registration import registered_controllers
from artde_gym.video import video
from artde_gym.video.frames import Frame, render_frames
from artde_gym.video.tiles import FALLEN_RGB, tile_frames
from artde_gym.video.writer import durations, frame_rate, write

WALK, FLYER = "BipedWalk-Payload-v0", "QuadInfinity-Payload-v0"
SHOVE = {"body": "chest", "magnitude": 80.0, "direction": [1.0, 0.0, 0.0], "start": 0.2, "duration": 0.2}
FALL: dict[str, Any] = {"disturbances": {"push": [SHOVE]}, "env_kwargs": {"duration": 3.0, "control_period": 0.004}}
FLIGHT: dict[str, Any] = {"env_kwargs": {"duration": 2.0}, "disturbances": {"payload": 0.35}}


def frames(path: Path) -> list[np.ndarray]:
    """Of a GIF or a WebP."""
    with Image.open(path) as film:
        return [np.array(_at(film, number).convert("RGB")) for number in range(getattr(film, "n_frames", 1))]


def _at(film: Any, number: int) -> Any:
    film.seek(number)
    return film


DECODE = """
import imageio_ffmpeg, json, sys
frames = imageio_ffmpeg.read_frames(sys.argv[1])
meta = next(frames)
print(json.dumps({**meta, "frames": sum(1 for _ in frames)}))
"""


def decoded(path: Path) -> dict[str, Any]:
    """What ffmpeg says of a video; in a process of its own, as the library leaves pipes open when ffmpeg is faster."""
    pytest.importorskip("imageio_ffmpeg")
    command = [sys.executable, "-c", DECODE, str(path)]
    return json.loads(subprocess.run(command, capture_output=True, text=True, timeout=60, check=True).stdout)


def near(picture: np.ndarray, color: str | tuple[int, ...], tolerance: int = 30) -> np.ndarray:
    wanted = [int(color[i : i + 2], 16) for i in (1, 3, 5)] if isinstance(color, str) else color
    return np.abs(picture.astype(int) - wanted).max(axis=-1) < tolerance


def test_shots_are_of_the_episode_that_evaluate_runs() -> None:
    """Its fall comes at the same time, and pictures at the first samples from the wanted times on."""
    row = evaluate(["tde"], WALK, episodes=1, seed=5, **FALL).episodes.iloc[0]
    kwargs = {**FALL["env_kwargs"], "disturbances": FALL["disturbances"]}
    spec = registered_controllers()["tde"]
    seen = list(render_frames(WALK, kwargs, spec, {}, int(row["seed"]), [0.0, 0.1, 0.25, 9.0, 10.0], 64))
    assert [frame.time_s for frame in seen] == pytest.approx([0.0, 0.1, 0.252, row["time_to_fall_s"]])
    assert [frame.over for frame in seen] == [False, False, False, True]
    assert seen[-1].fall_reason == row["fall_reason"]
    assert all(frame.picture.shape == (48, 64, 3) for frame in seen)


@pytest.mark.parametrize("suffix", [".gif", ".webp"])
def test_two_controllers_side_by_side_with_their_fall(tmp_path: Path, suffix: str) -> None:
    out = video(["tde", "artde"], tmp_path / f"x{suffix}", WALK, width=160, fps=10.0, **FALL)
    film = frames(out)
    first, last = film[0], film[-1]
    height, width, _ = first.shape
    assert width == 2 * 160 + 4
    assert height % 2 == 0
    for number, name in enumerate(("tde", "artde")):
        part = np.s_[20:42, number * 164 : number * 164 + 80]
        assert near(first[part], STYLES[name].color, 60).sum() > 10
        panel = np.s_[45:, number * 164 : number * 164 + 160]
        assert near(last[panel], FALLEN_RGB).sum() > 300  # its frame
        assert not near(first[panel], FALLEN_RGB).sum() > 10
    assert not np.array_equal(first, film[3])


def test_mp4_has_the_length_of_the_part_that_is_shown(tmp_path: Path) -> None:
    pytest.importorskip("imageio_ffmpeg")
    out = video(
        ["tde"], tmp_path / "new" / "x.mp4", "QuadInfinity-Payload-v0", start=0.5, end=1.5, fps=20.0, width=96, **FLIGHT
    )
    meta = decoded(out)
    assert meta["fps"] == 20
    assert meta["duration"] == pytest.approx(1.0, abs=0.06)
    assert meta["source_size"][0] == 96
    assert meta["frames"] == 20
    slow = video(
        ["tde"], tmp_path / "slow.webm", "QuadInfinity-Payload-v0", end=0.5, speed=0.5, fps=20.0, width=96, **FLIGHT
    )
    assert decoded(slow)["duration"] == pytest.approx(1.0, abs=0.06)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["new", "slow.webm"]


def test_png_is_one_picture_and_the_same_each_time(tmp_path: Path) -> None:
    arguments: dict[str, Any] = {"start": 1.0, "width": 160, "seed": 2, "episode": 1, **FLIGHT}
    one, two = (video(["pid"], tmp_path / name, "QuadInfinity-Payload-v0", **arguments) for name in ("a.png", "b.png"))
    assert one.read_bytes() == two.read_bytes()
    assert frames(one)[0].shape[1] == 160


def test_panels_freeze_who_has_ended_and_fill_rows() -> None:
    gray, red = np.full((60, 80, 3), 128, np.uint8), np.full((60, 80, 3), (220, 40, 40), np.uint8)
    walks, fell = Frame(1.5, gray, False, ""), Frame(1.25, red, True, "tilt")
    page = tile_frames({"tde": fell, "atde": walks, "artde": walks}, "title", 2)
    assert page.shape[0] % 2 == page.shape[1] % 2 == 0
    assert page.shape[1] == 164
    panel = page[20 + 20 :][:60, :80]
    middle = panel[30, 40].astype(int)
    assert middle.max() - middle.min() < 80 < 180  # paler than it was
    assert near(panel[:2], FALLEN_RGB).all()
    assert (page[-62:-4, 84:] > 250).all()  # the fourth place is free


RATES = [0.01, 0.1, 1.0, 7.0, 12.0, 15.0, 24.0, 25.0, 29.97, 30.0, 33.0, 40.0, 48.0, 50.0, 60.0, 75.0, 90.0, 1000.0]


def played(path: Path) -> int:
    """Milliseconds that a viewer takes for a GIF or a WebP, as its frames say."""
    with Image.open(path) as film:
        total = 0
        for number in range(getattr(film, "n_frames", 1)):
            _at(film, number).load()
            total += film.info["duration"]
    return total


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize(("suffix", "unit"), [(".gif", 10), (".webp", 1)])
def test_a_file_plays_for_as_long_as_its_pictures_take(tmp_path: Path, suffix: str, unit: int, rate: float) -> None:
    """To half of what the format counts in (ms), also where pictures that stay the same are stored once."""
    moving = np.random.default_rng(0).integers(0, 255, (13, 16, 16, 3), dtype=np.uint8)
    shown, out = [*moving, *moving[-1:].repeat(3, axis=0)], tmp_path / f"x{suffix}"
    fps = frame_rate(out, rate)
    write(out, iter(shown), fps)
    assert played(out) == pytest.approx(1000 * len(shown) / fps, abs=unit / 2 + 1e-6)


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("units", [100, 1000])
def test_every_picture_begins_within_half_a_part_of_its_time(units: int, rate: float) -> None:
    ends = np.cumsum(durations(500, rate, units))
    assert np.abs(ends - np.arange(1, 501) * units / rate).max() <= 0.5 + 1e-9


def test_the_fastest_rate_is_that_of_browsers() -> None:
    assert frame_rate(Path("x.gif"), 30.0) == frame_rate(Path("x.webp"), 30.0) == 30.0
    assert frame_rate(Path("x.gif"), 1000.0) == 50.0
    assert min(durations(100, frame_rate(Path("x.webp"), 1000.0), 1000)) == 11
    assert frame_rate(Path("x.mp4"), 1 / 3) == 0.33  # ffmpeg is told two digits: pictures are of these times, too


def test_a_film_plays_at_the_pace_that_was_asked_for(tmp_path: Path) -> None:
    """Two seconds of a flight at 30 pictures a second."""
    for suffix in (".gif", ".webp"):
        out = video(["pid"], tmp_path / f"x{suffix}", FLYER, start=0.2, end=1.2, speed=0.5, width=48, **FLIGHT)
        assert played(out) == 2000


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"out": "x.avi"}, "x.avi.*mp4.*gif"),
        ({"start": -1.0}, "start is -1.0"),
        ({"start": 2.0, "end": 1.0}, "end is 1.0"),
        ({"speed": 0.0}, "speed is 0.0"),
        ({"fps": float("nan")}, "fps is nan"),
        ({"columns": 0}, "columns is 0"),
        ({"width": 3}, "width is 3"),
        ({"fps": 1e-9}, "fps is 1e-09.*0.01 to 1000"),
        ({"speed": 1e-308}, "speed is 1e-308"),
        ({"speed": 0.001, "fps": 1000.0, "out": "x.webp"}, "number of pictures .* is above 20000"),
        ({"seed": -1}, "seed is -1"),
        ({"episode": -1}, "episode is -1"),
        ({"gains": [1]}, "gains is .1.; allowed: a mapping"),
        ({"gains": {"tde": [1]}}, "gains of 'tde' is .1."),
        ({"start": 70.5}, "start is 70.5.*the end of the episode, 70 s"),
    ],
)
def test_bad_arguments_name_field_value_and_what_is_allowed(
    tmp_path: Path, arguments: dict[str, Any], words: str
) -> None:
    given: dict[str, Any] = {"out": "x.gif", **arguments}
    with pytest.raises(OptionError, match=words):
        video(["tde"], tmp_path / given.pop("out"), "QuadInfinity-Payload-v0", **given)
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(UnknownNameError, match="tdee"):
        video(["tdee"], tmp_path / "x.gif")


def test_a_part_after_the_last_fall_is_refused(tmp_path: Path) -> None:
    with pytest.raises(OptionError, match=r"start is 2\.0; allowed: up to the end of the episode, 0"):
        video(["tde"], tmp_path / "x.gif", WALK, start=2.0, width=48, **FALL)
    assert list(tmp_path.iterdir()) == []


def test_without_ffmpeg_one_clear_line(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    answer = CliRunner().invoke(app, ["video", "--out", str(tmp_path / "x.mp4")])
    assert isinstance(answer.exception, OptionError)
    assert "artde-gym[video]" in str(answer.exception)
    assert ".gif" in str(answer.exception)


def test_command(tmp_path: Path) -> None:
    out = tmp_path / "x.webp"
    line = f"video --env QuadInfinity-Payload-v0 --controllers tde,pid --end 0.3 --fps 10 --width 96 --out {out}"
    answer = CliRunner().invoke(app, line.split())
    assert answer.exit_code == 0, answer.output
    assert len(frames(out)) == 3


def test_gymnasium_records_at_the_pace_of_the_simulation(tmp_path: Path) -> None:
    pytest.importorskip("moviepy")
    drawn: dict[str, Any] = {"render_mode": "rgb_array", "width": 160, "height": 120, "disturbances": {}}
    env = gym.make(WALK, disable_env_checker=True, duration=0.5, control_period=0.01, **drawn)
    env = RecordVideo(env, str(tmp_path / "videos"))
    policy, state, over = controllers.make("tde", env), None, False
    observation, _ = env.reset(seed=0)
    while not over:
        action, state = policy.predict(observation, state)
        observation, _, terminated, truncated, _ = env.step(action)
        over = terminated or truncated
    env.close()
    meta = decoded(tmp_path / "videos" / "rl-video-episode-0.mp4")
    assert meta["duration"] == pytest.approx(0.5, abs=0.02)
