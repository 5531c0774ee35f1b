"""Damaged files, and such as were made to do harm: an error of ours, nothing executed, nothing written elsewhere."""

from __future__ import annotations

import json
import os
import random
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from artde_gym.errors import ArtdeGymError, OptionError, StoreError
from artde_gym.evaluation import evaluate, read_result
from artde_gym.evaluation.tasks import Update
from artde_gym.report import write_report
from artde_gym.studies import frontier, sweep, tune
from controllers import GainError
from tests.mutations import copied, mutate

pytestmark = pytest.mark.once

TRIES = int(os.environ.get("EXAMPLES", "24"))
"""How many times each reader gets something damaged; `make soak` sets it."""
REFUSED = (ArtdeGymError, GainError, gym.error.Error, IsADirectoryError)
"""The last one is the operating system's, of a folder that lies where a file is to be written."""
SHORT: dict[str, Any] = {"duration": 0.2, "control_period": 0.004, "actuator_inertia": "lumped"}
FLIGHT: dict[str, Any] = {"duration": 0.3}


def evaluated(folder: Path) -> Any:
    return evaluate(["tde", "artde"], scenario="S2", episodes=2, env_kwargs=SHORT, out=folder)


def searched(folder: Path) -> Any:
    return frontier(
        ["tde"], "QuadInfinity-Payload-v0", "wind.scale", low=0, high=1, tolerance=1, episodes=1, env_kwargs=FLIGHT,
        disturbances={"wind": 1.0}, out=folder, vectorized=True,
    )  # fmt: skip


def tuned(folder: Path) -> Any:
    return tune(
        ["tde"], "QuadInfinity-Payload-v0", trials=2, episodes=1, held_out=1, env_kwargs=FLIGHT, out=folder,
        vectorized=True,
    )  # fmt: skip


SWEEP = """\
scenario: Q1
seed: 3
episodes: 2
gains: {tde: {k_p_p: 8.0}}
disturbances:
  payload: {mass: 0.2, detach_time: 0.1}
env_kwargs: {engine: mujoco, duration: 0.1}
grid:
  controller: [tde, artde]
  env_kwargs.control_period: [0.005, 0.015]
sample:
  draws: 1
  vary:
    disturbances.wind.scale: {uniform: [0.5, 1.0]}
    gains.artde.alpha_p: {log_uniform: [1, 4]}
"""


def written(folder: Path) -> None:
    folder.mkdir()
    (folder / "sweep.yaml").write_text(SWEEP)


def swept(folder: Path) -> Any:
    """The results lie beside the file; a sweep that has become a long one is cut short."""
    if not folder.exists():
        written(folder)

    def cut(what: str, update: Update) -> None:
        if what == "episodes" and update.time_s > 1.0:
            raise KeyboardInterrupt

    return sweep(folder / "sweep.yaml", folder / "results", on_progress=cut)


def reported(folder: Path) -> Any:
    text = write_report(folder).read_text()
    assert "<script>alert" not in text
    return text


READERS: dict[str, tuple[Callable[[Path], Any], Callable[[Path], Any], int]] = {
    "evaluate": (evaluated, evaluated, TRIES),
    "frontier": (searched, searched, TRIES // 4),
    "tune": (tuned, tuned, TRIES // 4),
    "sweep file": (written, swept, TRIES),
    "sweep": (swept, swept, TRIES),
    "report": (evaluated, reported, TRIES),
    "result": (evaluated, read_result, TRIES),
    "report of a frontier": (searched, reported, TRIES),
}
"""What reads -> (what makes the folder, the reader, how many times)."""


@pytest.mark.parametrize("name", READERS)
def test_a_damaged_folder_is_read_or_refused(name: str, tmp_path: Path) -> None:
    make, read, tries = READERS[name]
    make(tmp_path / "whole")
    (tmp_path / "inside").mkdir()
    marker, rng = tmp_path / "executed", random.Random(name)
    for number in range(tries):
        folder = copied(tmp_path / "whole", tmp_path / "inside" / "damaged")
        damage = [mutate(folder, rng, marker) for _ in range(rng.choice([1, 1, 2]))]
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", RuntimeWarning)  # of numbers without sense
                read(folder)
        except REFUSED:
            pass
        except Exception as error:
            raise AssertionError(f"{number}: {damage}") from error
        assert not marker.exists(), damage
        assert {path.name for path in tmp_path.iterdir()} == {"whole", "inside"}, damage
        assert [path.name for path in (tmp_path / "inside").iterdir()] == ["damaged"], damage


@pytest.mark.parametrize("name", ["../../outside", "/tmp/outside", "a/b", "..", "", "a\x00b", "a\nb", "x" * 1000])
def test_no_name_leads_out_of_the_folder(name: str, tmp_path: Path) -> None:
    """Say, that of a policy which somebody has sent: traces are files that are named by it."""
    with pytest.raises(OptionError, match="name of a controller"):
        evaluate({name: "tde"}, scenario="S2", episodes=1, env_kwargs=SHORT, out=tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_a_table_of_something_else_is_not_gone_on_with(tmp_path: Path) -> None:
    evaluated(tmp_path)
    table = tmp_path / "episodes.csv"
    good = table.read_text()
    lines = good.splitlines(keepends=True)
    for bad, words in (
        (good.replace(",artde", ",pid").replace("artde,", "pid,"), "controller 'pid'"),
        (good + lines[-1], "a duplicate episode"),
        (good.replace("False", "perhaps", 1), "column fell has values of another kind"),
    ):
        table.write_text(bad)
        with pytest.raises(StoreError, match=words):
            evaluated(tmp_path)
        assert table.read_text() == bad  # it is the user's to mend
    table.write_text("".join(lines[:-1]))
    evaluated(tmp_path)
    assert table.read_text() == good


def test_json_of_a_command_may_be_anything(tmp_path: Path) -> None:
    from artde_gym.cli.arguments import json_object

    for text in ("{", "[" * 100_000, "[]", "1", "null", '"x"', "9" * 10_000, "{'a': 1}", "\x00"):
        with pytest.raises(OptionError):
            json_object("--gains", text)
    assert json_object("--gains", json.dumps({"a": np.pi})) == {"a": np.pi}
