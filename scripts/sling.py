"""The flights with a load on a cable behind docs/results.md: laws over masses, cables and seeds, all in one vector.

python scripts/sling.py known      0.1, 0.35, 0.5 kg on 0.3, 0.5, 1.0 m
python scripts/sling.py held-out   0.2, 0.45, 0.6 kg on 0.4, 0.75, 1.2 m: nothing was chosen by these
python scripts/sling.py late       known, the cable measured 60 ms late

Each flight is that of scenario Q-sling but for mass and cable: wind, a kick of 0.8 m/s on the load at 20 s, its release
at 35 s, the end at 45 s. A law that takes the load's mass is told it.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium as gym
import numpy as np
import pandas as pd

import controllers
from artde_gym.evaluation import statistics
from artde_gym.evaluation.seeds import episode_seed
from artde_gym.evaluation.side_by_side import SideBySide
from artde_gym.evaluation.vector_rollout import run_vector
from artde_gym.robots.q450.kit import kick
from artde_gym.scenarios import SCENARIOS

KNOWN = ((0.1, 0.35, 0.5), (0.3, 0.5, 1.0))  # kg, m
HELD_OUT = ((0.2, 0.45, 0.6), (0.4, 0.75, 1.2))
FIGURES: dict[str, tuple[Any, Mapping[str, Any]]] = {
    "known": (KNOWN, {}),
    "held-out": (HELD_OUT, {}),
    "late": (KNOWN, {"cable_delay": {"steps": 4}}),
}
LAWS: dict[str, tuple[str, dict[str, Any]]] = {
    "TDE, thesis": ("tde", {}),
    "ATDE, thesis": ("atde", {}),
    "ARTDE, thesis": ("artde", {}),
    "TDE, tuned": ("tde", {"preset": "tuned"}),
    "geometric, tuned": ("geometric", {"preset": "tuned"}),
    "TDE + swing": ("tde+swing", {}),
    "ATDE + swing": ("atde+swing", {}),
    "ARTDE + swing": ("artde+swing", {}),
    "TDE + swing, m_bar 1.6": ("tde+swing", {"preset": "slung"}),
    "TDE + swing, stiff": ("tde+swing", {"preset": "slung", "k_p_p": 20.0, "k_d_p": 7.0}),
    "TDE + swing, PPO": ("tde+ppo", {}),
    "TDE + swing, tuned": ("tde+swing", {"preset": "tuned"}),
    "geometric, of the load": ("geometric-load", {}),
    "geometric, of the load, tuned": ("geometric-load", {"preset": "tuned"}),
}
COLUMNS = {
    "rmse_m": ("vehicle mm", 1e3, 1),
    "rms_load_error_m": ("load mm", 1e3, 1),
    "rms_swing_deg": ("swing deg", 1.0, 2),
    "peak_swing_deg_push0": ("after kick deg", 1.0, 1),
    "max_cable_impulse_ns": ("impulse Ns", 1.0, 3),
    "peak_error_m_drop": ("after release mm", 1e3, 0),
}
SETTLED = "recovery_time_s_push0_swing"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("figure", choices=FIGURES)
    parser.add_argument("--seeds", type=int, default=8, help="of each mass and cable")
    parser.add_argument("--seed", type=int, default=0, help="from which those are derived")
    parser.add_argument("--laws", nargs="+", default=list(LAWS))
    options = parser.parse_args()
    (masses, cables), more = FIGURES[options.figure]
    cells = [(mass, cable) for mass in masses for cable in cables]
    found = flights(options.laws, cells, options.seeds, options.seed, more)
    titles = [title for title, _, _ in COLUMNS.values()]
    print("| law | flown | " + " | ".join([*titles, "settled", "settles s", "load below the first law's, %"]) + " |")
    print("|---|" + "---|" * (len(titles) + 4))
    size = len(cells) * options.seeds
    parts = [found.iloc[at : at + size].reset_index(drop=True) for at in range(0, len(found), size)]
    for label, part in zip(options.laws, parts, strict=True):
        print(row(label, part, parts[0]))


def flights(
    labels: Sequence[str], cells: Sequence[tuple[float, float]], seeds: int, seed: int, more: Mapping[str, Any]
) -> pd.DataFrame:
    """One row a flight: law by law, mass and cable by mass and cable, all in one vector."""
    disturbances = [{**scenario(mass, cable), **more} for mass, cable in cells for _ in range(seeds)] * len(labels)
    made = gym.make_vec(
        "QuadSling-Payload-v0", len(disturbances), "vector_entry_point", engine="numpy", duration=45.0,
        disturbances={}, autoreset_mode="Disabled",
    )  # fmt: skip
    env: Any = made.unwrapped
    policies = [policy for label in labels for mass, _ in cells for policy in [policy_of(label, env, mass)] * seeds]
    kinds = [label for label in labels for _ in range(len(cells) * seeds)]
    numbers = [episode_seed(seed, number) for number in range(seeds)] * (len(cells) * len(labels))
    options = {"disturbances": disturbances}
    together = SideBySide(policies, kinds, env.action_layout.size)
    return pd.DataFrame([episode.row for episode in run_vector(env, together, numbers, options=options)])


def policy_of(label: str, env: Any, mass: float) -> Any:
    """Build the policy of a law; one that takes the load's mass is told it."""
    name, gains = LAWS[label]
    told = {"load_mass_p": mass} if name == "geometric-load" else {}
    return controllers.make(name, env, **gains, **told)


def scenario(mass: float, cable: float) -> dict[str, Any]:
    """Disturbances of Q-sling with another load."""
    given = dict(SCENARIOS["Q-sling"].disturbances)
    payload = {**given["payload"], "mass": {"uniform": [0.95 * mass, 1.05 * mass]}, "cable": cable}
    return {**given, "payload": payload, "push": [kick(mass)]}


def row(label: str, found: pd.DataFrame, first: pd.DataFrame) -> str:
    """Return a law's row: means of the flights that end, with intervals; the median settling time, never included.

    The last cell compares load errors with the first law's, flight by flight, where both end.
    """
    whole = found[~found["fell"]]
    cells = [label, f"{len(whole)}/{len(found)}"]
    for column, (_, scale, digits) in COLUMNS.items():
        estimate = statistics.mean(scale * whole[column])
        cells.append(f"{estimate.value:.{digits}f} ({estimate.low:.{digits}f}..{estimate.high:.{digits}f})")
    settled = whole[SETTLED]
    middle = statistics.median(settled)
    cells.append(f"{int(np.isfinite(settled).sum())}/{len(whole)}")
    cells.append(f"{middle.value:.1f} ({middle.low:.1f}..{middle.high:.1f})" if len(whole) else "")
    both = ~(found["fell"] | first["fell"]).astype(bool)
    gain = statistics.improvement(found.loc[both, "rms_load_error_m"], first.loc[both, "rms_load_error_m"])
    cells.append(f"{gain.value:.1f} ({gain.low:.1f}..{gain.high:.1f})" if found is not first else "")
    return "| " + " | ".join(cells).replace("inf", "never") + " |"


if __name__ == "__main__":
    main()
