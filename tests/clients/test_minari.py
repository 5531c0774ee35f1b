from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

minari = pytest.importorskip("minari", reason="Minari is not installed")
for extra in ("h5py", "jax"):
    pytest.importorskip(extra, reason="Minari's extras hdf5 and create are not installed")

pytestmark = pytest.mark.clients


def test_a_data_set_with_infos(
    name: str, arguments: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    env = minari.DataCollector(gym.make(name, **arguments), record_infos=True)
    env.action_space.seed(0)
    lengths = []
    for seed in range(2):
        env.reset(seed=seed)
        ended, steps = False, 0
        while not ended:
            _, _, terminated, truncated, _ = env.step(env.action_space.sample())
            ended, steps = terminated or truncated, steps + 1
        lengths.append(steps)
    data = env.create_dataset(dataset_id="artde/test-v0", algorithm_name="random")
    episodes = list(data.iterate_episodes())
    assert [len(episode.rewards) for episode in episodes] == lengths
    for episode in episodes:
        np.testing.assert_allclose(episode.infos["time_s"], 0.01 * np.arange(len(episode.rewards) + 1), atol=1e-12)
        assert episode.infos["disturbance.push.magnitude"].shape == (len(episode.rewards) + 1, 2)
    assert data.recover_environment().spec.id == name
    env.close()
