"""The batched quadrotor under a base controller as a vector environment of Stable-Baselines3."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv

from artde_gym.errors import ActionError, OptionError
from baselines.coupling import total
from baselines.recipe import Recipe
from baselines.residual import Residual, ResidualMemory
from baselines.residual_env import action_space, agent_space
from controllers.laws.tracking import Array
from controllers.policies import choose

Float = NDArray[np.float32]


class ResidualVecEnv(VecEnv):
    """What `ResidualEnv` is, for all vehicles of one batched environment; one step is one decision of each.

    An episode that ends begins anew at once, as Stable-Baselines3 expects; its last observation is in
    `infos[i]["terminal_observation"]`.

    Args:
        env: the batched environment.
        recipe: of the residual.

    Raises:
        OptionError: if the recipe's `hold` is not the control period: what ends in between would have to wait.
    """

    def __init__(self, env: Any, recipe: Recipe) -> None:
        self.env = env
        self.residual = Residual.of(env, recipe)
        if self.residual.periods != 1:
            raise OptionError("hold", recipe.hold, f"the control period, {env.control_period:g} s")
        super().__init__(env.num_envs, agent_space(self.residual), action_space(self.residual))
        self._observation: Array = np.zeros(0)
        self._memory: ResidualMemory | None = None
        self._action: Array = np.zeros(0)
        self._infos: list[dict[str, Any]] = [{} for _ in range(env.num_envs)]

    def reset(self) -> Float:
        """Start all episodes; seeds and options are those of `seed` and `set_options`."""
        seeds = None if all(seed is None for seed in self._seeds) else self._seeds
        self._observation, info = self.env.reset(seed=seeds, options=self._options[0] or None)
        self.reset_infos = [{"disturbances": drawn} for drawn in info["disturbances"]]
        self._reset_seeds()
        self._reset_options()
        self._memory = self.residual.start(self._observation)
        return self._features()

    def step_async(self, actions: NDArray[Any]) -> None:
        if actions.shape != (self.num_envs, len(self.residual.actions)):
            raise ActionError("shape of the actions", actions.shape, f"({self.num_envs}, {len(self.residual.actions)})")
        if not np.isfinite(actions).all():
            raise ActionError("actions", "values that are not finite", "finite numbers from -1 to 1")
        self._action = np.minimum(np.maximum(actions, -1.0), 1.0).astype(self._observation.dtype)

    def step_wait(self) -> tuple[Float, NDArray[np.float32], NDArray[np.bool_], list[dict[str, Any]]]:
        if self._memory is None:
            raise gym.error.ResetNeeded("the episodes have not begun: call reset()")
        memory = self.residual.decide(self._memory, self._action)
        force, self._memory = self.residual.control(self._observation, memory)
        self._observation, _, terminated, truncated, _ = self.env.step(force)
        features = self._features()
        coupling = self.residual.coupling
        terms = coupling.reward_terms(self._observation, self._memory.coupling, terminated)
        rewards = total(coupling.reward_scales, terms).astype(np.float32)
        done = terminated | truncated
        infos = list(self._infos)
        if done.any():
            for i in np.flatnonzero(done).tolist():
                infos[i] = {"terminal_observation": features[i], "TimeLimit.truncated": not terminated[i]}
            self._observation, _ = self.env.reset(options={"reset_mask": done})
            self._memory = choose(done, self.residual.start(self._observation), self._memory)
            features = np.where(done[:, None], self._features(), features)
        return features, rewards, done, infos

    def close(self) -> None:
        self.env.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        owner = self if attr_name in ("residual", "render_mode") else self.env
        return [getattr(owner, attr_name, None)] * len(list(self._get_indices(indices)))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        raise OptionError("attribute to set", attr_name, "none: the vehicles share one environment")

    def env_method(self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any) -> list[Any]:
        raise OptionError("method to call", method_name, "none: the vehicles share one environment")

    def env_is_wrapped(self, wrapper_class: type[gym.Wrapper[Any, Any, Any, Any]], indices: Any = None) -> list[bool]:
        return [False] * len(list(self._get_indices(indices)))

    def get_images(self) -> Sequence[NDArray[np.uint8] | None]:
        return [None] * self.num_envs

    def _features(self) -> Float:
        assert self._memory is not None
        features, self._memory = self.residual.observe(self._observation, self._memory)
        return features.astype(np.float32, order="C")
