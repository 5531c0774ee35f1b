"""A batched environment under a base controller as a vector environment of Stable-Baselines3."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from artde_gym.arguments import real_array
from artde_gym.errors import ActionError, OptionError
from artde_gym.extras import needs
from baselines.action_adapter import total
from baselines.residual import Residual, ResidualState
from baselines.residual_config import ResidualConfig
from baselines.residual_env import action_space, agent_space
from baselines.tasks import task
from controllers.laws.tracking import Array
from controllers.policies import choose

with needs("rl"):
    from stable_baselines3.common.vec_env import VecEnv

Float = NDArray[np.float32]


class ResidualVecEnv(VecEnv):
    """`ResidualEnv` for all robots of one vector environment; one step is one decision of each.

    An episode that ends restarts with the next decision, as Stable-Baselines3 expects; its last observation is in
    `infos[i]["terminal_observation"]`.

    Args:
        env: the batched environment.
        config: of the residual.

    Raises:
        OptionError: if `config` is another robot's, or `decision_period` is no whole number of control periods.
    """

    def __init__(self, env: Any, config: ResidualConfig) -> None:
        self.env = env
        self.residual = Residual.of(env, config)
        super().__init__(env.num_envs, agent_space(self.residual), action_space(self.residual))
        self._observation: Array = np.zeros(0)
        self._memory: ResidualState | None = None
        self._action: Array = np.zeros(0)
        self._infos: list[dict[str, Any]] = [{} for _ in range(env.num_envs)]

    def reset(self) -> Float:
        """Start all episodes; seeds and options are those of `seed` and `set_options`."""
        seeds = None if all(seed is None for seed in self._seeds) else self._seeds
        self._observation, _ = self.env.reset(seed=seeds, options=self._options[0] or None)
        self.reset_infos = [{"disturbances": drawn} for drawn in self.env.sampled_disturbances]
        self._reset_seeds()
        self._reset_options()
        features, self._memory = self._seen(self._observation, self.residual.start(self._observation))
        return features

    def seed(self, seed: int | Sequence[int] | None = None) -> list[int | None]:
        """Seeds of the next reset: one for each environment, or a number from which on they count."""
        if seed is None or isinstance(seed, int):
            return list(super().seed(seed))
        self._seeds = list(seed)
        return self._seeds

    def step_async(self, actions: NDArray[Any]) -> None:
        shape = (self.num_envs, len(self.residual.actions))
        actions = real_array("actions", actions, f"numbers of the shape {shape}")
        if actions.shape != shape:
            raise ActionError("shape of the actions", actions.shape, f"{shape}")
        if not np.isfinite(actions).all():
            raise ActionError("actions", "values that are not finite", "finite numbers from -1 to 1")
        self._action = np.minimum(np.maximum(actions, -1.0), 1.0).astype(self._observation.dtype)

    def step_wait(self) -> tuple[Float, NDArray[np.float32], NDArray[np.bool_], list[dict[str, Any]]]:
        if self._memory is None:
            raise gym.error.ResetNeeded("the episodes have not begun: call reset()")
        observation, memory = self._observation, self.residual.set_action(self._memory, self._action)
        fell = done = np.zeros(self.num_envs, np.bool_)
        for _ in range(self.residual.periods):
            force, after = self.residual.control(observation, memory)
            seen, _, terminated, truncated, _ = self.env.step(force)
            if done.any():  # what ended in this decision waits as it was
                seen, after = choose(done, (observation, memory), (seen, after))
                terminated, truncated = terminated & ~done, truncated & ~done
            observation, memory = seen, after
            fell, done = fell | terminated, done | terminated | truncated
        features, memory = self._seen(observation, memory)
        adapter = self.residual.adapter
        terms = adapter.reward_terms(observation, memory.adapter, fell)
        rewards = total(adapter.reward_scales, terms).astype(np.float32)
        infos = list(self._infos)
        if done.any():
            for i in np.flatnonzero(done).tolist():
                infos[i] = {"terminal_observation": features[i], "TimeLimit.truncated": not fell[i]}
            observation, _ = self.env.reset(options={"reset_mask": done})
            begun, fresh = self._seen(observation, self.residual.start(observation))
            features, memory = choose(done, (begun, fresh), (features, memory))
        self._observation, self._memory = observation, memory
        return features, rewards, done, infos

    def close(self) -> None:
        self.env.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        owner = self if attr_name in ("residual", "render_mode") else self.env
        return [getattr(owner, attr_name, None)] * len(list(self._get_indices(indices)))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        raise OptionError("attribute", attr_name, "set it before", "cannot be set for one environment of a vector")

    def env_method(self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any) -> list[Any]:
        raise OptionError("method", method_name, "call it before", "cannot be called for one environment of a vector")

    def env_is_wrapped(self, wrapper_class: type[gym.Wrapper[Any, Any, Any, Any]], indices: Any = None) -> list[bool]:
        return [False] * len(list(self._get_indices(indices)))

    def get_images(self) -> Sequence[NDArray[np.uint8] | None]:
        return [None] * self.num_envs

    def _seen(self, observation: Array, memory: ResidualState) -> tuple[Float, ResidualState]:
        features, memory = self.residual.observe(observation, memory)
        return features.astype(np.float32, order="C"), memory


def batched(env_id: str, config: ResidualConfig, count: int, kwargs: Mapping[str, Any]) -> ResidualVecEnv:
    """So many of an environment, built with `kwargs`, in one batch with an agent's action for each."""
    own = {name: value for name, value in kwargs.items() if name != "engine"}  # a batch is an engine
    own |= task(env_id).batch or {}
    return ResidualVecEnv(gym.make_vec(env_id, count, vectorization_mode="vector_entry_point", **own), config)
