"""Pictures of one episode as it goes on."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from artde_gym.evaluation.environments import drawing
from artde_gym.evaluation.gains import policy_for
from artde_gym.evaluation.rollout import Policy
from artde_gym.info import fall_reason
from artde_gym.registration import ControllerSpec


class Frame(NamedTuple):
    """A picture (height, width, 3) at a time; whether the episode ended there, and why if in a fall ("" if not)."""

    time_s: float
    picture: NDArray[np.uint8]
    over: bool
    fall_reason: str


def render_frames(
    env_id: str,
    kwargs: Mapping[str, Any],
    policy: Policy | ControllerSpec,
    gains: Mapping[str, Any],
    seed: int,
    times: Iterable[float],
    width: int,
) -> Iterator[Frame]:
    """Run one episode in an environment of its own, with a picture at the first sample at or after each time (s).

    The last picture is that of the episode's end, if it comes before the last time.

    Args:
        env_id, kwargs: of the environment.
        policy, gains: what drives it.
        seed: of the reset: of an episode of `evaluate`, that very episode is shown.
        times: ascending.
        width: of the pictures (pixels), whose height is three quarters of it.

    Raises:
        OptionError: for a bad argument, or where an engine cannot draw.
    """
    env = drawing(env_id, kwargs, width)
    try:
        predict = policy_for(policy, env, dict(gains)).predict
        observation, info = env.reset(seed=seed)
        state, first, over = None, True, False
        for time in times:
            while info["time_s"] < time - 1e-9 and not over:
                action, state = predict(observation, state=state, episode_start=first, deterministic=True)
                observation, _, terminated, truncated, info = env.step(action)
                first, over = False, terminated or truncated
            reason = fall_reason(info)
            yield Frame(info["time_s"], env.render(), over, reason)
            if over:
                return
    finally:
        env.close()
