"""The walks behind docs/laws/switched.md: laws that switch with the support phase against laws that do not.

python scripts/switching.py held-out   gaits, frictions and payloads by which nothing was chosen; S1 to S3, 1 and 4 ms,
                                       without and with the ground force, under TDE, ATDE and ARTDE
python scripts/switching.py tables     the tables of what there is of that
python scripts/switching.py flags      S1-L4 and S2-L4 with contact flags that lie
python scripts/switching.py cost       computing time of a call

All in MuJoCo, in vector environments and one process; walks of 20 s. A world is a gait, a friction and a payload, with
one walk under each law. A part that is in the folder already is not run again.
"""

from __future__ import annotations

import argparse
import itertools
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pandas as pd

import controllers
from artde_gym.evaluation import statistics
from artde_gym.evaluation.seeds import episode_seed
from artde_gym.evaluation.side_by_side import SideBySide
from artde_gym.evaluation.vector_rollout import run_vector
from artde_gym.files import write_atomically
from artde_gym.robots.ojas.task import ACTION, OBSERVATION
from artde_gym.scenarios import SCENARIOS
from controllers.drive import DRIVES

GAITS = ((0.06, 1.3), (0.14, 0.8), (0.06, 0.8), (0.14, 1.3))  # m/s, s a step; the gains are those of 0.1 m/s and 1 s
GROUNDS = ((0.55, 0.8), (1.0, 1.9))  # friction, payload in kg; the prototype knew 0.7 to 0.9 and 1.3 kg
FORMS = ("S1", "S2", "S3")
SHARES = (0, 45, 33)  # ground force, % of the weight
PARTS = [(4, share, gait) for share in SHARES for gait in range(len(GAITS))]
PARTS += [(1, share, gait) for gait in (1, 0) for share in SHARES]
"""L in ms, ground force, number of the gait, in the order in which they are run."""
DURATION, PUSHES = 20.0, (8.0, 13.0)  # s; of S3, which has them at 28 and 37 s
SEED = 1919
FEW = 5  # worlds, below which an interval says nothing
TOUCHDOWN, UNLOADED = 0.06, 0.2  # s after a landing, s of no load before it

_SWITCHED = DRIVES["ojas"].presets["tde-switched", "support"].gains
_LEFT, _BOTH, _RIGHT = _SWITCHED.matrices(12, np.float64)
MEAN = (0.405 * (_LEFT + _RIGHT) + 0.19 * _BOTH).tolist()  # the same matrices, each for its share of the time
BASES = ("tde", "atde", "artde")
LAWS: dict[str, tuple[str, dict[str, Any]]] = {
    f"{law.upper()}, {text}": (name.format(law), gains)
    for law in BASES
    for text, name, gains in (
        ("0.042", "{}", {}),
        ("0.077", "{}", {"preset": "stiff"}),
        ("mean matrix", "{}", {"m_bar": MEAN}),
        ("switched", "{}-switched", {}),
    )
}
COLUMNS = {"rmse_deg": ("RMS error", "deg", 3), "torque_variation_nm_s": ("torque variation", "Nm/s", 1),
           "landing_n": ("landing force", "N", 0)}  # fmt: skip


class Landings:
    """A vector environment that keeps the loads of the feet."""

    def __init__(self, env: Any, change: Callable[[Any], Any] = lambda observation: observation) -> None:
        self.unwrapped, self.num_envs, self._change = env, env.num_envs, change
        self.loads: list[Any] = []

    def __getattr__(self, name: str) -> Any:
        return getattr(self.unwrapped, name)

    def reset(self, **options: Any) -> tuple[Any, Any]:
        observation, info = self.unwrapped.reset(**options)
        return self._change(observation), info

    def step(self, action: Any) -> tuple[Any, ...]:
        observation, *rest = self.unwrapped.step(action)
        self.loads.append(rest[-1]["foot_loads"].astype(np.float32))
        return self._change(observation), *rest

    def peaks(self, robot: int, steps: int) -> list[float]:
        """Return the largest load (N) after each touchdown of a walk."""
        period = self.unwrapped.control_period
        after, before = round(TOUCHDOWN / period), round(UNLOADED / period)
        loads = np.array([load[robot] for load in self.loads[:steps]])
        found: list[float] = []
        for load in loads.T:
            on = np.concatenate([[0], np.cumsum(load > 1.0)])
            lands = (load[before:] > 1.0) & (on[before:-1] == on[: -before - 1])
            found += [float(load[k : k + after].max()) for k in np.flatnonzero(lands) + before]
        return found


def scenario(name: str, share: int, friction: float, mass: float) -> dict[str, Any]:
    """Disturbances of S1, S2 or S3 on another ground with another payload, and pushes early enough for a short walk."""
    given = dict(SCENARIOS[name].disturbances)
    pushes = given["push"]
    given |= {"friction": friction, "push": [pushes[0]] + [
        {**push, "start": start} for push, start in zip(pushes[1:], PUSHES, strict=False)
    ]}  # fmt: skip
    if "payload" in given:
        given["payload"] = {**given["payload"], "mass": mass}
    if share:
        given["grf_pulse"] = {"shape": "double_hump", "share": share / 100, "duration": 1.0, "trigger": "contact"}
    return given


def walks(
    rows: Sequence[tuple[str, dict[str, Any], int, dict[str, Any]]],
    change: Callable[[Any], Any] = lambda observation: observation,
    **kwargs: Any,
) -> pd.DataFrame:
    """Walk all rows at once: (law, disturbances, number of the seed, what else to say of it)."""
    made = gym.make_vec("BipedPush-v0", len(rows), "vector_entry_point", engine="mujoco", disturbances={},
                        duration=DURATION, autoreset_mode="Disabled", **kwargs)  # fmt: skip
    env = Landings(made.unwrapped, change)
    policies = {law: controllers.make(LAWS[law][0], env.unwrapped, **LAWS[law][1]) for law in {row[0] for row in rows}}
    laws = [row[0] for row in rows]
    together = SideBySide([policies[law] for law in laws], laws, ACTION.size)
    seeds = [episode_seed(SEED, row[2]) for row in rows]
    episodes = run_vector(env, together, seeds, options={"disturbances": [row[1] for row in rows]})
    found: list[dict[str, Any]] = []
    for i, ((law, _, number, more), episode) in enumerate(zip(rows, episodes, strict=True)):
        peaks = env.peaks(i, round(episode.row["duration_s"] / env.control_period))
        landing = float(np.mean(peaks)) if peaks else np.nan
        found.append({**more, "law": law, "world": number, **episode.row, "landing_n": landing})
    env.close()
    return pd.DataFrame(found)


def part(milliseconds: int, share: int, gait: int, base: str) -> pd.DataFrame:
    """Walk S1 to S3 on both grounds with a gait under all forms of a law."""
    rows: list[tuple[str, dict[str, Any], int, dict[str, Any]]] = []
    for name, (ground, (friction, mass)), law in itertools.product(FORMS, enumerate(GROUNDS), forms(base)):
        world = len(GROUNDS) * gait + ground
        rows.append((law, scenario(name, share, friction, mass), world, {"form": name, "share": share}))
    speed, step_duration = GAITS[gait]
    found = walks(rows, control_period=milliseconds / 1000, speed=speed, step_duration=step_duration)
    return found.assign(ms=milliseconds)


def forms(base: str) -> list[str]:
    """Return the labels of a law's forms."""
    return [law for law in LAWS if law.startswith(f"{base.upper()}, ")]


def held_out(folder: Path) -> None:
    for ms, share, gait in PARTS:
        for base in BASES:
            file = folder / f"held-out-{ms}ms-{share}-{gait}-{base}.csv"
            if not file.exists():
                text = part(ms, share, gait, base).to_csv(index=False).encode()
                write_atomically(file, lambda out, text=text: out.write(text))
    print(tables(folder))


def tables(folder: Path) -> str:
    """Return tables of falls and of the switched laws over their rivals, of the parts there are."""
    found = pd.concat(pd.read_csv(file) for file in sorted(folder.glob("held-out-*.csv")))
    cases: dict[str, dict[str, pd.DataFrame]] = {}
    for ms, share, name in itertools.product((4, 1), sorted(SHARES), FORMS):
        chosen = found.loc[(found["ms"] == ms) & (found["form"] == name) & (found["share"] == share)]
        if len(chosen):
            by_law = {law: chosen[chosen["law"] == law].set_index("world").sort_index() for law in LAWS}
            cases[f"{name}, {ms} ms, {share} %"] = by_law
    title = "falls at " + ", ".join(law.partition(", ")[2] for law in forms(BASES[0]))
    laws = [base.upper() for base in BASES]
    text = [table(title, laws, {case: [falls(by_law, base) for base in BASES] for case, by_law in cases.items()})]
    rivals = [law for law in LAWS if not law.endswith("switched")]
    for column, (title, _, _) in COLUMNS.items():
        rows = {case: [ratio(by_law, rival, column) for rival in rivals] for case, by_law in cases.items()}
        text.append(table(f"{title}, switched over", rivals, rows))
    title = "means of the walks that end: " + ", ".join(f"{title} ({unit})" for title, unit, _ in COLUMNS.values())
    text.append(
        table(title, list(LAWS), {case: [means(rows) for rows in by_law.values()] for case, by_law in cases.items()})
    )
    return "\n\n".join(text)


def table(title: str, heads: Sequence[str], rows: Mapping[str, Sequence[str]]) -> str:
    lines = [f"| {title} | " + " | ".join(heads) + " |", "|---|" + "---|" * len(heads)]
    return "\n".join(lines + [f"| {name} | " + " | ".join(cells) + " |" for name, cells in rows.items() if any(cells)])


def walked(rows: pd.DataFrame) -> pd.DataFrame:
    return rows.loc[~rows["fell"].astype(bool).to_numpy()]


def falls(by_law: Mapping[str, pd.DataFrame], base: str) -> str:
    """Return the falls under each form of a law."""
    rows = [by_law[law] for law in forms(base)]
    counts = ", ".join(str(len(one) - len(walked(one))) for one in rows)
    return f"{counts} of {len(rows[0])}" if len(rows[0]) else ""


def means(rows: pd.DataFrame) -> str:
    whole = walked(rows)
    numbers = (f"{whole[column].mean():.{digits}f}" for column, (_, _, digits) in COLUMNS.items())
    return ", ".join(numbers) if len(whole) else ""


def ratio(by_law: Mapping[str, pd.DataFrame], rival: str, column: str) -> str:
    """Return a ratio of means over the worlds in which both walk, their number, and from `FEW` on its 95 % interval."""
    ours, theirs = by_law[rival.split(",")[0] + ", switched"], by_law[rival]
    both = walked(ours).index.intersection(walked(theirs).index)
    if len(both) == 0:
        return ""
    gain = statistics.improvement(ours.loc[both, column], theirs.loc[both, column])
    value, low, high = (1 - one / 100 for one in (gain.value, gain.high, gain.low))
    return f"{value:.2f} ({low:.2f}..{high:.2f}), {gain.n}" if gain.n >= FEW else f"{value:.2f}, {gain.n}"


def lying(kind: str, contact: slice) -> Callable[[Any], Any]:
    """Return a function that falsifies the contact flags in observations, one after the other."""
    before: list[Any] = []
    coins = np.random.default_rng(SEED)
    sides = {"left": [contact.start], "both": [contact.start, contact.start + 1]}

    def change(observation: Any) -> Any:
        observation = np.array(observation)
        word, _, rest = kind.partition(" ")
        if word == "late":
            before.append(observation[:, contact].copy())
            observation[:, contact] = before[max(0, len(before) - 1 - int(rest))]
        elif word in sides:
            observation[:, sides[word]] = 1.0 if rest == "on" else 0.0
        elif word == "swapped":
            observation[:, contact] = observation[:, contact][:, ::-1]
        elif word == "random":
            observation[:, contact] = coins.integers(0, 2, observation[:, contact].shape)
        return observation

    return change


LIES = {
    "honest": "",
    "left always on": "left on",
    "left never on": "left off",
    "both always on": "both on",
    "12 ms late": "late 3",
    "20 ms late": "late 5",
    "left and right swapped": "swapped",
    "a coin for each foot and sample": "random",
}


def flags(folder: Path, walked: int = 4) -> None:
    laws = ("TDE, switched", "ARTDE, switched")
    print("| flags | scenario | law | fell | RMS error, deg |\n|---|---|---|---|---|")
    for text, kind in LIES.items():
        rows = [
            (law, dict(SCENARIOS[name].disturbances), number, {"form": name})
            for name in ("S1-L4", "S2-L4")
            for law in laws
            for number in range(walked)
        ]
        found = walks(rows, lying(kind, OBSERVATION["contact"]), control_period=0.004)
        found.to_csv(folder / f"flags-{text.replace(' ', '-')}.csv", index=False)
        for first in range(0, len(rows), walked):
            cell = found.iloc[first : first + walked]
            fell = int(cell["fell"].sum())
            error = cell.loc[~cell["fell"].astype(bool), "rmse_deg"].mean()
            print(f"| {text} | {rows[first][3]['form']} | {rows[first][0]} | {fell}/{walked} | {error:.3f} |")


def cost(_: Path, turns: int = 15) -> None:
    """CPU time of a call on the observations of a stride (L = 1 ms), the laws in turns in one process; medians."""
    env: Any = gym.make(
        "BipedWalk-Payload-v0", engine="mujoco", duration=8.0, disturbances={}, disable_env_checker=True
    )
    observation, _ = env.reset(seed=0)
    names = [f"{law}{end}" for law in ("tde", "atde", "artde") for end in ("", "-switched")]
    policies = {name: controllers.make(name, env) for name in names}
    seen, state = [observation], None
    for _step in range(5000):
        action, state = policies["tde"].predict(seen[-1], state)
        seen.append(env.step(action)[0])
    times: dict[str, list[float]] = {name: [] for name in names}
    for name in names * turns:
        own, begin = None, time.process_time()
        for observation in seen[3000:]:
            _, own = policies[name].predict(observation, own)
        times[name].append(1e6 * (time.process_time() - begin) / 2001)
    print("| law | us a call | more than without switching |\n|---|---|---|")
    for name in names:
        more = np.median(np.array(times[name]) - times[name.removesuffix("-switched")])
        print(f"| {name} | {np.median(times[name]):.1f} | {more:.1f} |")


FIGURES: dict[str, Callable[[Path], None]] = {
    "held-out": held_out,
    "tables": lambda folder: print(tables(folder)),
    "flags": flags,
    "cost": cost,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("figure", choices=FIGURES)
    parser.add_argument("--out", type=Path, default=Path("runs/switching"))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    FIGURES[options.figure](options.out)


if __name__ == "__main__":
    main()
