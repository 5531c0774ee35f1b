"""A result names what it holds where it is asked for something else, and resumes a table of no finished row."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from artde_gym.errors import UnknownNameError
from artde_gym.evaluation import evaluate
from artde_gym.evaluation.result import Result

PUSH = {"push": [{"magnitude": 1.0, "start": 0.01, "duration": 0.01}]}


def flights(out: Path | None = None) -> Result:
    plan = {"duration": 0.1}
    return evaluate(["tde", "pid"], "QuadInfinity-Payload-v0", env_kwargs=plan, disturbances=PUSH, episodes=2, out=out)


@pytest.fixture(scope="module")
def result() -> Result:
    return flights()


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (lambda found: found.falls("S9", "tde"), "scenario is 'S9'; allowed: custom"),
        (lambda found: found.falls("custom", "tdee"), "did you mean 'tde'"),
        (lambda found: found.rows("custom", "zzz"), "controller is 'zzz'; allowed: pid, tde"),
        (lambda found: found.values("custom", "tde", "rmse_x"), "metric is 'rmse_x'; allowed: .*did you mean 'rmse_"),
        (lambda found: found.values("custom", "tde", "fall_reason"), "metric is 'fall_reason'"),
        (lambda found: found.recovery("custom", "tde", "push1"), "event is 'push1'; allowed: push0"),
        (lambda found: found.pairs("custom", "tde", "pid", "zzz"), "metric is 'zzz'"),
        (lambda found: found.pairs("custom", "tde", "zzz", "rmse_m"), "controller is 'zzz'"),
        (lambda found: found.compare("tde", "zzz"), "controller is 'zzz'"),
        (lambda _: Result(flights().episodes.iloc[:0]).falls("custom", "tde"), "no episode"),
    ],
)
def test_all_methods_name_what_is_allowed(result: Result, ask: Callable[[Result], object], said: str) -> None:
    with pytest.raises(UnknownNameError, match=said):
        ask(result)


@pytest.mark.parametrize("kept", [0.0, 0.5])
def test_a_table_that_is_torn_in_its_first_row_is_resumed(kept: float, tmp_path: Path) -> None:
    flights(tmp_path)
    table = tmp_path / "episodes.csv"
    whole = table.read_text()
    header, first, *_ = whole.splitlines(keepends=True)
    table.write_text(header + first[: int(kept * len(first))])
    flights(tmp_path)
    assert table.read_text() == whole
