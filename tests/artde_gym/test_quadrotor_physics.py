"""The quadrotor's motion and each of its disturbances by their physics, in each engine and in the batch alike."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from artde_gym.disturbances.ground_effect import thrust_gain
from artde_gym.disturbances.schedule import EVENTS
from artde_gym.robots.q450 import model as q450

pytestmark = pytest.mark.once

ID = "QuadInfinity-Payload-v0"
G = 9.81
WEIGHT = q450.MASS * G
DAMPING = q450.DRAG / q450.MASS  # 1/s
PAYLOAD = 0.35
HOVER = np.array([WEIGHT, 0.0, 0.0, 0.0])


def hover(x: float, y: float = 0.0, z: float = 0.0) -> np.ndarray:
    """The wrench that carries the vehicle and turns it."""
    return np.array([WEIGHT, x, y, z])


EVERY_KIND = pytest.mark.parametrize("kind", ["bullet", "mujoco", "batch"])


class Flight:
    """One vehicle, in an engine or in the batch, where it is the second of three."""

    def __init__(self, kind: str, disturbances: dict[str, Any], **kwargs: Any) -> None:
        arguments: dict[str, Any] = {"disturbances": disturbances, "control_period": 0.005, **kwargs}
        self.batch = kind == "batch"
        if self.batch:
            self.env: Any = gym.make_vec(ID, num_envs=3, engine="numpy", **arguments)
        else:
            self.env = gym.make(ID, disable_env_checker=True, engine=kind, **arguments).unwrapped
        self.period: float = self.env.control_period
        self.layout = self.env.observation_layout

    def reset(self, seed: int = 0) -> dict[str, np.ndarray]:
        observation, self.info = self.env.reset(seed=[seed + 1, seed, seed + 2] if self.batch else seed)
        return self._fields(observation)

    def step(self, action: np.ndarray) -> dict[str, np.ndarray]:
        observation, _, terminated, _, self.info = self.env.step(np.tile(action, (3, 1)) if self.batch else action)
        self.terminated = bool(terminated[1] if self.batch else terminated)
        return self._fields(observation)

    def fly(self, action: np.ndarray, duration: float) -> dict[str, np.ndarray]:
        """Fields over time, the present not included; (samples, size) each."""
        fields = [self.step(action) for _ in range(round(duration / self.period))]
        return {name: np.array([field[name] for field in fields]) for name in self.layout.slices}

    def _fields(self, observation: np.ndarray) -> dict[str, np.ndarray]:
        return self.layout.split(observation[1] if self.batch else observation)


def relaxation(speed: float, time: float) -> tuple[float, float]:
    """Velocity and way under m v' = k (speed - v) from rest."""
    share = -math.expm1(-DAMPING * time)
    return speed * share, speed * (time - share / DAMPING)


# ------------------------------------------------------------------------------------------------------ without payload


@EVERY_KIND
def test_it_hovers_where_it_starts(kind: str) -> None:
    flight = Flight(kind, {})
    start = flight.reset()
    np.testing.assert_allclose(start["wrench_applied"], HOVER, atol=1e-12)
    np.testing.assert_allclose(start["rotor_thrust"], WEIGHT / 4)
    end = flight.fly(HOVER, 2.0)
    np.testing.assert_allclose(end["position"], np.tile([0.0, 0.0, 0.6], (400, 1)), rtol=0, atol=1e-9)
    np.testing.assert_allclose(end["rot_body_to_world"][-1], np.eye(3).ravel(), rtol=0, atol=1e-9)


@EVERY_KIND
def test_it_falls_freely_but_for_drag_once_the_rotors_stop(kind: str) -> None:
    flight = Flight(kind, {"motor_lag": 0.0})
    flight.reset()
    fall = flight.fly(np.zeros(4), 0.25)
    velocity, way = relaxation(-G / DAMPING, 0.25)
    assert fall["velocity"][-1, 2] == pytest.approx(velocity, rel=1e-3)
    assert fall["position"][-1, 2] - 0.6 == pytest.approx(way, rel=0.006)
    assert np.abs(fall["body_rates"]).max() < 1e-12


@EVERY_KIND
def test_torque_turns_it_by_its_inertia(kind: str) -> None:
    flight = Flight(kind, {"motor_lag": 0.0})
    flight.reset()
    torque = np.array([0.02, -0.01, 0.03])
    end = flight.fly(hover(*torque), 0.05)
    np.testing.assert_allclose(end["wrench_applied"][-1], hover(*torque), atol=1e-12)
    np.testing.assert_allclose(end["body_rates"][-1], 0.05 * torque / q450.INERTIA, rtol=5e-3)


@EVERY_KIND
@pytest.mark.parametrize("constant", [None, 0.1])
def test_thrust_follows_its_command_as_a_lag(kind: str, constant: float | None) -> None:
    flight = Flight(kind, {} if constant is None else {"motor_lag": constant}, control_period=0.015)
    flight.reset()
    time_constant = constant or q450.ROTOR_LAG
    fields = flight.fly(np.array([20.0, 0.0, 0.0, 0.0]), 0.15)
    time = 0.015 * np.arange(1, 11)
    np.testing.assert_allclose(
        fields["rotor_thrust"].sum(axis=1), 20.0 + (WEIGHT - 20.0) * np.exp(-time / time_constant), rtol=1e-12
    )
    gap = time_constant / 0.015 * (np.exp(-(time - 0.015) / time_constant) - np.exp(-time / time_constant))
    np.testing.assert_allclose(fields["wrench_applied"][:, 0], 20.0 + (WEIGHT - 20.0) * gap, rtol=1e-12)


# ---------------------------------------------------------------------------------------------------------------- push


@EVERY_KIND
@pytest.mark.parametrize(("start", "duration"), [(0.05, 0.2), (0.0517, 0.1983)])
def test_a_push_gives_its_momentum(kind: str, start: float, duration: float) -> None:
    force = np.array([1.0, -2.0, 0.5])
    push = {
        "magnitude": float(np.linalg.norm(force)),
        "direction": force.tolist(),
        "start": start,
        "duration": duration,
    }
    flight = Flight(kind, {"push": [push]})
    flight.reset()
    fields = flight.fly(HOVER, 0.3)
    coasting = math.exp(-DAMPING * (0.3 - start - duration))
    velocity, _ = relaxation(1.0 / q450.DRAG, duration)
    np.testing.assert_allclose(fields["velocity"][-1], force * velocity * coasting, rtol=2e-3)
    assert np.abs(fields["velocity"][: math.floor(start / 0.005) - 1]).max() < 1e-9
    assert np.abs(fields["body_rates"]).max() < 1e-9


@EVERY_KIND
def test_a_push_on_a_rotor_turns_it(kind: str) -> None:
    push = {"body": "front_left", "magnitude": 0.4, "direction": [0, 0, -1], "start": 0.01, "duration": 0.05}
    flight = Flight(kind, {"push": [push]})
    flight.reset()
    end = flight.fly(HOVER, 0.07)
    moment = np.cross(q450.ROTOR_PLACES[0], [0.0, 0.0, -0.4])
    np.testing.assert_allclose(end["body_rates"][-1], 0.05 * moment / q450.INERTIA, rtol=5e-3, atol=2e-3)


@EVERY_KIND
def test_pushes_add_up_and_are_told(kind: str) -> None:
    pushes = [
        {"magnitude": 1.0, "direction": [1, 0, 0], "start": 0.05, "duration": 0.1},
        {"magnitude": 1.0, "direction": [1, 0, 0], "start": 0.10, "duration": 0.1},
    ]
    flight = Flight(kind, {"push": pushes})
    flight.reset()
    told, fields = [], {}
    for period in range(50):
        fields = flight.step(HOVER)
        told += [(period, name) for name in EVENTS if np.ravel(flight.info[name])[-1]]
    assert told == [(10, "push_begins"), (20, "push_begins"), (30, "push_ends"), (40, "push_ends")]
    assert fields["velocity"][0] == pytest.approx(0.2 / q450.MASS, rel=0.03)


# ------------------------------------------------------------------------------------------------------------- payload


def loaded(**more: Any) -> dict[str, Any]:
    return {"payload": {"mass": PAYLOAD, **more}}


@EVERY_KIND
def test_it_starts_in_balance_with_the_payload(kind: str) -> None:
    flight = Flight(kind, loaded(position=[0.01, -0.02, -0.1]))
    start = flight.reset()
    expected = [(q450.MASS + PAYLOAD) * G, -0.02 * PAYLOAD * G, -0.01 * PAYLOAD * G, 0.0]
    np.testing.assert_allclose(start["wrench_applied"], expected, atol=1e-12)
    end = flight.fly(start["wrench_applied"], 0.5)
    # level flight with a load that hangs is stable only by luck: rounding grows, hence half a second
    np.testing.assert_allclose(end["position"], np.tile([0.0, 0.0, 0.6], (100, 1)), rtol=0, atol=1e-5)
    assert np.abs(end["body_rates"]).max() < 1e-4


@EVERY_KIND
def test_without_the_payloads_moment_it_pitches_about_the_common_center(kind: str) -> None:
    flight = Flight(
        kind,
        loaded(
            position=[0.05, 0.0, 0.0],
        )
        | {"motor_lag": 0.0},
    )
    flight.reset()
    total = (q450.MASS + PAYLOAD) * G
    end = flight.fly(np.array([total, 0.0, 0.0, 0.0]), 0.03)
    share = PAYLOAD / (q450.MASS + PAYLOAD)
    inertia = q450.INERTIA[1] + q450.MASS * share * 0.05**2 + 0.4 * PAYLOAD * 0.08**2
    moment = share * 0.05 * total  # of the thrust about the common center of mass
    assert end["body_rates"][-1, 1] == pytest.approx(0.03 * moment / inertia, rel=0.02)


@EVERY_KIND
def test_a_dropped_payload_sets_the_vehicle_free_without_a_jerk(kind: str) -> None:
    flight = Flight(kind, loaded(position=[0.0, 0.0, -0.1], detach_time=0.1))
    start = flight.reset()
    before = flight.fly(start["wrench_applied"], 0.1)
    assert not any(np.any(flight.info[name]) for name in EVENTS)
    np.testing.assert_allclose(before["velocity"], 0.0, atol=1e-6)
    after = flight.fly(start["wrench_applied"], 0.2)
    velocity, way = relaxation(PAYLOAD * G / q450.DRAG, 0.2)
    assert after["velocity"][-1, 2] == pytest.approx(velocity, rel=2e-3)
    assert after["position"][-1, 2] - 0.6 == pytest.approx(way, rel=0.01)


@EVERY_KIND
def test_what_moves_goes_on_moving_when_the_payload_goes(kind: str) -> None:
    push = {"body": "front_left", "magnitude": 6.0, "direction": [1, 0.5, 1], "start": 0.1, "duration": 0.1}
    flight = Flight(kind, {**loaded(detach_time=0.25), "push": [push]})
    start = flight.reset()
    fields = flight.fly(start["wrench_applied"], 0.3)
    before, middle, after = 49, 50, 51  # the drop is at 0.25 s, row 49
    rates, velocity = fields["body_rates"], fields["velocity"]
    assert np.linalg.norm(rates[before]) > 1.0
    assert np.linalg.norm(velocity[before]) > 0.1
    # from the very drop on it moves as the bare vehicle does; a jump of velocity would be an acceleration of 5 m/s^2
    thrust, *torque = fields["wrench_applied"][middle]
    up = fields["rot_body_to_world"][middle, 2::3]
    acceleration = thrust / q450.MASS * up - [0.0, 0.0, G] - DAMPING * velocity[middle]
    np.testing.assert_allclose((velocity[after] - velocity[before]) / 0.01, acceleration, rtol=0, atol=0.15)
    spin = (torque - np.cross(rates[middle], q450.INERTIA * rates[middle])) / q450.INERTIA
    np.testing.assert_allclose((rates[after] - rates[before]) / 0.01, spin, rtol=0, atol=0.15)


@EVERY_KIND
def test_a_payload_may_come_later(kind: str) -> None:
    flight = Flight(kind, loaded(position=[0.0, 0.0, -0.1], attach_time=0.1))
    start = flight.reset()
    np.testing.assert_allclose(start["wrench_applied"], HOVER, atol=1e-12)
    fields = flight.fly(HOVER, 0.3)
    np.testing.assert_allclose(fields["velocity"][:20], 0.0, atol=1e-9)
    mass = q450.MASS + PAYLOAD
    rate = q450.DRAG / mass
    assert fields["velocity"][-1, 2] == pytest.approx(-PAYLOAD * G / q450.DRAG * -math.expm1(-rate * 0.2), rel=2e-3)


# ------------------------------------------------------------------------------------------------- air and environment


@EVERY_KIND
def test_a_steady_wind_takes_it_along(kind: str) -> None:
    wind = {"steady": [1.0, -2.0, 0.5], "ambient": 0.0, "fan_speed": 0.0}
    flight = Flight(kind, {"wind": wind})
    flight.reset()
    end = flight.fly(HOVER, 0.5)
    velocity, way = relaxation(1.0, 0.5)
    np.testing.assert_allclose(end["velocity"][-1], np.multiply(wind["steady"], velocity), rtol=2e-3)
    np.testing.assert_allclose(end["position"][-1] - [0, 0, 0.6], np.multiply(wind["steady"], way), rtol=0.01)


@EVERY_KIND
def test_the_fan_blows_along_its_axis_and_harder_on_it(kind: str) -> None:
    wind = {"ambient": 0.0, "turbulence": 0.0, "fan_position": [0.0, 0.0, 0.6], "fan_direction": [0.0, 3.0, 0.0]}
    aside = {**wind, "fan_position": [0.3, 0.0, 0.6]}
    speeds = []
    for disturbance in (wind, aside):
        flight = Flight(kind, {"wind": disturbance})
        flight.reset()
        end = flight.fly(HOVER, 0.3)
        speeds.append(end["velocity"][-1, 1])
        assert np.abs(end["velocity"][-1, [0, 2]]).max() < 1e-9
    assert speeds[0] == pytest.approx(relaxation(4.0, 0.3)[0], rel=2e-3)
    assert speeds[1] == pytest.approx(speeds[0] * math.exp(-0.5), rel=2e-3)


@EVERY_KIND
def test_both_see_the_same_wind_whatever_the_control_period(kind: str) -> None:
    ends = []
    for period in (0.005, 0.015, 0.025):
        flight = Flight(kind, {"wind": {"ambient": 2.0, "fan_speed": 0.0}}, control_period=period)
        flight.reset(seed=5)
        ends.append(flight.fly(HOVER, 0.45)["velocity"][-1])
    assert np.linalg.norm(ends[0]) > 0.05
    np.testing.assert_allclose(ends[1], ends[0], rtol=0, atol=1e-12)
    np.testing.assert_allclose(ends[2], ends[0], rtol=0, atol=1e-12)


@EVERY_KIND
def test_ground_effect_lifts_by_the_published_gain(kind: str) -> None:
    height, strength = 0.3, 8.0
    offset = {"initial_position": {"offset": [0.0, 0.0, height - 0.6]}}
    flight = Flight(kind, {"ground_effect": strength, **offset, "motor_lag": 0.0})
    start = flight.reset()
    gain = thrust_gain(height, q450.ROTOR_RADIUS, strength, max)
    assert gain > 1.05
    np.testing.assert_allclose(start["wrench_applied"], HOVER / gain, atol=1e-12)  # in balance
    end = flight.fly(HOVER, 0.3)

    def fall_upward(_: float, y: np.ndarray) -> list[float]:
        return [y[1], G * (thrust_gain(float(y[0]), q450.ROTOR_RADIUS, strength, max) - 1.0) - DAMPING * y[1]]

    expected = solve_ivp(fall_upward, (0.0, 0.3), [height, 0.0], rtol=1e-9, atol=1e-12).y[:, -1]
    assert end["position"][-1, 2] == pytest.approx(expected[0], abs=1e-3)
    assert end["velocity"][-1, 2] == pytest.approx(expected[1], rel=0.01)
    np.testing.assert_allclose(end["wrench_applied"][-1], HOVER, atol=1e-12)  # without the gain


@EVERY_KIND
def test_ground_effect_rights_a_tilted_vehicle(kind: str) -> None:
    flight = Flight(kind, {"ground_effect": 10.0, "initial_position": {"offset": [0, 0, -0.3]}, "motor_lag": 0.0})
    flight.reset()
    flight.fly(hover(0.5), 0.05)  # roll to the right: left side up
    flight.fly(hover(-0.5), 0.05)
    tilted = flight.step(HOVER)
    assert tilted["rot_body_to_world"][7] > 0.05
    after = flight.fly(HOVER, 0.05)
    assert after["body_rates"][-1, 0] < tilted["body_rates"][0] - 1e-3


# ------------------------------------------------------------------------------------------------ actuators and sensors


@EVERY_KIND
def test_commands_come_late_by_whole_periods(kind: str) -> None:
    flight = Flight(kind, {"action_delay": 3, "motor_lag": 0.0})
    flight.reset()
    thrusts = [flight.step(np.array([15.0 + k, 0.0, 0.0, 0.0]))["wrench_applied"][0] for k in range(6)]
    np.testing.assert_allclose(thrusts, [WEIGHT, WEIGHT, WEIGHT, 15.0, 16.0, 17.0], rtol=1e-12)


@EVERY_KIND
def test_a_rotor_loses_its_share_at_its_time(kind: str) -> None:
    losses = [{"joint": "rear_right", "factor": 0.5, "start": 0.05}, {"joint": "all", "factor": 0.9, "start": 0.1}]
    flight = Flight(kind, {"actuator_effectiveness": losses, "motor_lag": 0.0})
    flight.reset()
    fields = flight.fly(HOVER, 0.15)
    shares = fields["rotor_thrust"] / (WEIGHT / 4)
    np.testing.assert_allclose(shares[:10], 1.0, rtol=1e-12)
    np.testing.assert_allclose(shares[10:20], np.tile([1.0, 1.0, 0.5, 1.0], (10, 1)), rtol=1e-12)
    np.testing.assert_allclose(shares[20:], np.tile([0.9, 0.9, 0.45, 0.9], (10, 1)), rtol=1e-12)
    assert fields["body_rates"][19, 0] > 0.1  # the right side sinks
    np.testing.assert_allclose(fields["wrench_applied"][-1], q450.MIXER @ fields["rotor_thrust"][-1], atol=1e-12)


@EVERY_KIND
def test_mass_error_scales_weight_and_inertia(kind: str) -> None:
    flight = Flight(kind, {"mass_scale": 1.3, "motor_lag": 0.0})
    start = flight.reset()
    np.testing.assert_allclose(start["wrench_applied"], 1.3 * HOVER, atol=1e-12)
    end = flight.fly(1.3 * HOVER + [2.0, 0.02, 0.0, 0.0], 0.05)
    assert end["velocity"][-1, 2] == pytest.approx(2.0 * 0.05 / (1.3 * q450.MASS), rel=0.02)
    assert end["body_rates"][-1, 0] == pytest.approx(0.02 * 0.05 / (1.3 * q450.INERTIA[0]), rel=1e-6)


@EVERY_KIND
def test_it_may_start_elsewhere(kind: str) -> None:
    flight = Flight(kind, {"initial_position": {"offset": [0.1, -0.2, 0.05]}})
    start = flight.reset()
    np.testing.assert_allclose(start["position"], [0.1, -0.2, 0.65], atol=1e-12)
    np.testing.assert_allclose(start["position_ref"], [0.0, 0.0, 0.6], atol=1e-12)
    np.testing.assert_allclose(flight.fly(HOVER, 0.1)["position"][-1], [0.1, -0.2, 0.65], rtol=0, atol=1e-9)


@EVERY_KIND
def test_sensor_noise_has_the_deviations_that_were_asked_for(kind: str) -> None:
    noise = {"position": 0.01, "velocity": 0.2, "tilt": 0.05, "angular_velocity": 0.3}
    noisy, clean = Flight(kind, {"sensor_noise": noise}), Flight(kind, {})
    noisy.reset()
    clean.reset()
    seen, true = noisy.fly(HOVER, 5.0), clean.fly(HOVER, 5.0)  # it hovers: what is seen does not matter
    for name, deviation in (("position", 0.01), ("velocity", 0.2), ("body_rates", 0.3)):
        error = seen[name] - true[name]
        np.testing.assert_allclose(error.std(axis=0), deviation, rtol=0.1)
        assert np.abs(error.mean(axis=0)).max() < 4 * deviation / math.sqrt(len(error))
        assert abs(np.corrcoef(error[:-1, 0], error[1:, 0])[0, 1]) < 0.15
    rot = seen["rot_body_to_world"].reshape(-1, 3, 3)
    np.testing.assert_allclose(rot @ rot.swapaxes(1, 2), np.tile(np.eye(3), (len(rot), 1, 1)), atol=1e-12)
    turn = np.stack([rot[:, 2, 1], rot[:, 0, 2], rot[:, 1, 0]], axis=1)
    np.testing.assert_allclose(turn.std(axis=0), 0.05, rtol=0.1)
    for name in ("wrench_applied", "rotor_thrust", "position_ref"):
        assert np.array_equal(seen[name], true[name])


# ----------------------------------------------------------------------------------------------- one against the other


@pytest.mark.parametrize("name", ["bullet", "mujoco"])
def test_the_batch_flies_as_the_engines_do(name: str, pilot: Callable[[np.ndarray], np.ndarray]) -> None:
    disturbances: dict[str, Any] = {
        "payload": {"mass": {"uniform": [0.2, 0.4]}, "detach_time": 5.0},
        "wind": {"uniform": [0.8, 1.2]},
        "ground_effect": 1.0,
        "push": [{"body": "rear_left", "magnitude": 2.0, "direction": [1, 1, 1], "start": 3.0017, "duration": 0.1}],
        "mass_scale": 1.05,
        "action_delay": 1,
        "actuator_effectiveness": [{"joint": "front_left", "factor": 0.95, "start": 6.0}],
        "initial_position": {"offset": [{"uniform": [-0.05, 0.05]}, 0.02, 0.0]},
    }
    engine, batch = (Flight(kind, disturbances, control_period=0.015) for kind in (name, "batch"))
    fields = {"engine": engine.reset(seed=7), "batch": batch.reset(seed=7)}
    assert engine.env.unwrapped.sampled_disturbances == batch.env.unwrapped.sampled_disturbances[1]
    furthest, apart = 0.0, 0.0
    for _ in range(round(10.0 / 0.015)):
        for name, flight in (("engine", engine), ("batch", batch)):
            fields[name] = flight.step(pilot(np.concatenate(list(fields[name].values()))))
        apart = max(apart, float(np.abs(fields["engine"]["position"] - fields["batch"]["position"]).max()))
        furthest = max(furthest, float(np.abs(fields["engine"]["position"][:2]).max()))
    assert apart < 1e-3
    assert furthest > 0.3
    np.testing.assert_allclose(
        fields["batch"]["rot_body_to_world"], fields["engine"]["rot_body_to_world"], rtol=0, atol=5e-3
    )
