"""The report of real, short runs: in words, in numbers, and in a browser."""

from __future__ import annotations

import base64
import html.parser
import io
import json
import re
import shutil
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from PIL import Image
from typer.testing import CliRunner

from artde_gym.cli import app
from artde_gym.envs.view import PUSH
from artde_gym.errors import StoreError
from artde_gym.evaluation.result import Result
from artde_gym.palette import Style
from artde_gym.report import write_report
from artde_gym.report.answer import headline, ranking, sentences
from artde_gym.report.chart import Axis, Chart
from artde_gym.report.laws import Laws
from artde_gym.report.run import Run, nested

pytestmark = pytest.mark.once


class Reader(html.parser.HTMLParser):
    """Tags with their attributes, in order."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))

    def of(self, tag):
        return [attributes for name, attributes in self.tags if name == tag]


def test_one_file_without_network_whose_charts_have_names(walks, flights, bracket):
    for folder in (walks, flights, bracket):
        path = folder / "report.html"
        text = path.read_text(encoding="utf-8")
        assert path.stat().st_size < 5e6
        assert not re.search(r"(src|href)=\"?https?:", text)
        reader = Reader(path)
        named = [svg for svg in reader.of("svg") if svg.get("aria-hidden") != "true"]
        assert named
        assert all(svg["role"] == "img" and svg["aria-label"] for svg in named)
        assert text.count("<table>") == text.count("<caption>") > 0
        assert all(head["scope"] in ("col", "row") for head in reader.of("th"))
        ids = [attributes["id"] for _, attributes in reader.tags if "id" in attributes]
        assert len(ids) == len(set(ids))
        links = [link["href"] for link in reader.of("a")]
        assert {link.removeprefix("#") for link in links if link} <= set(ids)


def test_the_same_folder_gives_the_same_bytes(flights):
    before = (flights / "report.html").read_bytes()
    write_report(flights, pictures=True)
    assert (flights / "report.html").read_bytes() == before


def test_everything_of_the_biped_and_of_the_quadrotor_is_there(walks, flights):
    shared = ["Tracking error", "Lyapunov function V", "b0", "sliding variable", "Block diagram", "M^-1 m_bar"]
    own = {
        walks: [
            "Claims of the thesis",
            "Ground reaction force under artde",
            "center of mass",
            "Desired joint",
            "Tilt",
            "push0",
        ],
        flights: ["three dimensions", "XZ plane", "YZ plane", "phi", "theta", ">drop<"],
    }
    for folder, words in own.items():
        text = (folder / "report.html").read_text(encoding="utf-8")
        assert [word for word in [*shared, *words] if word not in text] == []


def pictures_of(path: Path) -> dict[str, np.ndarray]:
    """Pictures of a page by what they say that they show."""
    found = {}
    for image in Reader(path).of("img"):
        kind, data = str(image["src"]).split(",", 1)
        assert kind == "data:image/webp;base64"
        found[str(image["alt"])] = np.array(Image.open(io.BytesIO(base64.b64decode(data))).convert("RGB"))
    return found


def test_pictures_of_the_walk_of_pushes_and_of_falls(walks):
    """Of the episode whose signals are plotted: what falls at a time is upright a second before."""
    rows = Run.read(walks).result.episodes.query("episode == 0").set_index("controller")
    seen = pictures_of(walks / "report.html")
    assert all(picture.shape == (240, 320, 3) for picture in seen.values())
    fallen = [name for name in rows.index if rows.loc[name, "fell"]]
    assert fallen
    for name in fallen:
        strip = [text for text in seen if text.startswith(f"The fall of {name}: ")]
        assert strip[-1] == f"The fall of {name}: at {rows.loc[name, 'time_to_fall_s']:.2f} s"
        assert len(strip) >= 3
    assert sum("The walk under" in text for text in seen) == 6
    pushed = next(
        text for text in seen if text.startswith("push0 at 0.5 s (60 N on chest)") and "in the middle" in text
    )
    red = np.abs(seen[pushed].astype(int) - PUSH).max(axis=-1) < 40
    assert red.sum() > 100  # an arrow
    assert (walks / "report.html").stat().st_size < 2e6


def test_pictures_of_the_flight_and_of_the_drop(flights):
    seen = pictures_of(flights / "report.html")

    def orange(end: str) -> int:
        text = next(text for text in seen if text.startswith("drop at 2 s") and text.endswith(end))
        picture = seen[text].astype(int)
        return int((picture[..., 0] > picture[..., 2] + 80).sum())

    before, after = orange("before"), orange("0.8 s after")
    assert before > 40
    assert after < before / 3
    assert sum("The flight under" in text for text in seen) == 6


def test_a_run_that_does_not_repeat_is_not_shown(walks, tmp_path):
    folder = tmp_path / "run"
    shutil.copytree(walks, folder)
    frame = pd.read_csv(folder / "episodes.csv")
    frame["time_to_fall_s"] += 0.05  # as if another machine had run it
    frame.to_csv(folder / "episodes.csv", index=False)
    text = write_report(folder, pictures=True).read_text(encoding="utf-8")
    assert "did not repeat the stored episode" in text
    assert "The fall of tde:" not in text
    assert "The fall of tde+kd:" in text  # whose table was left alone


def test_what_cannot_be_drawn_is_one_sentence_and_the_rest_is_there(flights, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    folder = tmp_path / "run"
    shutil.copytree(flights, folder)
    text = write_report(folder, videos=True).read_text(encoding="utf-8")
    assert text.count("Nothing is drawn here: ") == 1
    assert "artde-gym[video]" in text
    assert "Tracking error" in text


def test_the_ablation_stands_beside_the_others(walks):
    run = Run.read(walks)
    assert run.result.controllers == ["tde", "artde", "tde+kd"]
    assert len(run.result.rows("S1", "tde+kd")) == 2
    episode = run.episode("S1")
    assert episode is not None
    assert list(episode.signals) == ["tde", "artde", "tde+kd"]
    assert run.gains("S1") == {"tde+kd": {"c": 5.0}}


def test_what_follows_a_push_is_a_table_of_the_stored_numbers(walks):
    frame = pd.read_csv(walks / "episodes.csv")
    text = (walks / "report.html").read_text(encoding="utf-8")
    table = text[text.index("after pushes and drops") :]
    peaks = frame.loc[frame["controller"] == "tde", "peak_error_deg_push0"]
    assert f'data-v="{peaks.mean():.9g}"' in table
    assert "median recovery (s)" in table


def test_a_training_says_which_test_was_the_best(training, tmp_path):
    text = (training / "report.html").read_text(encoding="utf-8")
    assert "Best of 3 held-out tests: score -0.01 after 2 million decisions." in text
    assert "Later tests without improvement: 1, the last one -0.02" in text
    assert "50 % in the first test, 0 % in the best" in text
    shutil.copytree(training, tmp_path / "run")
    (tmp_path / "run" / "learning_curve.csv").write_text("steps,score\n")
    with pytest.raises(StoreError, match="held-out test"):
        write_report(tmp_path / "run")


def test_an_interrupted_run_has_a_report(walks, tmp_path):
    folder = tmp_path / "run"
    shutil.copytree(walks, folder)
    whole = (folder / "episodes.csv").read_text().splitlines(keepends=True)
    (folder / "episodes.csv").write_text("".join(whole[:2]) + whole[2][:40])  # the second row is being written
    (folder / "claims.csv").unlink()
    shutil.rmtree(folder / "ablation")
    text = write_report(folder).read_text(encoding="utf-8")
    assert "Interrupted or still running" in text
    assert "there is nothing to compare it with" in text
    (folder / "episodes.csv").unlink()
    shutil.rmtree(folder / "traces")
    assert "No episode was finished yet" in write_report(folder).read_text(encoding="utf-8")


def test_a_folder_of_something_else_is_refused_in_one_line(tmp_path):
    for folder in (tmp_path, tmp_path / "missing"):
        with pytest.raises(StoreError, match="results folder"):
            write_report(folder)


def test_command(flights, tmp_path):
    folder = tmp_path / "run"
    shutil.copytree(flights, folder)
    (folder / "report.html").unlink()
    answer = CliRunner().invoke(app, ["report", str(folder)])
    assert answer.exit_code == 0
    assert "report.html" in answer.output
    assert (folder / "report.html").exists()


@pytest.fixture(scope="module")
def tracking(flights):
    return Run.read(flights).tracking("custom")


def made_up(**columns):
    """Episodes of controllers a and b: name -> (fell, error) of each."""
    rows = [
        {"scenario": "x", "controller": name, "episode": i, "seed": i, "fell": fell, "rmse_m": error, "env": "none"}
        for name, pairs in columns.items()
        for i, (fell, error) in enumerate(pairs)
    ]
    return Result(pd.DataFrame(rows))


def test_answer_names_the_better_one_by_how_much_and_how_surely(tracking):
    sure = made_up(a=[(False, 0.9 + 0.001 * i) for i in range(8)], b=[(False, 1.0 + 0.001 * i) for i in range(8)])
    first, second = sentences(sure, "x", tracking)
    assert first.startswith("a leads: no fall in 8 episodes; RMS error 0.9035")
    assert "Against b" in second
    assert re.search(r"the RMS error of a is 10\.0 \((9\.9|10\.0)\.\.10\.0\) % smaller on the 8 shared seeds", second)
    assert "beyond chance at 95 %" in second
    assert headline(sure, {"x": tracking}) == "Best, by falls first and RMS error second: a in x."


def test_answer_leaves_open_what_is_open(tracking):
    alternating = made_up(a=[(False, 1.0 + 0.2 * (-1) ** i) for i in range(8)], b=[(False, 1.01)] * 8)
    assert "(undecided)" in sentences(alternating, "x", tracking)[1]


def test_falls_come_before_errors(tracking):
    result = made_up(a=[(True, 0.1)] * 8, b=[(False, 1.0)] * 8)
    assert ranking(result, "x", "rmse_m") == ["b", "a"]
    assert "it fell in 8 of 8 episodes (beyond chance at 95 %)" in sentences(result, "x", tracking)[1]
    fallen = made_up(a=[(True, 0.1)] * 3, b=[(True, 1.0)] * 3)
    assert sentences(fallen, "x", tracking)[0] == "Every controller fell in every episode."
    assert "no controller in x" in headline(fallen, {"x": tracking})
    assert "take the intervals with care" in sentences(fallen, "x", tracking)[-1]


def test_lyapunov_matrix_solves_its_equation(walks, flights):
    for folder, scenario in ((walks, "S1"), (flights, "custom")):
        laws = Laws(Run.read(folder))
        found = laws.lyapunov_matrix(scenario)
        assert found is not None
        name, p11, p12, p22 = found
        gains = laws.gains(scenario)[name]
        suffix = "" if "k_p" in gains else "_p"
        k_p, k_d = (float(np.ravel(gains[f"{gain}{suffix}"])[0]) for gain in ("k_p", "k_d"))
        a = np.array([[0.0, 1.0], [-k_p, -k_d]])
        p = np.array([[np.ravel(p11)[0], np.ravel(p12)[0]], [np.ravel(p12)[0], np.ravel(p22)[0]]])
        np.testing.assert_allclose(a.T @ p + p @ a, -np.eye(2), atol=1e-12)


def test_columns_become_the_disturbances_again(walks):
    episode = Run.read(walks).episode("S1")
    assert episode is not None
    (push,) = episode.disturbances["push"]
    assert push["start"] == 0.5
    assert push["direction"] == [1.0, 0.0, 0.0]
    assert episode.events == {"push0": (0.5, 0.7)}
    assert nested({"disturbance.payload.mass": 1.0, "disturbance.friction.coefficient": float("nan")}) == {
        "payload": {"mass": 1.0}
    }


def test_thinned_lines_keep_every_peak():
    rng = np.random.default_rng(0)
    values = rng.normal(size=50_000)
    values[12_345], values[40_001] = 99.0, -99.0
    chart = Chart("noise", Axis("time (s)", 0.0, 1.0), Axis("value (m)", -100.0, 100.0))
    chart.line(np.linspace(0, 1, len(values)), values, Style("#000000", "o"))
    (path,) = re.findall(r'class="line"[^>]* d="([^"]*)"', chart.svg())
    heights = [float(point.split()[1]) for point in re.findall(r"[\d.]+ [\d.]+", path)]
    top, bottom = 250 - 40 - 198 * 0.995, 250 - 40 - 198 * 0.005
    assert min(heights) == pytest.approx(top, abs=0.06)
    assert max(heights) == pytest.approx(bottom, abs=0.06)
    assert len(heights) < 500


@pytest.mark.parametrize(
    ("axis", "expected"),
    [
        (Axis("x", 0.0, 1.0), [0.0, 0.2, 0.4, 0.6, 0.8, 1.0]),
        (Axis("x", -0.11, 0.31), [-0.1, 0.0, 0.1, 0.2, 0.3]),
        (Axis("x", 0.1, 10.0, log=True), [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0]),
        (Axis("x", 1e-6, 1.0, log=True), [1e-6, 1e-4, 1e-2, 1.0]),
    ],
)
def test_ticks_are_round_and_inside(axis, expected):
    assert axis.ticks() == pytest.approx(expected)


def test_record_is_all_that_a_report_needs_besides_the_episodes(flights):
    record = json.loads((flights / "summary.json").read_text())
    text = (flights / "report.html").read_text(encoding="utf-8")
    assert record["provenance"]["time"] in text
