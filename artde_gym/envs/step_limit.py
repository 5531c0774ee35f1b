"""The number of steps of an episode, told by an environment's `spec`."""

from __future__ import annotations

import copy
from typing import Any


class _Spec:
    """The attribute `spec` of an environment: what Gymnasium puts there, and the number of steps."""

    def __get__(self, env: Any, owner: type) -> Any:
        return None if env is None else vars(env).get("_spec")

    def __set__(self, env: Any, spec: Any) -> None:
        env._spec = copy.copy(spec)
        if spec is not None:
            env._spec.max_episode_steps = env._last


class StepLimitMixin:
    """A part of an environment whose episodes end after a number of steps that follows from its arguments."""

    spec: Any = _Spec()
    _last: int  # control period with which an episode ends
