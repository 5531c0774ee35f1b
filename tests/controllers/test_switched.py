"""The laws that switch with the support phase: a switch by hand, batches, lying contact flags, and refusals."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import controllers
from artde_gym.errors import OptionError
from artde_gym.evaluation.seeds import episode_seed
from artde_gym.robots.ojas.task import OBSERVATION
from artde_gym.scenarios import SCENARIOS
from controllers.drive import DRIVES
from controllers.joint_space import LawPolicy
from controllers.law_table import LAWS
from controllers.laws.errors import GainError
from controllers.laws.switched import PHASES, SupportState, nominal_inertia, support_phase
from controllers.laws.tracking import JointInput
from controllers.policies import ControlInterface

pytestmark = pytest.mark.once

NAMES = ("tde-switched", "atde-switched", "artde-switched")
ADAPTIVE = {"atde-switched": ("c",), "artde-switched": ("beta_0", "beta_1")}
PERIOD = 0.004
LEFT, BOTH, RIGHT, NONE = (np.array(flags, dtype=np.float64) for flags in ((1, 0), (1, 1), (0, 1), (0, 0)))
every_law = pytest.mark.parametrize("name", NAMES)


def preset(name: str, **changes: Any) -> Any:
    return dataclasses.replace(DRIVES["ojas"].presets[name, "support"].gains, **changes)


def random_signals(seed: int, *shape: int) -> list[JointInput]:
    return [JointInput(*sample) for sample in np.random.default_rng(seed).normal(size=(*shape[:1], 6, *shape[1:], 12))]


def run(name: str, gains: Any, samples: list[JointInput], contacts: Any) -> list[tuple[np.ndarray, Any]]:
    """Force and state after each sample."""
    law, found = LAWS[name].law, []
    state = law.start(gains, samples[0], PERIOD)
    for signals, contact in zip(samples, contacts, strict=True):
        tau, state = law.step(gains, state, signals, PERIOD, np.asarray(contact, dtype=signals.q.dtype))
        found.append((tau, state))
    return found


def leaves(state: Any) -> list[np.ndarray]:
    return [leaf for part in state for leaf in leaves(part)] if isinstance(state, tuple) else [state]


# ------------------------------------------------------------------------------------------------------------- a switch


@every_law
@pytest.mark.parametrize(("before", "after"), [(BOTH, LEFT), (BOTH, RIGHT), (LEFT, BOTH), (RIGHT, LEFT), (LEFT, NONE)])
def test_a_switch_changes_the_force_by_the_inertia_times_u_less_a_alone(name, before, after) -> None:
    """No memory is reset: whatever else the law knows is as if it had not switched, adaptive gains included."""
    gains = preset(name, dwell=0.0, blend=0.0, **({"gamma_0": 0.0} if name in ADAPTIVE else {}))
    gains = dataclasses.replace(gains, gamma_1=0.0) if name == "artde-switched" else gains
    samples = random_signals(1, 6)
    stays = run(name, gains, samples, [before] * 6)
    switches = run(name, gains, samples, [before] * 5 + [after])
    (tau, state), (other, switched) = stays[-1], switches[-1]
    tde, same = (one.law if name == "tde-switched" else one.law.tde for one in (state, switched))
    previous = stays[-2][1].law if name == "tde-switched" else stays[-2][1].law.tde
    a = (samples[-1].qd - previous.qd) / PERIOD
    m_1, m_2 = (nominal_inertia(gains, one.support.blend, 12) for one in (state, switched))
    np.testing.assert_allclose(other - tau, (m_2 - m_1) @ (tde.u - a), rtol=1e-9, atol=1e-9)
    for mine, theirs in zip(leaves(same), leaves(tde), strict=True):
        np.testing.assert_array_equal(mine, theirs)


@every_law
def test_at_equal_inertias_it_is_its_law_bit_for_bit_but_for_gains_of_their_own(name) -> None:
    """With m_bar a number for all phases and one phase throughout, nothing is left of the switching."""
    gains = preset(name, m_bar=0.05, m_bar_left=0.05, m_bar_right=0.05)
    base = name.removesuffix("-switched")
    fields = {field.name for field in dataclasses.fields(DRIVES["ojas"].presets[base, "thesis"].gains)}
    plain = DRIVES["ojas"].presets[base, "thesis"].gains.__class__(**{one: getattr(gains, one) for one in fields})
    samples, law = random_signals(2, 8), LAWS[base].law
    state = law.start(plain, samples[0], PERIOD)
    for signals, (tau, own) in zip(samples, run(name, gains, samples, [BOTH] * 8), strict=True):
        expected, state = law.step(plain, state, signals, PERIOD)
        np.testing.assert_array_equal(tau, expected)
        for mine, theirs in zip(leaves(own.law), leaves(state), strict=True):
            np.testing.assert_array_equal(mine, theirs)


@pytest.mark.parametrize("name", ADAPTIVE)
def test_adaptive_gains_belong_to_a_phase(name) -> None:
    gains = preset(name, dwell=0.0, blend=0.0)
    samples = random_signals(3, 30)
    found = run(name, gains, samples, [LEFT] * 10 + [BOTH] * 10 + [LEFT] * 10)
    for field in ADAPTIVE[name]:
        values = [float(getattr(state.law, field)) for _, state in found]
        kept = [getattr(state.kept, f"kept_{field}") for _, state in found]
        start = gains.c_start if field == "c" else gains.beta_start
        assert kept[0][PHASES.index(1.0)] == start  # of the phase as it was entered; the law's own is ahead of it
        assert kept[10][PHASES.index(1.0)] == values[9] != start
        assert kept[20][PHASES.index(0.0)] == values[19]
        # back on the left foot it goes on from where it was left
        signals, law = samples[20], found[20][1].law
        xi = np.sqrt(np.sum((signals.q_ref - signals.q) ** 2) + np.sum((signals.qd_ref - signals.qd) ** 2))
        step = PERIOD * 500.0 * np.sqrt(law.s @ law.s) * (xi if field == "beta_1" else 1.0)
        assert abs(values[20] - values[9]) == pytest.approx(step, rel=1e-9)


def test_the_phase_waits_and_the_inertia_blends() -> None:
    gains = preset("tde-switched", dwell=0.02, blend=0.06)
    zero = np.zeros(())
    state, phases, blends = SupportState(zero, zero, zero, zero), [], []
    for contact in [BOTH] * 3 + [LEFT] * 4 + [BOTH] + [LEFT] * 30 + [RIGHT] * 60:
        state = support_phase(gains, state, contact, PERIOD)
        phases.append(float(state.phase))
        blends.append(float(state.blend))
    # a touch of 16 ms is none; the longer one counts from 20 ms on
    assert phases[:13] == [0.0] * 13
    assert phases[13:43] == [1.0] * 30
    assert phases[43:] == [-1.0] * 55
    assert blends[27] == pytest.approx(1.0)
    np.testing.assert_allclose(np.diff(blends[12:28]), PERIOD / 0.06, rtol=1e-9)
    np.testing.assert_allclose(np.diff(blends[42:73]), -PERIOD / 0.06, rtol=1e-9)
    left, both, right = gains.matrices(12, np.dtype(np.float64))
    halfway, quarter = 0.5 * (left + both), 0.25 * right + 0.75 * both
    for b, matrix in ((1.0, left), (0.0, both), (-1.0, right), (0.5, halfway), (-0.25, quarter)):
        np.testing.assert_allclose(nominal_inertia(gains, np.array(b), 12), matrix, rtol=1e-15)


# ------------------------------------------------------------------------------------------------------------- batches


@every_law
@settings(max_examples=6)
@given(seed=st.integers(0, 2**32 - 1), batch=st.sampled_from([(1,), (5,), (2, 3)]), narrow=st.booleans())
def test_batch_equals_loop_bit_for_bit_with_flags_that_chatter(name, seed, batch, narrow) -> None:
    rng = np.random.default_rng(seed)
    gains = preset(name, dwell=float(rng.choice([0.0, 0.004, 0.02])), blend=float(rng.choice([0.0, 0.06])))
    dtype = np.float32 if narrow else np.float64
    samples = [JointInput(*(part.astype(dtype) for part in one)) for one in random_signals(seed % 1000, 25, *batch)]
    contacts = np.repeat(rng.integers(0, 2, size=(9, *batch, 2)), 3, axis=0)[:25]
    contacts[rng.uniform(size=25) < 0.2] ^= 1
    together = run(name, gains, samples, contacts)
    for index in np.ndindex(*batch):
        alone = run(
            name,
            gains,
            [JointInput(*(part[index] for part in one)) for one in samples],
            [contact[index] for contact in contacts],
        )
        for (many, whole), (one, own) in zip(together, alone, strict=True):
            np.testing.assert_array_equal(many[index], one, strict=True)
            for mine, theirs in zip(leaves(whole), leaves(own), strict=True):
                assert mine.dtype == dtype
                np.testing.assert_array_equal(mine[index], theirs, strict=True)


@every_law
def test_inputs_and_state_are_left_alone(name) -> None:
    gains = preset(name, dwell=0.0)
    samples, contacts = random_signals(4, 3), np.array([LEFT, RIGHT, BOTH])
    kept = [np.copy(leaf) for sample in samples for leaf in sample]
    found = run(name, gains, samples, contacts)
    state = found[1][1]
    before = [np.copy(leaf) for leaf in leaves(state)]
    LAWS[name].law.step(gains, state, samples[2], PERIOD, contacts[2])
    for leaf, copy in zip([leaf for sample in samples for leaf in sample] + leaves(state), kept + before, strict=True):
        np.testing.assert_array_equal(leaf, copy)


# --------------------------------------------------------------------------------------------------- gains and policies


@every_law
@pytest.mark.parametrize("field", ["m_bar_left", "m_bar_right"])
def test_each_inertia_is_positive_definite_and_fits_the_others(name, field) -> None:
    for value in (-1.0, [[1.0, 2.0], [2.0, 1.0]], "0.08", [[0.1, 0.0], [0.0, 0.1]]):
        with pytest.raises(GainError, match="m_bar_left" if isinstance(value, list) and value[0][1] == 0 else field):
            preset(name, **{field: value})
    for time in ("dwell", "blend"):
        with pytest.raises(GainError, match=time):
            preset(name, **{time: -0.01})


@every_law
def test_it_needs_observed_contact(name) -> None:
    with gym.make("QuadInfinity-Payload-v0") as env, pytest.raises(OptionError, match=r"contact.*BipedWalk"):
        LawPolicy(name, ControlInterface.of(env), preset(name))


def make(n: int, **kwargs: Any) -> Any:
    return gym.make_vec("BipedWalk-Payload-v0", n, "vector_entry_point", engine="mujoco", **kwargs).unwrapped


@every_law
def test_phase_and_blend_are_among_the_diagnostics(name) -> None:
    env = make(2, duration=0.3, disturbances={})
    policy = controllers.make(name, env)
    observation, _ = env.reset(seed=0)
    observation[1, OBSERVATION["contact"]] = RIGHT
    state = None
    for _ in range(50):
        _, state = policy.predict(observation, state)
    known = policy.diagnostics(state)
    assert known["phase"].tolist() == [0.0, -1.0]
    assert known["blend"][0] == 0.0
    assert -1.0 <= known["blend"][1] < 0.0
    assert {"sigma", "candidate", "held"} <= known.keys()


# ------------------------------------------------------------------------------------------------------ flags that lie


def late(samples: int) -> Callable[[np.ndarray], np.ndarray]:
    seen: list[np.ndarray] = []

    def change(contact: np.ndarray) -> np.ndarray:
        seen.append(contact.copy())
        return seen[max(0, len(seen) - 1 - samples)]

    return change


LIES: dict[str, Callable[[], Callable[[np.ndarray], np.ndarray]]] = {
    "left always on": lambda: lambda contact: np.maximum(contact, LEFT),
    "left never on": lambda: lambda contact: contact * RIGHT,
    "both always on": lambda: lambda contact: np.ones_like(contact),
    "12 ms late": lambda: late(3),
    "20 ms late": lambda: late(5),
}


@pytest.mark.parametrize("lie", LIES)
def test_lying_contact_flags_do_not_topple_it(lie) -> None:
    """Two steps of S1 at 4 ms; `scripts/switching.py flags` walks 20 s."""
    env = make(2, duration=4.5, control_period=0.004, disturbances=SCENARIOS["S1-L4"].disturbances)
    policy, change, state = controllers.make("artde-switched", env), LIES[lie](), None
    observation, _ = env.reset(seed=[episode_seed(3, i) for i in range(2)])
    for _ in range(1100):
        seen = observation.copy()
        seen[:, OBSERVATION["contact"]] = change(seen[:, OBSERVATION["contact"]])
        action, state = policy.predict(seen, state)
        observation, _, terminated, *_ = env.step(action)
        assert not terminated.any()
