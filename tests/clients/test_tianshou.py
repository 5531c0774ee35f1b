from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

RandomActionPolicy = pytest.importorskip(
    "tianshou.algorithm.algorithm_base", reason="Tianshou from 2 on is not installed", exc_type=ImportError
).RandomActionPolicy

pytestmark = pytest.mark.clients


@pytest.mark.parametrize("parallel", ["DummyVectorEnv", "SubprocVectorEnv"])
def test_a_collector(make: Callable[[], Any], parallel: str) -> None:
    data, envs = pytest.importorskip("tianshou.data"), pytest.importorskip("tianshou.env")
    env = getattr(envs, parallel)([make, make])
    buffer = data.VectorReplayBuffer(200, 2)
    collector = data.Collector(RandomActionPolicy(action_space=make().action_space), env, buffer)
    collector.reset()
    stats = collector.collect(n_episode=4)
    assert stats.n_collected_episodes == 4
    assert len(buffer) == stats.n_collected_steps == stats.lens.sum()
    assert np.isfinite(buffer.obs).all()
    assert (np.asarray(buffer.info["time_s"])[: len(buffer)] >= 0).all()
    env.close()
