"""Metrics on made-up signals whose answer is known by hand, in one block or in many."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from artde_gym.disturbances.kinds import NEVER
from artde_gym.evaluation.metrics import Metrics, events_of
from artde_gym.layout import Layout
from artde_gym.metrics_spec import MetricsSpec
from artde_gym.robots.ojas import task as biped_task
from artde_gym.robots.q450 import task as quadrotor_task

pytestmark = pytest.mark.once

Signals = dict[str, np.ndarray]
BIPED = biped_task.METRICS_SPEC, biped_task.OBSERVATION
QUADROTOR = quadrotor_task.METRICS_SPEC, quadrotor_task.OBSERVATION


def blank(layout: Layout, samples: int) -> Signals:
    """Observations of one episode that are all zero, the rotation matrix excepted."""
    fields = {field.name: np.zeros((samples, field.size)) for field in layout.fields}
    if "rot_body_to_world" in fields:
        fields["rot_body_to_world"][:] = np.eye(3).ravel()
    return fields


def measure(
    robot: tuple[MetricsSpec, Layout],
    fields: Signals,
    diagnostics: Signals | None = None,
    period: float = 0.001,
    **kwargs: Any,
) -> dict[str, Any]:
    """Metrics of one whole episode."""
    metrics = Metrics(*robot, period, [9.0], [kwargs.pop("events", {})], **kwargs)
    last = len(fields["phase"]) - 1
    metrics.add(0, {name: values[:-1, None] for name, values in fields.items()}, many(diagnostics or {}))
    metrics.add(last, {name: values[-1:, None] for name, values in fields.items()}, None)
    return metrics.rows()[0]


def many(signals: Signals) -> Signals:
    return {name: values[:, None] for name, values in signals.items()}


# ---------------------------------------------------------------- biped


def walk(error: np.ndarray, **given_fields: np.ndarray) -> Signals:
    """Observations whose joint error is given and all else is zero."""
    fields = blank(biped_task.OBSERVATION, len(error)) | given_fields
    return fields | {"q_ref": fields["q"] + error}


def test_tracking_metrics_of_a_sine() -> None:
    time = 0.001 * np.arange(10_001)  # ten whole periods
    error = np.zeros((len(time), 12))
    error[:, 6] = np.radians(2.0) * np.sin(2 * np.pi * time)
    row = measure(BIPED, walk(error))
    assert row["rmse_deg_q1"] == pytest.approx(2 / np.sqrt(2), rel=1e-4)
    assert row["max_abs_error_deg_q1"] == pytest.approx(2.0)
    assert row["rmse_deg_q2"] == 0
    assert row["rmse_deg"] == pytest.approx(2 / np.sqrt(2 * 12), rel=1e-4)
    mean_error = 2 * (2 / np.pi) / 12
    assert row["iae_deg_s"] == pytest.approx(10 * mean_error, rel=1e-3)
    assert row["itae_deg_s2"] == pytest.approx(10 * 5 * mean_error, rel=1e-2)


def test_effort_metrics_by_hand() -> None:
    samples = 1001  # one second
    torque = np.zeros((samples, 12))
    torque[1:, 6] = 3.0
    torque[1::2, 7] = 40.0  # saturated in every other sample, switching 40 Nm each time
    qd = np.zeros((samples, 12))
    qd[:, 6] = 0.5
    forward = np.zeros((samples, 3))
    forward[:, 0] = 0.2
    row = measure(BIPED, walk(np.zeros((samples, 12)), tau_applied=torque, qd=qd, base_velocity=forward))
    assert row["rms_torque_nm_q1"] == pytest.approx(3.0)
    assert row["rms_torque_nm_q2"] == pytest.approx(40 / np.sqrt(2))
    assert row["saturation"] == pytest.approx(0.5)
    assert row["energy_j"] == pytest.approx(3.0 * 0.5 * 1.0)
    assert row["cost_of_transport"] == pytest.approx(1.5 / (9.0 * 9.81 * 0.2), rel=2e-3)
    assert row["torque_variation_nm_s"] == pytest.approx(999 * 40 / 12)
    assert np.isnan(row["tde_error_rms"])
    sigma = {"sigma": np.full((10, 12), 3.0)}  # at a rate of its own
    assert measure(BIPED, walk(np.zeros((samples, 12))), sigma)["tde_error_rms"] == pytest.approx(3.0)


def test_phases_one_by_one() -> None:
    error = np.zeros((101, 12))
    error[:50, 6], error[50:, 6] = np.radians(1.0), np.radians(3.0)
    phases = ((0.0, 0.05), (0.05, np.inf), (0.2, np.inf))
    row = measure(BIPED, walk(error, tau_applied=np.ones((101, 12))), phases=phases)
    assert row["rmse_deg_phase1_q1"] == pytest.approx(1.0)
    assert row["max_abs_error_deg_phase2_q1"] == pytest.approx(3.0)
    assert row["rms_torque_nm_phase2_q1"] == 1.0
    for metric in ("rmse_deg", "max_abs_error_deg", "rms_torque_nm"):
        assert np.isnan(row[f"{metric}_phase3_q1"])  # not reached


def test_recovery_and_peak_of_a_push() -> None:
    error = np.zeros((1000, 12))
    error[201:350] = np.radians(2.0)  # pushed from 2.0 to 2.2 s, back in the band at 3.5 s
    error[250] = np.radians(3.0)

    def row(samples: int = 1000) -> dict[str, Any]:
        return measure(BIPED, walk(error[:samples]), period=0.01, events={"push0": (2.0, 2.2)})

    assert row()["recovery_time_s_push0"] == pytest.approx(1.3)
    assert row()["peak_error_deg_push0"] == pytest.approx(3.0)
    error[400] = np.radians(2.0)  # a relapse within the second that it has to hold
    assert row()["recovery_time_s_push0"] == pytest.approx(1.81)
    assert np.isnan(row(440)["recovery_time_s_push0"])  # the rest is too short to say that it held
    assert row(401)["recovery_time_s_push0"] == np.inf  # it ends outside
    error[430] = np.radians(9.0)  # later than 2 s after the push: not of the push
    assert row()["peak_error_deg_push0"] == pytest.approx(3.0)
    error[100] = np.radians(2.5)  # as large before
    assert row()["recovery_time_s_push0"] == pytest.approx(0.31)
    error[201:] = 0.0
    assert np.isnan(row(270)["recovery_time_s_push0"])  # half a second is all there is
    assert row(330)["recovery_time_s_push0"] == 0
    error[201:] = np.radians(4.0)
    assert row()["recovery_time_s_push0"] == np.inf
    assert np.isnan(row(150)["recovery_time_s_push0"])
    assert np.isnan(row(150)["peak_error_deg_push0"])


def test_events_are_pushes_and_a_drop() -> None:
    push = {"start": 1.0, "duration": 0.2}
    payload = {"mass": 1.0, "attach_time": 0.0, "detach_time": 35.0}
    assert events_of({"push": [push, push | {"start": 3.0}], "payload": payload}) == {
        "push0": (1.0, 1.2),
        "push1": (3.0, 3.2),
        "drop": (35.0, 35.0),
    }
    assert events_of({"payload": payload | {"detach_time": NEVER}}) == {}
    assert events_of({"payload": payload | {"attach_time": 40.0}}) == {}
    assert events_of({}) == {}


# ---------------------------------------------------------------- quadrotor


def flight(error: np.ndarray, **given_fields: np.ndarray) -> Signals:
    """Observations whose position error is given and all else is zero."""
    fields = blank(quadrotor_task.OBSERVATION, len(error)) | given_fields
    return fields | {"position_ref": fields["position"] + error}


def test_position_errors_by_axis_and_in_space() -> None:
    error = np.zeros((1001, 3))
    error[:] = [0.03, 0.0, -0.04]
    error[500, 1] = 0.5
    row = measure(QUADROTOR, flight(error), period=0.015)
    assert row["rmse_m_x"] == pytest.approx(0.03)
    assert row["max_abs_error_m_z"] == pytest.approx(0.04)
    assert row["max_abs_error_m_y"] == 0.5
    assert row["rmse_m"] == pytest.approx(np.hypot(0.05, 0.5 / np.sqrt(1001)))
    assert row["iae_m_s"] == pytest.approx(0.015 * (999 * 0.05 + np.hypot(0.05, 0.5)))


def test_attitude_errors_are_the_policys_or_those_of_the_heading() -> None:
    samples, yaw = 101, 3.1
    turned = np.tile(
        np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]]).ravel(), (samples, 1)
    )
    fields = flight(np.zeros((samples, 3)), rot_body_to_world=turned, yaw_ref=np.full((samples, 1), -3.1))
    row = measure(QUADROTOR, fields)
    assert np.isnan(row["rmse_deg_phi"])
    assert np.isnan(row["max_abs_error_deg_theta"])
    assert row["rmse_deg_psi"] == pytest.approx(np.degrees(2 * np.pi - 6.2))  # the short way round
    own = np.zeros((samples - 1, 3))  # at each decision; there is none at the last observation
    own[:, 0], own[7, 1] = 0.1, -0.3
    row = measure(QUADROTOR, fields, {"attitude_error": own})
    assert row["rmse_deg_phi"] == pytest.approx(np.degrees(0.1))
    assert row["max_abs_error_deg_theta"] == pytest.approx(np.degrees(0.3))
    assert row["rmse_deg_psi"] == 0


def test_effort_of_rotors() -> None:
    samples = 101
    wrench = np.zeros((samples, 4))
    wrench[0] = 99.0  # before the episode
    wrench[1:, 0], wrench[1::2, 2] = 15.0, 0.2
    thrust = np.full((samples, 4), 4.0)
    thrust[1::2, 3] = 8.45  # within a hundredth of the range from its limit
    fields = flight(np.zeros((samples, 3)), wrench_applied=wrench, rotor_thrust=thrust)
    inside = {"sigma_p": np.full((100, 3), 2.0), "c_q": np.linspace(0.0, 1.0, 100)}
    row = measure(QUADROTOR, fields, inside, period=0.01)
    assert row["rms_thrust_n_u1"] == pytest.approx(15.0)
    assert row["rms_torque_nm_u3"] == pytest.approx(0.2 / np.sqrt(2))
    assert row["rms_torque_nm_u2"] == row["thrust_variation_n_s"] == 0
    assert row["torque_variation_nm_s"] == pytest.approx(99 * 0.2 / 3)
    assert row["saturation"] == 0.5
    ideal = 4.0**1.5 / np.sqrt(2 * 1.225 * np.pi * 0.127**2)  # W, momentum theory for one rotor
    loud = 8.45**1.5 / np.sqrt(2 * 1.225 * np.pi * 0.127**2)
    assert row["energy_j"] == pytest.approx(3 * ideal + (ideal + loud) / 2)
    assert row["tde_error_rms_p"] == 2.0
    assert np.isnan(row["tde_error_rms_q"])
    assert row["robust_gain_mean_q"] == pytest.approx(0.5)
    assert np.isnan(row["robust_gain_mean_p"])
    assert "cost_of_transport" not in row


def test_drop_of_the_payload() -> None:
    error = np.zeros((1001, 3))
    error[301:400, 2] = 0.3 * np.exp(-0.05 * np.arange(99))  # 2 cm after ln(15) / 0.05 = 54.2 samples
    row = measure(QUADROTOR, flight(error), period=0.01, events={"drop": (3.0, 3.0)})
    assert row["peak_error_m_drop"] == pytest.approx(0.3)
    assert row["recovery_time_s_drop"] == pytest.approx(0.56)


# ---------------------------------------------------------------- blocks and episodes side by side


@given(cuts=st.lists(st.integers(1, 59), max_size=6), seed=st.integers(0, 3))
def test_blocks_do_not_matter(cuts: list[int], seed: int) -> None:
    rng = np.random.default_rng(seed)
    fields = {
        name: rng.normal(size=(60, 2, values.shape[1])) for name, values in blank(quadrotor_task.OBSERVATION, 1).items()
    }
    inside = {"attitude_error": rng.normal(size=(60, 2, 3)), "sigma_p": rng.normal(size=(60, 2, 3))}
    events = [{"drop": (2.0, 2.0), "push0": (0.5, 0.7)}, {"drop": (2.5, 2.5), "push0": (3.0, 3.3)}]

    def rows(edges: list[int]) -> list[dict[str, Any]]:
        metrics = Metrics(*QUADROTOR, 0.1, [1.5, 1.5], events, phases=((0.0, 3.0), (3.0, np.inf)))
        for start, stop in itertools.pairwise(edges):
            now, policy = (
                {name: values[start:stop] for name, values in signals.items()} for signals in (fields, inside)
            )
            metrics.add(start, now, policy)
        return metrics.rows()

    for one, other in zip(rows([0, 60]), rows(sorted({0, 60, *cuts})), strict=True):
        assert one == pytest.approx(other, rel=1e-12, nan_ok=True)


def test_episodes_side_by_side_are_as_if_alone() -> None:
    """One of three crashes at its 20th sample; what stands in its place from then on counts for nothing."""
    rng = np.random.default_rng(0)
    n, samples, crash = 3, 50, 20
    fields = {
        name: rng.normal(size=(samples, n, values.shape[1]))
        for name, values in blank(quadrotor_task.OBSERVATION, 1).items()
    }
    own = rng.normal(size=(samples, n, 3))
    events = [{"drop": (1.0, 1.0)}, {"drop": (1.5, 1.5)}, {}]
    together = Metrics(*QUADROTOR, 0.1, [1.5] * n, events)
    last = [samples - 1, crash, samples - 1]  # the final observation of each
    for k in range(samples):
        live = np.array([k <= end for end in last])
        if k > crash:
            for values in fields.values():
                values[k, 1] = np.nan
        block = {name: values[k : k + 1] for name, values in fields.items()}
        together.add(k, block, {"attitude_error": own[k : k + 1]}, live)
    for i, (row, end) in enumerate(zip(together.rows(), last, strict=True)):
        alone = Metrics(*QUADROTOR, 0.1, [1.5], [events[i]])
        block = {name: values[: end + 1, i : i + 1] for name, values in fields.items()}
        alone.add(0, block, {"attitude_error": own[: end + 1, i : i + 1]})
        expected = alone.rows()[0]
        assert {name: row[name] for name in expected} == pytest.approx(expected, rel=1e-12, nan_ok=True)
        assert all(np.isnan(row[name]) for name in row.keys() - expected.keys())
