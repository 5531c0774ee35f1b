"""Checks of every environment with the checkers of Gymnasium and Stable-Baselines3."""

from __future__ import annotations

import importlib
import importlib.util
import json
import warnings
from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.utils.env_checker import check_env

from artde_gym.disturbances import DISTURBANCES
from artde_gym.doctor.check_result import CheckResult
from artde_gym.evaluation.environments import arguments_of, ours, robot_of, vector
from artde_gym.sim.factory import ENGINES, resolve_engine

DURATION, PAYLOAD = 3.0, {"payload": 0.3}  # s, kg
IN_SI_UNITS = r".*(symmetric and normalized|recommend using np.float32)"
"""Warnings to ignore: actions are in Nm and N, and float64, by design; RescaleAction gives [-1, 1]."""
REMEDY = "install the tested versions: pip install -c constraints.txt --force-reinstall ."


def in_engine(name: str) -> list[CheckResult]:
    """Run Gymnasium's checker on every environment in an engine, if it is available.

    Environments without the argument `engine` are checked together with the default engine.
    """
    default = resolve_engine(None)
    if missing := ENGINES[name].missing():
        return [CheckResult(ENGINES[name].title, "missing", f"the default engine is {ENGINES[default].title}", missing)]
    chosen = [env_id for env_id in ours() if name == default or "engine" in arguments_of(env_id)]
    return [_checked(env_id, name, _gymnasium) for env_id in chosen]


def stable_baselines3() -> list[CheckResult]:
    """Run Stable-Baselines3's checker on every environment."""
    if importlib.util.find_spec("stable_baselines3") is None:
        return [CheckResult("Stable-Baselines3", "missing", "not installed", "pip install 'artde-gym[rl]'")]
    checker = importlib.import_module("stable_baselines3.common.env_checker")
    return [_checked(name, resolve_engine(None), checker.check_env) for name in ours()]


def batch() -> list[CheckResult]:
    """Check vector environments: shapes, bounds, and bitwise independence of the number of environments."""
    outcomes = []
    for name in ours():
        if gym.spec(name).vector_entry_point is None:
            continue
        vectors: list[Any] = [vector(name, json.dumps(_arguments(name)), size) for size in (8, 1)]
        many, one = vectors
        action = many.action_space.low * 0.5 + many.action_space.high * 0.5
        many.reset(seed=[7, *range(1, 8)])
        one.reset(seed=[7])
        same = True
        for _ in range(20):
            seen, alone = many.step(action)[0], one.step(action[:1])[0]
            same &= seen[:1].tobytes() == alone.tobytes() and many.observation_space.contains(np.array(seen))
        many.close()
        one.close()
        text = "8 at once, the first as if alone"
        outcomes.append(CheckResult(name, "ok", text) if same else CheckResult(name, "failed", f"not {text}", REMEDY))
    return outcomes


def _gymnasium(env: Any) -> None:
    check_env(env, skip_render_check=True)  # rendering has its own check


def _arguments(name: str, engine: str | None = None) -> dict[str, Any]:
    """Return the arguments of a short episode with a payload that the environment takes."""
    wanted: dict[str, Any] = {"duration": DURATION, "engine": engine} if engine else {"duration": DURATION}
    if DISTURBANCES["payload"].honored_by(robot_of(name)):
        wanted["disturbances"] = PAYLOAD
    return {argument: value for argument, value in wanted.items() if argument in arguments_of(name)}


def _checked(name: str, engine: str, checker: Callable[[Any], None]) -> CheckResult:
    try:
        env = gym.make(name, disable_env_checker=True, **_arguments(name, engine))
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            warnings.filterwarnings("ignore", message=IN_SI_UNITS)
            checker(env.unwrapped)
        env.close()
    except Exception as error:
        return CheckResult(name, "failed", f"{type(error).__name__}: {error}", REMEDY)
    if caught:
        return CheckResult(name, "ok", f"check_env passes with a warning: {caught[0].message}")
    return CheckResult(name, "ok", "check_env passes")
