"""An evaluation's folder read back: the same result, at any moment, or an error that names the damage."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from artde_gym.errors import StoreError
from artde_gym.evaluation import evaluate, read_result
from artde_gym.report import write_report
from tests.mutations import copied

FLYER: dict[str, Any] = {"env_kwargs": {"duration": 0.3}, "vectorized": True, "record_episodes": 0}


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Any:
    return evaluate(
        ["tde", "pid"], scenario=["Q1", "Q1-calm"], episodes=3, out=tmp_path_factory.mktemp("runs") / "main", **FLYER
    )


def test_it_is_the_result_that_was_written(run: Any) -> None:
    found = read_result(str(run.folder))
    pd.testing.assert_frame_equal(found.episodes, run.episodes, check_exact=True)
    assert (found.folder, found.complete) == (run.folder, True)
    pd.testing.assert_frame_equal(found.compare("tde", "pid"), run.compare("tde", "pid"), check_exact=True)
    pd.testing.assert_frame_equal(found.summary(), run.summary(), check_exact=True)


@pytest.mark.parametrize("kept", [0, 1, 5])
def test_an_unfinished_folder_has_its_finished_episodes(run: Any, kept: int, tmp_path: Path) -> None:
    folder = copied(run.folder, tmp_path / "run")
    head, *rows = (folder / "episodes.csv").read_text().splitlines(keepends=True)
    being_written = rows[kept][:20]
    (folder / "episodes.csv").write_text("".join([head, *rows[:kept], being_written]))
    found = read_result(folder)
    assert (len(found.episodes), found.complete) == (kept, False)
    assert found.controllers == list(dict.fromkeys(run.episodes["controller"][:kept]))


def replaced(name: str, old: str, new: str) -> Any:
    def change(folder: Path) -> None:
        text = (folder / name).read_text()
        assert old in text
        (folder / name).write_text(text.replace(old, new))

    return change


def of_another_seed(folder: Path) -> None:
    record = json.loads((folder / "summary.json").read_text())
    record["configuration"]["seed"] += 1
    (folder / "summary.json").write_text(json.dumps(record))


def twice(folder: Path) -> None:
    text = (folder / "episodes.csv").read_text()
    (folder / "episodes.csv").write_text(text + text.splitlines(keepends=True)[-1])


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (shutil.rmtree, "results folder.*cannot be read.*FileNotFoundError"),
        (lambda folder: (folder / "summary.json").write_text("{"), "results folder.*JSONDecodeError"),
        (replaced("summary.json", '"cells"', '"cels"'), "results folder.*KeyError"),
        (replaced("episodes.csv", "pid,", "pit,"), "has a controller 'pit' of another run"),
        (replaced("episodes.csv", "Q1-calm", "Q9"), "has a scenario 'Q9' of another run"),
        (replaced("episodes.csv", "False", "perhaps"), "column fell has values of another kind"),
        (of_another_seed, "has another seed for episode"),
        (twice, "a duplicate episode"),
    ],
)
def test_a_damaged_folder_is_refused_as_by_resumption_and_report(
    run: Any, damage: Any, words: str, tmp_path: Path
) -> None:
    folder = copied(run.folder, tmp_path / "run")
    damage(folder)
    with pytest.raises(StoreError, match=words):
        read_result(folder)
    if folder.exists():
        with pytest.raises(StoreError, match=words):
            write_report(folder)
