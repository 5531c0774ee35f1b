"""What each process of a study imports before it begins: nothing that is heavy and only some need."""

from __future__ import annotations

import subprocess
import sys

HEAVY = (
    "controllers.law_table",
    "matplotlib",
    "optuna",
    "pyarrow.parquet",
    "ray",
    "scipy.stats",
    "stable_baselines3",
    "torch",
)


def test_workers_and_the_command_line_begin_without_what_only_some_need() -> None:
    code = "import sys, artde_gym.evaluation.workers, artde_gym.cli\n"
    code += f"print([name for name in {HEAVY} if name in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"
