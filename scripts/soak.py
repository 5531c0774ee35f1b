"""Long versions of the tests, for hours: walks, short episodes, environments, damaged files, random calls, kills.

make soak                                   everything, some hours
make soak ARGS="walks --seconds 600"        one part
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from artde_gym.benchmark import endurance
from artde_gym.benchmark.environments import ENGINES
from artde_gym.benchmark.figure import Figure
from artde_gym.benchmark.page import written

ROOT = Path(__file__).parents[1]
FUZZ = ("tests/artde_gym/test_properties.py", "tests/artde_gym/test_damaged_files.py",
        "tests/baselines/test_damaged_runs.py")  # fmt: skip
PARTS = ("walks", "episodes", "environments", "replacements", "fuzz", "kills")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", choices=[*PARTS, []], default=[], help="default: all")
    parser.add_argument("--seconds", type=float, default=3600.0, help="of simulated walking, in each engine")
    parser.add_argument("--episodes", type=int, default=10_000, help="short episodes in one process")
    parser.add_argument("--environments", type=int, default=1200, help="made one after the other")
    parser.add_argument("--replacements", type=int, default=1200, help="of environments that are open beside others")
    parser.add_argument("--examples", type=int, default=2000, help="that each test of `fuzz` tries")
    options = parser.parse_args()
    parts = options.parts or PARTS
    good = True
    if "walks" in parts:
        for engine in ENGINES:
            good &= shown(endurance.walking(engine, options.seconds, print))
    if "episodes" in parts:
        good &= shown(endurance.starting(options.episodes, print))
    if "environments" in parts:
        good &= shown(endurance.making(options.environments, print))
    if "replacements" in parts:
        good &= shown(endurance.replacing(options.replacements, print))
    if "fuzz" in parts:
        fuzz = [sys.executable, "-m", "pytest", "-q", "-n", str(os.cpu_count()), *FUZZ]
        good &= ran(fuzz, EXAMPLES=str(options.examples))
    if "kills" in parts:
        with tempfile.TemporaryDirectory() as folder:
            campaign = ["scripts/sweep_faults.py", "--episodes", "200", "--kills", "50", "--out"]
            good &= ran([sys.executable, *campaign, f"{folder}/sweep"])
    print("all held" if good else "something did not hold")
    sys.exit(0 if good else 1)


def shown(figures: tuple[Figure, ...]) -> bool:
    for figure in figures:
        unit = "" if figure.unit == "1" else f" {figure.unit}"
        verdict = "held" if figure.met else "NOT HELD"
        print(f"{figure.what}: {written(figure.value)}{unit} ({figure.target}: {verdict})", flush=True)
    return all(figure.met for figure in figures)


def ran(command: list[str], **environment: str) -> bool:
    return subprocess.run(command, cwd=ROOT, env={**os.environ, **environment}, check=False).returncode == 0


if __name__ == "__main__":
    main()
