"""Sweep files from outside: what cells they make, which draws, and what they refuse."""

from __future__ import annotations

import contextlib
import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from artde_gym.errors import ArtdeGymError, OptionError, UnknownNameError
from artde_gym.scenarios import SCENARIOS
from artde_gym.studies.sweep.design import SETTINGS, design, read

pytest.importorskip("yaml", reason="pyyaml is not installed (extra sweep)")

SMALL: dict[str, Any] = {"scenario": "Q1", "controller": "tde"}


def test_a_grid_has_every_combination_in_order():
    grid = {"scenario": ["S1", "S2"], "controller": ["tde", "artde"], "env_kwargs.speed": [0.1, 0.2]}
    found = design({"grid": grid, "episodes": 3, "env_kwargs": {"duration": 2.0}})
    cells = [(point.cell.name, point.controller, point.cell.kwargs["speed"]) for point in found.points]
    assert cells == [(s, c, v) for s in ("S1", "S2") for c in ("tde", "artde") for v in (0.1, 0.2)]
    assert found.episodes == 3
    assert {point.cell.kwargs["duration"] for point in found.points} == {2.0}
    assert len({point.id for point in found.points}) == 8


def test_gains_of_other_controllers_make_no_cells_of_their_own():
    grid = {"controller": ["tde", "artde"], "gains.artde.gamma_0": [100, 200, 400]}
    points = design({**SMALL, "grid": grid, "gains": {"tde": {"k_p": 9.0}}}).points
    assert [(point.controller, point.gains) for point in points] == [
        ("tde", {"k_p": 9.0}),
        ("artde", {"gamma_0": 100}),
        ("artde", {"gamma_0": 200}),
        ("artde", {"gamma_0": 400}),
    ]


def test_a_disturbance_changes_one_value_of_those_that_are_there():
    point = design({"scenario": "S2", "controller": "tde", "grid": {"disturbances.payload.mass": [2.5]}}).points[0]
    expected = json.loads(json.dumps(dict(SCENARIOS["S2"].disturbances)))
    expected["payload"]["mass"] = 2.5
    assert json.loads(json.dumps(point.cell.kwargs["disturbances"])) == expected
    assert SCENARIOS["S2"].disturbances["payload"]["mass"] == 1.3
    whole = design({**SMALL, "grid": {"disturbances": [{}, {"wind": 1.0}], "disturbances.wind.scale": [3]}}).points
    assert [point.cell.kwargs["disturbances"] for point in whole] == [{"wind": {"scale": 3}}]  # both come out the same
    with pytest.raises(OptionError, match="needs a scenario"):
        design({"controller": "tde", "grid": {"disturbances.payload.mass": [1]}})


SAMPLE = {"gains.tde.k_p": {"log_uniform": [1, 100]}, "disturbances.wind.scale": {"uniform": [0, 2]}}


def test_draws_stay_when_there_are_more_of_them_or_more_paths():
    def drawn(count: int, vary: Any, **more: Any) -> list[tuple[Any, Any]]:
        points = design({**SMALL, "sample": {"draws": count, "vary": vary}, **more}).points
        return [(point.gains["k_p"], point.cell.kwargs["disturbances"]["wind"]["scale"]) for point in points]

    few = drawn(5, SAMPLE)
    assert drawn(9, SAMPLE)[:5] == few
    assert drawn(5, {"env_kwargs.duration": {"choice": [1.0, 2.0]}, **SAMPLE}) == few
    assert drawn(5, SAMPLE, seed=1) != few
    assert len({gain for gain, _ in few}) == 5


def test_every_combination_of_the_grid_meets_the_same_draws():
    points = design({**SMALL, "grid": {"controller": ["tde", "pid"]}, "sample": {"draws": 4, "vary": SAMPLE}}).points
    winds = [point.cell.kwargs["disturbances"]["wind"]["scale"] for point in points]
    assert len(points) == 8
    assert winds[:4] == winds[4:]


@pytest.mark.parametrize(
    ("distribution", "holds"),
    [
        ({"uniform": [2, 5]}, lambda x: 2 <= x <= 5),
        ({"log_uniform": [1e-3, 1e3]}, lambda x: 1e-3 <= x <= 1e3),
        ({"integers": [1, 3]}, lambda x: x in (1, 2, 3) and isinstance(x, int)),
        ({"normal": [10, 0.1]}, lambda x: abs(x - 10) < 1),
        ({"choice": ["rotor", "lumped"]}, lambda x: x in ("rotor", "lumped")),
    ],
)
def test_draws_follow_their_distribution(distribution, holds):
    vary = {"env_kwargs.x": distribution}
    drawn = [point.cell.kwargs["x"] for point in design({**SMALL, "sample": {"draws": 200, "vary": vary}}).points]
    assert all(map(holds, drawn))
    if "log_uniform" in distribution:
        assert 60 < sum(value < 1 for value in drawn) < 140  # half of them below the geometric middle
    if "integers" in distribution or "choice" in distribution:
        assert len(set(drawn)) == len(drawn) == len(next(iter(distribution.values()))) + ("integers" in distribution)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("scenario", "Q1-gale"),
        ("controller", "artde"),
        ("gains", {"tde": {"k_p": 2.0}}),
        ("disturbances", {"wind": 1.0}),
        ("env_kwargs", {"duration": 3.0}),
        ("seed", 1),
        ("vectorized", True),
    ],
)
def test_whatever_decides_about_an_episode_decides_about_its_cell(name, value):
    assert design({**SMALL, name: value}).points[0].id != design(SMALL).points[0].id
    assert design({**SMALL, "episodes": 7}).points[0].id == design(SMALL).points[0].id


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        ({"scenaro": "S1"}, OptionError, ["scenaro", "did you mean 'scenario'"]),
        ({"scenario": "S9"}, UnknownNameError, ["S9", "S1-L4"]),
        ({"scenario": ["Q1"]}, OptionError, ["scenario", "Q1", "a name"]),
        ({"env": "BipedPush-v0"}, OptionError, ["BipedPush-v0", "QuadInfinity"]),
        ({"controller": "tdee"}, UnknownNameError, ["tdee", "did you mean 'tde'"]),
        ({"controller": None}, UnknownNameError, ["controller", "None"]),
        ({"episodes": 0}, OptionError, ["episodes", "0"]),
        ({"episodes": True}, OptionError, ["episodes", "True"]),
        ({"seed": -1}, OptionError, ["seed", "-1"]),
        ({"vectorized": "both"}, OptionError, ["vectorized", "both"]),
        ({"gains": {"atde": {"k_p": 1.0}}}, UnknownNameError, ["gains", "atde"]),
        ({"gains": {"tde": 3}}, OptionError, ["gains", "mapping"]),
        ({"disturbances": 3}, OptionError, ["disturbances", "3"]),
        ({"env_kwargs": {"disturbances": {}}}, OptionError, ["env_kwargs", "disturbances"]),
        ({"env_kwargs": {"duration": float("nan")}}, OptionError, ["env_kwargs: duration", "nan", "finite"]),
        ({"grid": []}, OptionError, ["grid", "mapping"]),
        ({"grid": {"controller": []}}, OptionError, ["grid: controller", "at least one"]),
        ({"grid": {"controller": "tde"}}, OptionError, ["grid: controller", "list"]),
        ({"grid": {"gain.tde.k_p": [1]}}, UnknownNameError, ["gain.tde.k_p", "gains.<controller>.<gain>"]),
        ({"grid": {"gains.k_p": [1]}}, UnknownNameError, ["gains.k_p"]),
        ({"grid": {"disturbances.storm.scale": [1]}}, UnknownNameError, ["storm", "wind"]),
        ({"grid": {"disturbances.wind.skale": [1]}}, UnknownNameError, ["skale", "did you mean 'scale'"]),
        ({"grid": {"disturbances.push.magnitude": [1]}}, OptionError, ["no 'push' to vary"]),
        ({"grid": {"seed": ["x"]}}, OptionError, ["seed", "'x'"]),
        ({"grid": {"controller": ["tde", {}]}}, OptionError, ["controller", "a name"]),
        ({"sample": {"draws": 1, "vary": {"controller": {"choice": [[]]}}}}, OptionError, ["controller", "a name"]),
        ({"grid": {f"env_kwargs.{i}": [1, 2] for i in range(40)}}, OptionError, [str(2**40), "cells"]),
        ({"episodes": 2_000_000, "grid": {"seed": [0, 1]}}, OptionError, ["4000000 episodes"]),
        ({"sample": {"draws": 3}}, OptionError, ["sample", "vary"]),
        ({"sample": {"draws": 0, "vary": {}}}, OptionError, ["sample: draws", "0"]),
        ({"sample": {"draws": 1, "vary": {"seed": 3}}}, OptionError, ["sample: seed", "uniform"]),
        ({"sample": {"draws": 1, "vary": {"seed": {"uniform": [2, 1]}}}}, OptionError, ["the lower first"]),
        ({"sample": {"draws": 1, "vary": {"seed": {"log_uniform": [0, 1]}}}}, OptionError, ["above zero"]),
        ({"sample": {"draws": 1, "vary": {"seed": {"integers": [0, 1.5]}}}}, OptionError, ["whole"]),
        ({"sample": {"draws": 1, "vary": {"seed": {"choice": []}}}}, OptionError, ["at least one"]),
        (
            {"grid": {"seed": [0]}, "sample": {"draws": 1, "vary": {"seed": {"choice": [1]}}}},
            OptionError,
            ["in the grid and in the sample"],
        ),
    ],
)
def test_what_is_wrong_is_named(change, error, words):
    with pytest.raises(error) as caught:
        design({**SMALL, **change})
    for word in words:
        assert word in str(caught.value)


def file(folder: Path, text: str | bytes) -> Path:
    path = folder / "sweep.yaml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def test_numbers_may_be_written_as_yaml_1_2_does(tmp_path):
    assert read(file(tmp_path, "a: [1e-3, 5E2, .5e1, -2e0]\nb: 1e5x")) == {"a": [1e-3, 500.0, 5.0, -2.0], "b": "1e5x"}


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1:30", "1:30"), ("1:30.5", "1:30.5"), ("010", 10), ("-010", -10), ("0o10", 8), ("0x1F", 31), ("0b11", "0b11"),
        ("1_000", "1_000"), ("yes", "yes"), ("No", "No"), ("on", "on"), ("OFF", "OFF"), ("y", "y"), ("true", True),
        ("False", False), ("tRUE", "tRUE"), ("~", None), ("", None), ("NULL", None), ("2020-01-01", "2020-01-01"),
        ("1.", 1.0), (".5", 0.5), ("+3", 3), ("1e3", 1000.0), ("-.INF", float("-inf")), ("=", "="), ("'1'", "1"),
        ("1.5.2", "1.5.2"), ("0o8", "0o8"), ("e3", "e3"), (".", "."), ("-", [None]),
    ],
)  # fmt: skip
def test_values_are_those_of_yaml_1_2(tmp_path, text, value):
    found = read(file(tmp_path, f"a:\n  {text}"))["a"]
    assert (found, type(found)) == (value, type(value))


def test_keys_are_words_as_they_stand(tmp_path):
    assert read(file(tmp_path, "on: 1\nyes: 2\n<<: 3")) == {"on": 1, "yes": 2, "<<": 3}


def test_a_file_without_an_end_is_not_read_to_it():
    with pytest.raises(OptionError, match="bytes"):
        read("/dev/zero")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("controller: !!python/object/apply:os.system ['touch owned']", "python/object"),
        ("controller: tde\ncontroller: pid", "'controller' is given 2 times"),
        ("grid: {a.b: [1], a.b: [2]}", "'a.b' is given 2 times"),
        ("a: &x [1]\nb: *x", "alias"),
        ("- tde", "a mapping"),
        ("", "a mapping"),
        ("a: [", "readable YAML"),
        (b"\xff\xfe\x00", "readable YAML"),
        ("[" * 5000, "readable YAML"),
        ("a: !!timestamp 0001-99-99", "readable YAML"),
        ("a: !!int 1:30", "readable YAML"),
        ("#" * (1 << 21), "bytes"),
    ],
)
def test_files_that_are_no_sweeps_are_refused_and_nothing_in_them_runs(tmp_path, monkeypatch, text, words):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(OptionError, match=words):
        read(file(tmp_path, text))
    assert [path.name for path in tmp_path.iterdir()] == ["sweep.yaml"]


@pytest.mark.parametrize("text", ["a: 2020-01-01", "a: !!binary aGk=", "a: !!set {x}", "1: a", "a: .inf"])
def test_values_that_json_cannot_write_are_refused(tmp_path, text):
    with pytest.raises(OptionError):
        design(read(file(tmp_path, text)))


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(OptionError, match=r"none\.yaml"):
        read(tmp_path / "none.yaml")


WORDS = st.sampled_from(
    [*SETTINGS, "episodes", "grid", "sample", "draws", "vary", "uniform", "choice", "tde", "Q1", "wind"]
)
PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | WORDS | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(WORDS, inner, max_size=3),
    max_leaves=12,
)


@settings(max_examples=300)
@given(st.dictionaries(WORDS, PLAIN, max_size=5))
def test_any_mapping_is_a_design_or_one_of_our_errors(given):
    with contextlib.suppress(ArtdeGymError):
        assert design(given).points


@settings(max_examples=200)
@given(st.text(alphabet="abc:-[]{}&*!|>'\"#%@` \n\t0123.e", max_size=60) | st.binary(max_size=60))
def test_any_bytes_are_a_mapping_or_one_of_our_errors(tmp_path_factory, data):
    with contextlib.suppress(ArtdeGymError):
        assert isinstance(read(file(tmp_path_factory.getbasetemp(), data)), dict)
