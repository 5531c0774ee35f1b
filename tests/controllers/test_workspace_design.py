"""The design of an arm over its workspace: its predictions against simulation, its advice, `artde-gym design --env`."""

import dataclasses
import json
import math
import warnings
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from scipy.ndimage import uniform_filter1d
from typer.testing import CliRunner

import controllers
from artde_gym.cli import app
from artde_gym.multibody.spec import RobotSpec
from artde_gym.robots.arm.panda import panda
from controllers.drive import DRIVES
from controllers.laws.errors import GainError
from controllers.mode import force_noise, spectral_radius
from controllers.workspace_design import CHATTER, advice, workspace_design

pytestmark = pytest.mark.once

ID = "ArmTrack-Payload-v0"
PERIOD = 0.001


def arm(**fields: Any) -> RobotSpec:
    """Return the built-in arm with other properties of its joints."""
    links = (link if link.axis is None else dataclasses.replace(link, **fields) for link in panda().links)
    return dataclasses.replace(panda(), links=tuple(links))


@pytest.mark.parametrize("cutoff_hz", [None, 80.0])
def test_a_mode_obeys_its_recursion(cutoff_hz: float | None) -> None:
    """The mode once more as a loop over samples: it grows by its radius, and white noise moves its force as told."""
    lam, k_p, k_d, rng = 0.7, 900.0, 60.0, np.random.default_rng(0)
    keep = 0.0 if cutoff_hz is None else math.exp(-2 * math.pi * cutoff_hz * PERIOD)
    noise = rng.normal(size=50_000)
    q = v = before = seen = a = 0.0
    forces = np.empty(len(noise))
    for k, error in enumerate(noise.tolist()):
        reading = q + error
        velocity = keep * seen + (1 - keep) * (reading - before) / PERIOD
        a -= lam * (k_d * velocity + k_p * reading + (velocity - seen) / PERIOD)
        v += PERIOD * a
        q += PERIOD * v
        before, seen, forces[k] = reading, velocity, a
    assert spectral_radius(lam, k_p, k_d, PERIOD, cutoff_hz) < 1
    assert force_noise(lam, k_p, k_d, PERIOD, cutoff_hz) == pytest.approx(forces.std() / lam, rel=0.04)
    assert force_noise(lam, 1e9, k_d, PERIOD, cutoff_hz) == math.inf


def test_factors_of_the_bandwidth_are_where_a_mode_becomes_unstable() -> None:
    found = workspace_design(panda(), PERIOD, {"k_p": 4000.0, "k_d": 90.0})
    low, high = 0.55 * found.eigenvalues.min(), found.eigenvalues.max()
    for lam, factor in zip((high, low), found.factors, strict=True):
        radii = [spectral_radius(lam, 4000.0 * x**2, 90.0 * x, PERIOD) for x in (0.98 * factor, 1.02 * factor)]
        assert radii[0] < 1 < radii[1]


@pytest.mark.parametrize("cutoff_hz", [None, 100.0])
def test_chatter_behind_encoders_is_as_predicted(cutoff_hz: float | None) -> None:
    bits = 18
    env = gym.make(ID, engine="mujoco", reference="multi-sine", duration=1.5, disturbances={"encoder_bits": bits})
    policy = controllers.make("tde", env, velocity_cutoff_hz=cutoff_hz)
    observation, _ = env.reset(seed=0)
    state, torques = None, []
    for _ in range(1500):
        action, state = policy.predict(observation, state)
        observation, *_ = env.step(action)
        torques.append(action)
    env.close()
    late = np.array(torques)[500:]
    seen = (late - uniform_filter1d(late, 25, axis=0)).std(axis=0)
    ratio = seen / (workspace_design(panda(), PERIOD, {}, bits).chatter(cutoff_hz) * panda().torque_limits)
    assert (ratio > 0.6).all()
    assert (ratio < 1.1).all()  # the prediction is that of the worst pose


def test_a_low_pass_is_proposed_where_encoders_are_coarse() -> None:
    assert workspace_design(panda(), PERIOD, {}, 24).low_pass is None  # none is needed
    coarse = workspace_design(panda(), PERIOD, {}, 16)
    assert coarse.low_pass is not None
    hz, factor = coarse.low_pass
    assert factor <= 1
    assert coarse.chatter(hz, factor).max() <= CHATTER < coarse.chatter().max()
    assert any(f"velocity_cutoff_hz={hz:.3g}" in line for line in advice(coarse))
    assert any("finer encoders" in line for line in advice(workspace_design(panda(), PERIOD, {}, 4)))


@pytest.mark.parametrize(
    ("spec", "gains", "words"),
    [
        (panda(), {}, "half the control period"),
        (dataclasses.replace(panda(), armature=(0.0,) * 7), {}, "no reflected rotor inertia"),
        (arm(effort=20.0), {}, "joint2 cannot hold the arm"),
        (dataclasses.replace(arm(coulomb=5.0), armature=(1e-3,) * 7), {}, "Dry friction of joint7 is smoothed"),
        (panda(), {"m_bar": 1.0}, "m_bar is too large by a factor of 2.39"),
        (panda(), {"k_p": 1e6, "k_d": 2000.0}, "The bandwidth is too large"),
    ],
)
def test_advice_names_what_limits_a_design(spec: RobotSpec, gains: dict[str, Any], words: str) -> None:
    found = workspace_design(spec, PERIOD, gains)
    assert any(words in line for line in advice(found))
    assert found.valid == (gains == {})
    json.dumps(found.to_dict(), allow_nan=False)


@pytest.mark.parametrize("gains", [{"gamma_0": 1.0}, {"m_bar": [1.0, 2.0]}, {"k_p": [1.0] * 7}, {"k_d": -1.0}])
def test_impossible_gains_are_refused(gains: dict[str, Any]) -> None:
    with pytest.raises(GainError):
        workspace_design(panda(), PERIOD, gains)


def test_doctor_judges_the_arm_in_all_poses() -> None:
    stability = DRIVES["arm"].stability
    assert stability is not None
    lines = {line.what: line for line in stability()}
    assert {line.status for line in lines.values()} == {"ok"}
    assert lines["arm, workspace"].found == "0.129 to 1.000"


# ------------------------------------------------------------------------------------------------------ the command


def told(*words: str) -> Any:
    run = CliRunner().invoke(app, ["design", *words])
    assert run.exit_code == 0, run.output
    return run.output


def test_the_command_designs_for_a_file(tmp_path: Path) -> None:
    body = '<inertial><mass value="2"/><inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial>'
    (tmp_path / "rod.urdf").write_text(
        f'<robot name="r"><link name="a"/><link name="b">{body}</link><joint name="swing" type="revolute">'
        '<parent link="a"/><child link="b"/><axis xyz="0 1 0"/><limit lower="-1.5" upper="1.25" effort="77" '
        'velocity="3"/><dynamics damping="0.5" friction="0.25"/></joint></robot>'
    )
    kwargs = json.dumps({"robot": str(tmp_path / "rod.urdf"), "armature": 0.125, "disturbances": {"encoder_bits": 20}})
    figure = tmp_path / "eigenvalues.svg"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        text = told("--env", ID, "--env-kwargs", kwargs, "--figure", str(figure))
    for number in ("swing", "-1.5", "1.25", "77", "0.5", "0.25", "0.125", "Encoders of 20 bits"):
        assert number in text
    ET.parse(figure)
    found = json.loads(told("--env", ID, "--env-kwargs", kwargs, "--period", "0.002", "--json"))
    (joint,) = found["joints"]
    assert joint["limits"] == [-1.5, 1.25]
    assert joint["m_bar"] == pytest.approx(0.225)  # a single joint: its inertia and its rotor's
    assert found["period_s"] == 0.002


def test_other_environments_are_designed_as_their_robots() -> None:
    assert told("--env", "BipedWalk-Payload-v0", "--env-kwargs", '{"actuator_inertia": "lumped"}') == told(
        "--actuator-inertia", "lumped"
    )
    for words in (["--env", ID, "--robot", "arm"], ["--env", ID, "--law", "pid"], ["--env", "CartPole-v1"]):
        assert CliRunner().invoke(app, ["design", *words]).exit_code != 0
