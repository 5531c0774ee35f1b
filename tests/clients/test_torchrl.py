from typing import Any

import numpy as np
import pytest

envs = pytest.importorskip("torchrl.envs", reason="TorchRL is not installed", exc_type=ImportError)

pytestmark = pytest.mark.clients


def test_one_environment(name: str, arguments: dict[str, Any]) -> None:
    env = envs.GymEnv(name, **arguments)
    env.set_seed(0)
    envs.check_env_specs(env)
    steps = env.rollout(100)
    assert 0 < len(steps) <= 30
    assert bool(steps["next", "done"][-1])
    env.close()


def test_two_environments(name: str, arguments: dict[str, Any]) -> None:
    env = envs.GymEnv(f"artde_gym:{name}", num_envs=2, **arguments)  # its workers are new interpreters
    env.set_seed(0)
    steps = env.rollout(40, break_when_any_done=False)
    assert steps.batch_size == (2, 40)
    assert bool(steps["next", "done"].any(1).all())
    np.testing.assert_allclose(np.ravel(steps["next", "time_s"][:, :3]), [0.01, 0.02, 0.03] * 2, atol=1e-6)
    env.close()
