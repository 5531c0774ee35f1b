"""One controller in an environment of its own, step by step."""

from __future__ import annotations

import json
import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np

from artde_gym.arguments import check_choice, check_number
from artde_gym.arrays import Array
from artde_gym.errors import ArtdeGymError, OptionError, UnknownNameError
from artde_gym.evaluation.cells import Cell, shared_kwargs
from artde_gym.evaluation.environments import metrics_spec_of, separate
from artde_gym.evaluation.gains import policy_for
from artde_gym.evaluation.rollout import Policy
from artde_gym.evaluation.takes import INSIDE, effort_label, error_label, gain_label, signals_of
from artde_gym.info import fall_reason
from artde_gym.metrics_spec import MetricsSpec
from artde_gym.registration import REPLACEABLE, ControllerSpec, GainRange, registered_controllers, tuning_space

NOWHERE = (float("nan"),) * 3  # of a payload that is not there


class Player:
    """A controller and the robot that it drives.

    Args:
        cell: environment with its arguments.
        name: displayed name of the controller.
        item: the controller.
        gains: gains that override its preset's.

    Attributes:
        plant: the environment itself.
        name: displayed name of the controller.
        gains: gains that override its preset's.
        over: True once the episode has ended.
        fall: reason for a fall, or "".
        fault: message of a controller that failed, or "".
        end: time of the last step (s).
        swapped: whether controller or gains changed in this episode.
    """

    def __init__(self, cell: Cell, name: str, item: Policy | ControllerSpec, gains: Mapping[str, Any]) -> None:
        self._env = separate(cell.env_id, json.dumps(shared_kwargs(cell)))
        self.plant = self._env.unwrapped
        if not hasattr(self.plant, "pose"):
            raise OptionError("env_id", cell.env_id, "an environment with a method `pose`, which a browser can show")
        self._metrics = metrics_spec_of(cell.env_id, cell.kwargs)
        self.labels = _labels(self._metrics)
        self._take(name, item, dict(gains))

    def _take(self, name: str, item: Policy | ControllerSpec, gains: dict[str, Any]) -> None:
        """Change the controller; what is refused changes nothing."""
        policy = self._built(name, item, gains)
        self.policy, self.name, self.item, self.gains = policy, name, item, gains
        self.ranges = _ranges(item, self._env, gains.get(REPLACEABLE))

    def _built(self, name: str, item: Policy | ControllerSpec, gains: dict[str, Any]) -> Policy:
        try:
            return policy_for(item, self._env, gains)
        except ArtdeGymError:
            raise
        except Exception as error:  # of somebody's own controller
            raise OptionError("controller", name, _text(error), "cannot be built") from error

    def reset(self, seed: int, disturbances: Mapping[str, Any]) -> None:
        """Begin an episode.

        Raises:
            DisturbanceError: for disturbances that the environment refuses.
        """
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", ".* can never happen")  # a payload, unless a person attaches one
            self._observation, _ = self._env.reset(seed=seed, options={"disturbances": dict(disturbances)})
        self._state, self._first = None, True
        self.over, self.fall, self.fault, self.end, self.swapped = False, "", "", 0.0, False

    def step(self) -> None:
        """Simulate one control period; a controller that fails ends the episode."""
        try:
            action, state = self.policy.predict(
                self._observation, state=self._state, episode_start=self._first, deterministic=True
            )
        except Exception as error:  # of somebody's own controller
            self.over, self.fault = True, _text(error)
            return
        try:
            self._observation, _, terminated, truncated, info = self._env.step(action)
        except ArtdeGymError as error:
            self.over, self.fault = True, str(error)
            return
        self._state, self._first = state, False
        self.end, self.over = info["time_s"], terminated or truncated
        self.fall = fall_reason(info)

    def drive(self, name: str) -> None:
        """Hand the robot to another controller where it is, at that one's own gains.

        Raises:
            UnknownNameError, OptionError: for one that is unknown or of another robot.
        """
        known = registered_controllers()
        check_choice("controller", name, sorted(known))
        self._take(name, known[name], {})
        self._state, self._first, self.swapped = None, True, True

    def tune(self, gain: str, value: Any) -> None:
        """Set a gain within its tuning range; the controller's state goes on.

        Raises:
            OptionError, GainError: for an unknown gain, or a value that its law refuses.
        """
        check_choice("gain", gain, list(self.ranges))
        _, low, high = self.ranges[gain]
        number = check_number(gain, value, -1e9, 1e9, "a number")
        self._take(self.name, self.item, {**self.gains, gain: min(high, max(low, number))})
        self.swapped = True

    def frame(self) -> Array:
        """Return base (7), payload (3), joints, loads and signals as a page takes them."""
        pose = self.plant.pose()
        parts = (pose.position, pose.quat_xyzw, pose.payload or NOWHERE, pose.q, pose.loads, self._signals())
        return np.concatenate(parts, dtype=np.float32, casting="unsafe")

    def sliders(self) -> dict[str, list[float]]:
        """Return initial value, bounds and current value of each gain that can be tuned."""
        return {gain: [*space, _shown(self.gains.get(gain, space.initial))] for gain, space in self.ranges.items()}

    def _signals(self) -> list[float]:
        fields = self.plant.observation_layout.split(np.asarray(self._observation, np.float64)[None])
        diagnose = getattr(self.policy, "diagnostics", None)
        if diagnose is not None and self._state is not None:
            fields = {
                **fields,
                **{INSIDE + name: np.asarray(part)[None] for name, part in diagnose(self._state).items()},
            }
        found = {label: float(values[0]) for label, values in signals_of(fields, self._metrics)}
        return [found.get(label, float("nan")) for label in self.labels]


def _shown(gain: Any) -> float:
    """Return one number for a gain: the mean over joints, of a matrix that of its diagonal."""
    values = np.asarray(gain, np.float64)
    return float((values.diagonal() if values.ndim == 2 else values).mean())


def _text(error: Exception) -> str:
    return str(error) if isinstance(error, ArtdeGymError) else f"{type(error).__name__}: {error}"


def _labels(metrics: MetricsSpec) -> list[str]:
    """Return the labels of all signals that any controller may have, in the order of `signals_of`."""
    gains = map(gain_label, metrics.diagnostic_means)
    return [*map(error_label, metrics.errors), *map(effort_label, metrics.efforts), *gains]


def _ranges(item: Policy | ControllerSpec, env: Any, preset: str | None) -> dict[str, GainRange]:
    if not isinstance(item, ControllerSpec):
        return {}
    try:
        return tuning_space(item.name, env, preset)
    except (UnknownNameError, OptionError):
        return {}
