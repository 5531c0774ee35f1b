"""Saved policies: what was saved is what is loaded, nothing is executed, and what does not fit is refused."""

import hashlib
import itertools
import json
import os
import pickle
import subprocess
import sys
import zipfile
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

import artde_gym
import baselines
import controllers
from artde_gym.errors import UnknownNameError
from artde_gym.evaluation import evaluate
from baselines.errors import PolicyFileError
from baselines.network import Network
from baselines.policy_file import Saved, layout_hash, read, save
from baselines.residual import Residual
from baselines.residual_config import ResidualConfig
from baselines.saved import SHIPPED

QUADROTOR = {"disturbances": {}, "duration": 1.0}


@pytest.fixture(scope="module")
def env():
    env = gym.make("QuadInfinity-Payload-v0", disable_env_checker=True, **QUADROTOR)
    yield env
    env.close()


@pytest.fixture
def saved(env):
    rng = np.random.default_rng(0)
    residual = Residual.of(env, ResidualConfig("q450"))
    sizes = (residual.features.size, 8, len(residual.actions))
    layers = tuple(
        (rng.normal(0, 0.3, (a, b)).astype("f4"), rng.normal(0, 0.1, b).astype("f4"))
        for a, b in itertools.pairwise(sizes)
    )
    mean, variance = rng.normal(size=sizes[0]).astype("f4"), rng.uniform(0.5, 2, sizes[0]).astype("f4")
    network = Network(mean, variance, layers)
    return Saved(
        "tde+x", residual.config, network, layout_hash(residual.features), residual.actions, 0.015, "q450", {"seed": 3}
    )


@pytest.fixture
def folder(saved, tmp_path):
    save(tmp_path / "policy", saved)
    return tmp_path / "policy"


def describe(folder, **changes):
    file = folder / "policy.json"
    file.write_text(json.dumps({**json.loads(file.read_text()), **changes}))


def test_what_was_saved_is_loaded_and_flies_the_same_with_and_without_an_environment(saved, folder, env):
    back = read(folder)
    assert back._replace(network=None) == saved._replace(network=None)
    for mine, other in zip(back.network.layers, saved.network.layers, strict=True):
        np.testing.assert_array_equal(mine[0], other[0])
    observation, _ = env.reset(seed=0)
    action, other = (policy.predict(observation)[0] for policy in (baselines.load(folder), baselines.load(folder, env)))
    np.testing.assert_array_equal(action, other)
    assert not np.array_equal(action, controllers.make("tde", env).predict(observation)[0])


def test_the_harness_judges_it_beside_its_base(folder):
    result = evaluate(
        ["tde", baselines.load(folder.parent)],
        "QuadInfinity-Payload-v0",
        episodes=1,
        env_kwargs={"duration": 0.5},
        disturbances={"wind": 1.0},
    )
    assert list(result.episodes["controller"]) == ["tde", "tde+x"]
    assert len(set(result.episodes["rmse_m"])) == 2


class Malicious:
    def __reduce__(self):
        return os.mkdir, ("executed",)


def test_a_pickle_is_refused_unread(folder, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    array = np.empty(1, dtype=object)
    array[0] = Malicious()
    with np.load(folder / "weights.npz") as arrays:
        kept = {name: arrays[name] for name in arrays.files}
    np.savez(folder / "weights.npz", **{**kept, "weight_0": array})
    content = (folder / "weights.npz").read_bytes()
    describe(folder, weights_sha256=hashlib.sha256(content).hexdigest())
    with pytest.raises(PolicyFileError, match="allow_pickle"):
        baselines.load(folder)
    raw = pickle.dumps(Malicious())
    (folder / "weights.npz").write_bytes(raw)
    describe(folder, weights_sha256=hashlib.sha256(raw).hexdigest())
    with pytest.raises(PolicyFileError):
        baselines.load(folder)
    assert not Path("executed").exists()


def test_a_damaged_file_is_refused(folder):
    content = (folder / "weights.npz").read_bytes()
    (folder / "weights.npz").write_bytes(content[:-40])
    with pytest.raises(PolicyFileError, match=r"weights '.*' do not belong to policy\.json"):
        baselines.load(folder)
    (folder / "weights.npz").write_bytes(content)
    (folder / "policy.json").write_text((folder / "policy.json").read_text()[:50])
    with pytest.raises(PolicyFileError, match=r"a folder with policy\.json and weights\.npz"):
        baselines.load(folder)


def test_a_missing_array_or_another_shape_is_refused(folder):
    with np.load(folder / "weights.npz") as arrays:
        kept = {name: arrays[name] for name in arrays.files}
    for changed, message in (
        ({**kept, "weight_0": kept["weight_0"].T}, "array 'weight_0'"),
        ({**kept, "bias_1": kept["bias_1"] * np.float32(np.nan)}, "array 'bias_1'"),
        ({name: value for name, value in kept.items() if name != "mean"}, "mean"),
    ):
        np.savez(folder / "weights.npz", **changed)
        describe(folder, weights_sha256=hashlib.sha256((folder / "weights.npz").read_bytes()).hexdigest())
        with pytest.raises(PolicyFileError, match=message):
            baselines.load(folder)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"version": 99}, r"version of .* is 99; allowed: 1, which this release reads"),
        ({"features_sha256": "0"}, r"features of 'tde\+x' '0' differ"),
        ({"actions": ["x"]}, r"actions of 'tde\+x'"),
        ({"recipe": {"robot": "q450", "unknown": 1}}, "unknown"),
        ({"recipe": {"robot": "q450", "action_scale": -1.0}}, "action_scale"),
        ({"recipe": {"robot": "ojas"}}, r"nominal_robot is 'q450'"),
    ],
)
def test_what_does_not_fit_is_refused_by_name(folder, changes, message):
    describe(folder, **changes)
    with pytest.raises(PolicyFileError, match=message):
        baselines.load(folder)


def test_another_robot_is_refused(folder):
    biped = gym.make("BipedWalk-Payload-v0", disable_env_checker=True, duration=1.0, disturbances={})
    with pytest.raises(PolicyFileError, match=r"robot of 'tde\+x' 'q450' is not 'ojas'"):
        baselines.load(folder, biped)
    biped.close()


def test_a_shipped_policy_belongs_to_an_environment(env):
    with pytest.raises(UnknownNameError, match=r"environment of a trained policy is 'QuadInfinity-Payload-v0'"):
        controllers.make("tde+balance", env)
    with pytest.raises(UnknownNameError, match="environment of a trained policy is ''"):
        controllers.make("tde+ppo", type(env.unwrapped)())  # nobody gave it an id
    vector = gym.make_vec("QuadInfinity-Payload-v0", 2, vectorization_mode="vector_entry_point", engine="numpy")
    assert controllers.make("tde+ppo", vector).name == "tde+ppo"


def test_zip_bombs_of_names_do_not_matter(folder):
    """Only arrays that the description asks for are read."""
    with zipfile.ZipFile(folder / "weights.npz", "a") as archive:
        archive.writestr("../escaped.npy", b"nothing")
    describe(folder, weights_sha256=hashlib.sha256((folder / "weights.npz").read_bytes()).hexdigest())
    baselines.load(folder)
    assert not (folder.parent / "escaped.npy").exists()


def test_inference_needs_no_learning_library(folder):
    code = (
        "import sys, numpy, baselines\n"
        f"policy = baselines.load({str(folder)!r})\n"
        "policy.predict(numpy.ones(41))\n"
        "loaded = {'torch', 'stable_baselines3', 'cmaes', 'pybullet', 'mujoco'} & set(sys.modules)\n"
        "assert not loaded, loaded\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize("name", sorted(path.parent.name for path in SHIPPED.glob("*/policy.json")))
def test_shipped_policies_fit_their_environments_and_have_a_card(name):
    saved = read(SHIPPED / name)
    card = (SHIPPED / name / "README.md").read_text()
    assert "artde-gym train" in card
    assert json.loads((SHIPPED / name / "policy.json").read_text())["weights_sha256"] in card
    env = gym.make(saved.about["env_id"], disable_env_checker=True, duration=1.0)
    policy = controllers.make(saved.name, env)
    observation, _ = env.reset(seed=0)
    state = None
    for _ in range(3):
        action, state = policy.predict(observation, state)
        observation, *_ = env.step(action)
    assert set(policy.diagnostics(state)) > {"sigma"} or saved.config.robot == "q450"
    env.close()


assert artde_gym.__version__
