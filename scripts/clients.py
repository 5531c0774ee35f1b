"""Run the tests of learning libraries, each group of libraries in an environment of its own below .venv-clients.

python scripts/clients.py            # all groups
python scripts/clients.py tianshou   # some of them
"""

from __future__ import annotations

import os
import subprocess
import sys
import venv
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / ".venv-clients"
TESTS = ("pytest", "hypothesis", "websocket-client")  # of tests/conftest.py


class Group(NamedTuple):
    """Libraries that can be installed together, and the files in tests/clients that need them."""

    packages: tuple[str, ...]
    tests: tuple[str, ...]
    free: tuple[str, ...] = ()  # packages of constraints.txt that they need in other versions


GROUPS = {
    "pinned": Group(
        (".[mujoco,rl]", "sb3-contrib", "torchrl", "minari[create,hdf5]"),
        ("stable_baselines", "cleanrl", "torchrl", "minari"),
    ),
    "tianshou": Group((".[mujoco,rl]", "tianshou>=2"), ("tianshou",), free=("filelock",)),
    "rllib": Group((".[mujoco]", "ray[rllib]", "torch"), ("rllib",), free=("gymnasium",)),
    "jax": Group((".", "jax"), ("jax",)),  # no learning library: the laws run on its arrays
}


def constraints(group: Group) -> str:
    """Releases that the tests run with, but for those that the group's libraries do not take."""
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    return "\n".join(line for line in lines if line.split("==")[0].lower() not in group.free) + "\n"


def install(name: str, group: Group) -> Path:
    """Make the environment, unless it is there; returns its Python."""
    folder = FOLDER / name
    python, finished = folder / "bin" / "python", folder / "installed"
    if not finished.exists():
        print(f"artde-gym: installing {', '.join(group.packages)} into {folder}", flush=True)
        venv.create(folder, clear=True, with_pip=True)
        pins = folder / "constraints.txt"
        pins.write_text(constraints(group))
        command = [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--constraint", pins]
        subprocess.run([*command, "--editable", *group.packages, *TESTS], cwd=ROOT, check=True)
        finished.touch()
    return python


def main(names: list[str]) -> int:
    if unknown := [name for name in names if name not in GROUPS]:
        print(f"artde-gym: no group {', '.join(unknown)}; there are {', '.join(GROUPS)}", file=sys.stderr)
        return 2
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    codes = []
    for name in names or GROUPS:
        group = GROUPS[name]
        files = [f"tests/clients/test_{test}.py" for test in group.tests]
        command = [install(name, group), "-m", "pytest", "-q", "-m", "clients", *files]
        codes.append(subprocess.run(command, cwd=ROOT, env=environment, check=False).returncode)
    return max(codes)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
