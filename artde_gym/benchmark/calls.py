"""Time of a controller's call."""

from __future__ import annotations

from typing import Any

from artde_gym.benchmark.environments import biped, fleet, quadrotor
from artde_gym.benchmark.figure import Figure, Section
from artde_gym.benchmark.timing import TURN, in_turns
from artde_gym.errors import UnknownNameError
from artde_gym.registration import make_controller, registered_controllers

MANY = 1024
"""Number of vehicles that one call drives."""


class _Calls:
    """A controller that is called repeatedly with the first observation of an episode."""

    def __init__(self, policy: Any, observation: Any) -> None:
        self._policy, self._observation = policy, observation
        _, self._state = policy.predict(observation)

    def turn(self) -> Any:
        return self._advance

    def _advance(self) -> None:
        for _ in range(TURN):
            _, self._state = self._policy.predict(self._observation, self._state)


def calling(quick: bool) -> Section:
    """Measure every controller's call, for each robot that it drives, and for many vehicles at once."""
    figures = []
    for name, env in {"biped": biped(), "quadrotor": quadrotor(), f"{MANY} quadrotors": fleet(MANY)}.items():
        observation, _ = env.reset(seed=0)
        variants = {}
        for controller in registered_controllers():
            try:
                policy = make_controller(controller, env)
            except UnknownNameError:  # none for this robot
                continue
            variants[controller] = _Calls(policy, observation).turn
        times = in_turns(variants, (2 if quick else 20) if env.observation_space.shape[0] == MANY else 40)
        env.close()
        for controller, seconds in times.items():
            figures.append(Figure(f"{name}, {controller}", 1e6 * seconds / TURN, "us per call"))
            if controller != "tde":
                figures.append(Figure(f"{name}, {controller}: against TDE", seconds / times["tde"]))
    text = f"The same observation over and over, float64, on one core; {MANY} vehicles are one call for all of them."
    return Section("A call of a controller", text, tuple(figures))
