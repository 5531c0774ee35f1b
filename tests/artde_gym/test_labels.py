"""Words are words, and numbers are exact, in every table that the project reads back."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from artde_gym.errors import OptionError
from artde_gym.evaluation import evaluate
from artde_gym.evaluation.store import parse_table
from artde_gym.report import write_report
from artde_gym.report.frontier_page import read_frontier
from artde_gym.studies import frontier

QUADROTOR = "QuadInfinity-Payload-v0"
FLIGHT: dict[str, Any] = {"duration": 0.3}
LABELS = ["1", "1.0", "NA", "nan", "null", "None", "true", "False", "inf", "-", "007", "#N", " x"]


def test_a_folder_of_odd_labels_is_read_and_gone_on_with(tmp_path):
    def run(episodes: int) -> pd.DataFrame:
        named = dict.fromkeys(LABELS, "tde")
        result = evaluate(
            named, QUADROTOR, disturbances={}, env_kwargs=FLIGHT, vectorized=True, episodes=episodes, out=tmp_path
        )
        return result.episodes

    first = run(1)
    assert first["controller"].tolist() == LABELS
    pd.testing.assert_frame_equal(run(1), first, check_exact=True, check_dtype=False)
    text = write_report(tmp_path).read_text()
    assert ">null<" in text


def test_a_frontier_of_odd_labels_is_read(tmp_path):
    labels = ["1", "NA", "true"]
    found = frontier(
        dict.fromkeys(labels, "tde"), QUADROTOR, "wind.scale", low=0, high=1, tolerance=1, episodes=1,
        env_kwargs=FLIGHT, disturbances={"wind": 1.0}, out=tmp_path, vectorized=True,
    )  # fmt: skip
    read, _ = read_frontier(tmp_path)
    assert read.table["controller"].tolist() == labels
    assert sorted(set(read.levels["controller"])) == labels
    pd.testing.assert_frame_equal(read.table, found.table, check_exact=True, check_dtype=False)
    write_report(tmp_path)


words = st.text(st.characters(codec="utf-8", exclude_characters="\r\n\0"), max_size=8) | st.sampled_from(LABELS)
numbers = st.floats() | st.sampled_from([0.1 + 0.2, 1 / 3, math.inf, -0.0, 5e-324])


@given(st.lists(st.tuples(words, numbers, st.booleans(), st.integers(0, 2**63 - 1)), min_size=1, max_size=20))
def test_words_are_words_and_numbers_exact(rows):
    wanted = pd.DataFrame(rows, columns=["word", "number", "switch", "whole"])
    found = parse_table(wanted.to_csv(index=False), ["word"])
    assert found["word"].tolist() == wanted["word"].tolist()
    np.testing.assert_array_equal(found["number"], wanted["number"])
    assert found["switch"].dtype == bool
    assert found["switch"].tolist() == wanted["switch"].tolist()
    assert found["whole"].tolist() == wanted["whole"].tolist()


def test_numbers_of_seventeen_digits_come_back_to_the_last_bit():
    values = np.random.default_rng(0).normal(size=10_000)
    found = parse_table("x\n" + "\n".join(map(repr, values.tolist())) + "\n", [])
    np.testing.assert_array_equal(found["x"], values)


@pytest.mark.parametrize("name", ["é" * 101, "é" * 100 + "x", "語" * 90, "\U0001f916" * 60])
def test_a_name_longer_than_a_files_in_bytes_is_refused_at_once(name, tmp_path):
    with pytest.raises(OptionError, match="name of a controller"):
        evaluate({name: "tde"}, scenario="Q1", env_kwargs=FLIGHT, out=tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_the_longest_name_makes_files(tmp_path):
    name = "語" * 66
    evaluate({name: "tde"}, scenario="Q1", episodes=1, env_kwargs=FLIGHT, out=tmp_path)
    assert (tmp_path / "traces" / "Q1" / f"{name}-0.npz").exists()
