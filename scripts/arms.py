"""Public arms in scenarios A1 to A4 at designed gains, untouched: the table behind docs/tutorials/own-arm.md.

python scripts/arms.py                           the arms of PyBullet and of example-robot-data that are installed
python scripts/arms.py my_arm.urdf other.urdf    your own
python scripts/arms.py --armature file           at the rotor inertia of the files, which most of them lack

Files are read where their packages have them; nothing is copied. Cells are the tool's RMS error (mm), the mean of the
episodes; those that end early are counted behind it, with the joints' limit that they met. Of an arm that cannot be
simulated, the error takes the place of the row.
"""

from __future__ import annotations

import argparse
import importlib.util
import sys
import warnings
from collections import Counter
from pathlib import Path
from typing import Any

from artde_gym.errors import ArtdeGymError
from artde_gym.evaluation import evaluate

SCENARIOS = ("A1", "A2", "A3", "A4")
PYBULLET = {
    "iiwa (PyBullet)": ("kuka_iiwa/model.urdf", None),
    "Panda (PyBullet)": ("franka_panda/panda.urdf", None),
}
PUBLIC = {
    "UR5": ("ur_description/urdf/ur5_robot.urdf", None),
    "UR10": ("ur_description/urdf/ur10_robot.urdf", None),
    "Jaco": ("kinova_description/robots/kinova.urdf", None),
    "xArm 7": ("xarm_description/urdf/xarm7.urdf", None),
    "Panda": ("panda_description/urdf/panda.urdf", None),
    "Talos, arm": ("talos_data/robots/talos_left_arm.urdf", None),  # with a sensor that is a point mass
    "Talos, whole": ("talos_data/robots/talos_full_v2.urdf", "arm_left_7_link"),
    "Tiago": ("tiago_description/robots/tiago_no_hand.urdf", "arm_7_link"),
}
"""Files of arms in the folders of `roots`, and the tips of those that branch."""


def roots() -> dict[str, list[Path]]:
    """Return the folders in which the files of `PYBULLET` and `PUBLIC` may be."""
    found = importlib.util.find_spec("pybullet_data")
    data = Path("cmeel.prefix", "share", "example-robot-data", "robots")
    return {
        "pybullet": [Path(found.origin).parent] if found is not None and found.origin is not None else [],
        "public": [Path(root) / data for root in sys.path],
    }


def installed() -> dict[str, tuple[Path, str | None]]:
    """Return the files that are here, and their tips, by name of the arm."""
    here: dict[str, tuple[Path, str | None]] = {}
    for folders, arms in zip(roots().values(), (PYBULLET, PUBLIC), strict=True):
        for name, (file, tip) in arms.items():
            path = next((folder / file for folder in folders if (folder / file).is_file()), None)
            if path is not None:
                here[name] = path, tip
    return here


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="*", type=Path, help="URDF or MJCF; default: the public ones that are installed")
    parser.add_argument("--armature", default="0.1", help="kg m^2 of each joint, or 'file' for the file's own")
    parser.add_argument("--law", default="tde")
    parser.add_argument("--episodes", type=int, default=1, help="of each scenario")
    parser.add_argument("--seed", type=int, default=31)
    options = parser.parse_args()
    arms = {file.stem: (file, None) for file in options.files} or installed()
    if not arms:
        parser.error("no public arms here: pip install example-robot-data, or name a file")
    print("| arm | " + " | ".join(SCENARIOS) + " |")
    print("|---|" + "---|" * len(SCENARIOS), flush=True)
    for name, (file, tip) in arms.items():
        kwargs: dict[str, Any] = {"robot": str(file), "engine": "mujoco"}
        if tip is not None:
            kwargs["tip"] = tip
        if options.armature != "file":
            kwargs["armature"] = float(options.armature)
        print(f"| {name} | {row(kwargs, options.law, options.episodes, options.seed)} |", flush=True)


def row(kwargs: dict[str, Any], law: str, episodes: int, seed: int) -> str:
    """Return the cells of an arm, or the error that it cannot be simulated with."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of rotor inertia that is missing: the option says so
            found = evaluate([law], scenario=SCENARIOS, episodes=episodes, seed=seed, env_kwargs=kwargs)
    except ArtdeGymError as error:
        return f"*{error}*" + " |" * (len(SCENARIOS) - 1)
    return " | ".join(cell(found.episodes[found.episodes["scenario"] == name]) for name in SCENARIOS)


def cell(rows: Any) -> str:
    """Return the mean error of a scenario's episodes (mm), and how many ended early by which limit."""
    text = f"{rows['rmse_mm'].mean():.2g}"
    fell = rows[rows["fell"]]
    return (
        text if fell.empty else f"{text} ({', '.join(f'{n} {why}' for why, n in Counter(fell['fall_reason']).items())})"
    )


if __name__ == "__main__":
    main()
