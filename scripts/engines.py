"""Comparison of the two physics engines: the figures of docs/engines.md.

python scripts/engines.py errors        RMS tracking errors in S1, S2 and S3 at L = 1 and 2 ms
python scripts/engines.py falls         rates of falls at L = 4 ms, over seeds
python scripts/engines.py stiffness     rates of falls in S2-L4 over the stiffness of MuJoCo's contacts
python scripts/engines.py iterations    error, gain and TDE error of ARTDE over the iterations of Bullet's solver
"""

from __future__ import annotations

import argparse
from typing import Any

import gymnasium as gym
import numpy as np
import pybullet as bullet

import controllers
from artde_gym.evaluation import Result, evaluate, statistics
from artde_gym.evaluation.rollout import run_episode
from artde_gym.evaluation.seeds import episode_seed
from artde_gym.robots.ojas.thesis import JOINTS
from artde_gym.scenarios import SCENARIOS

ENGINES = ("bullet", "mujoco")
NAMES = ("tde", "atde", "artde")
PERIODS = (0.001, 0.002)  # s, of control
CONTACT_TIMES = (0.002, 0.005, 0.01, 0.02)  # s; ours is the second, MuJoCo's own default the last
ITERATIONS = (30, 60, 100, 200, 400)


def main() -> None:
    figures = {"errors": errors, "falls": falls, "stiffness": stiffness, "iterations": iterations}
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("figure", choices=figures)
    parser.add_argument("--episodes", type=int, default=2, help="seeds of each controller")
    parser.add_argument("--scenarios", nargs="+", help="in place of the figure's own")
    parser.add_argument("--actuator-inertia", choices=("rotor", "lumped"), default="rotor")
    parser.add_argument("--workers", type=int, default=1)
    options = parser.parse_args()
    figures[options.figure](options)


def errors(options: argparse.Namespace) -> None:
    """Means over the seeds, and by how many percent MuJoCo's is above Bullet's: over all joints, then q1 to q6."""
    heading("scenario", "L (ms)", "controller", "falls", "Bullet (deg)", "MuJoCo (deg)", "all", *JOINTS)
    columns = ("rmse_deg", *(f"rmse_deg_{joint}" for joint in JOINTS))
    for period in PERIODS:
        for scenario in options.scenarios or ("S1", "S2", "S3"):
            results = both(scenario, options, control_period=period)
            for name in NAMES:
                fallen = ", ".join(str(results[engine].falls(scenario, name)[0]) for engine in ENGINES)
                means = [[np.mean(results[e].values(scenario, name, column)) for column in columns] for e in ENGINES]
                change = [f"{100 * (b / a - 1):+.1f} %" for a, b in zip(*means, strict=True)]
                row(scenario, f"{1e3 * period:g}", name, fallen, *(f"{mean[0]:.4f}" for mean in means), *change)


def falls(options: argparse.Namespace) -> None:
    """Falls with Wilson's interval, engine beside engine."""
    heading("scenario", "controller", "Bullet", "MuJoCo")
    for scenario in options.scenarios or ("S1-L4", "S2-L4", "S3-L4"):
        results = both(scenario, options)
        for name in NAMES:
            row(scenario, name, *(rate(results[engine].falls(scenario, name)[1]) for engine in ENGINES))


def both(scenario: str, options: argparse.Namespace, **kwargs: Any) -> dict[str, Result]:
    """Run the same seeds in both engines."""
    return {engine: run(scenario, engine, options, **kwargs) for engine in ENGINES}


def run(scenario: str, engine: str, options: argparse.Namespace, disturbances: Any = None, **kwargs: Any) -> Result:
    """Run the seeds of a scenario in an engine; `kwargs` are arguments of the environment."""
    return evaluate(
        NAMES,
        scenario=scenario,
        episodes=options.episodes,
        workers=options.workers,
        env_kwargs={**kwargs, "actuator_inertia": options.actuator_inertia, "engine": engine},
        disturbances=disturbances,
        vectorized=engine == "mujoco",  # the same episodes, faster
    )


def stiffness(options: argparse.Namespace) -> None:
    """Falls by the time constant of a contact's spring: four times the time is a sixteenth of the stiffness."""
    heading("time constant (ms)", *NAMES)
    for seconds in CONTACT_TIMES:
        softer = {**SCENARIOS["S2-L4"].disturbances, "contact": {"time_constant": seconds}}
        result = run("S2-L4", "mujoco", options, disturbances=softer)
        row(f"{1e3 * seconds:g}", *(rate(result.falls("S2-L4", name)[1]) for name in NAMES))


def iterations(options: argparse.Namespace) -> None:
    """Figures of ARTDE; MuJoCo, which has no gears to solve, comes last."""
    figures = {"RMS error (deg)": "rmse_deg", "mean gain": "robust_gain_mean", "TDE error (rad/s^2)": "tde_error_rms"}
    heading("scenario", "L (ms)", "figure", *(str(count) for count in ITERATIONS), "MuJoCo")
    for period in PERIODS:
        for scenario in options.scenarios or ("S1", "S2"):
            variants = [solved(scenario, period, count, options) for count in (*ITERATIONS, None)]
            for name, column in figures.items():
                means = [np.mean([episode[column] for episode in episodes]) for episodes in variants]
                row(scenario, f"{1e3 * period:g}", name, *(f"{mean:.4f}" for mean in means))


def solved(scenario: str, period: float, count: int | None, options: argparse.Namespace) -> list[dict[str, Any]]:
    """Metrics of ARTDE's walks in Bullet with so many iterations; None is MuJoCo."""
    env = make(scenario, "mujoco" if count is None else "bullet", options, control_period=period)
    if count is not None:
        bullet.setPhysicsEngineParameter(numSolverIterations=count, physicsClientId=env._engine._client)
    episodes = walks(env, "artde", options.episodes)
    env.close()
    return episodes


def make(scenario: str, engine: str, options: argparse.Namespace, **changes: Any) -> Any:
    """Return the environment of a scenario, without wrappers."""
    entry = SCENARIOS[scenario]
    kwargs = {**entry.kwargs, "actuator_inertia": options.actuator_inertia, "engine": engine, **changes}
    return gym.make(entry.env_id, disable_env_checker=True, disturbances=entry.disturbances, **kwargs).unwrapped


def walks(env: Any, name: str, episodes: int) -> list[dict[str, Any]]:
    """Metrics of the seeds that `evaluate` has too."""
    policy = controllers.make(name, env)
    return [run_episode(env, policy, episode_seed(0, episode)).row for episode in range(episodes)]


def rate(estimate: statistics.Estimate) -> str:
    fallen = round(estimate.value * estimate.n)
    return f"{fallen}/{estimate.n} ({100 * estimate.low:.0f}..{100 * estimate.high:.0f} %)"


def heading(*columns: str) -> None:
    row(*columns)
    row(*["---"] * len(columns))


def row(*cells: str) -> None:
    print("| " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
