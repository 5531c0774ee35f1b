"""The cable: mathematics of a pendulum, of a fall into it, of its release; every engine, and many at once."""

from __future__ import annotations

import copy
import tracemalloc
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from scipy.special import ellipk

import controllers
from artde_gym.disturbances import Disturbances
from artde_gym.errors import DisturbanceError, RobotError
from artde_gym.robots.ojas.model import ojas
from artde_gym.robots.q450.model import INERTIA, MASS, q450
from artde_gym.robots.q450.task import WORDS
from artde_gym.sim import cable as law
from artde_gym.sim.cables import Cables
from artde_gym.sim.factory import EngineName, make_engine
from artde_gym.sim.rigid_bodies import MassProperties, RigidBodies
from artde_gym.sim.sling import Sling

pytestmark = pytest.mark.once

ID = "QuadInfinity-Payload-v0"
GRAVITY, LOAD, LENGTH, HOOK = 9.81, 0.35, 0.5, (0.0, 0.0, -0.05)
CENTER = (0.0, 0.0, 0.0)
STILL = 1e9  # times as heavy as the vehicle: a hook that stays


class Pendulums:
    """Bodies in NumPy with a load each, out of the vertical by `angles` (rad), in a step of `step` (s)."""

    def __init__(self, angles: list[float], step: float, hook: Any = CENTER, heavier: float = 1.0) -> None:
        self.n, self.step, self.heavier = len(angles), step, heavier
        self.bodies, self.cables = RigidBodies(self.n, np.float64), Cables(self.n, np.float64)
        for i, angle in enumerate(angles):
            properties = MassProperties(heavier * MASS, CENTER, heavier * np.diag(INERTIA))
            self.bodies.set_properties(i, properties)
            self.bodies.place(i, (0.0, 0.0, 2.0))
            self.cables.hang(i, self.bodies, LOAD, hook, LENGTH)
            turned = LENGTH * np.array([np.sin(angle), 0.0, 1.0 - np.cos(angle)])
            self.cables.position[:, i] += turned

    def run(self, duration: float, lift: float) -> dict[str, np.ndarray]:
        """States in the middle of steps; `lift` (N) holds each body."""
        force, nothing = np.zeros((3, self.n)), np.zeros((3, self.n))
        force[2] = lift
        bodies, cables, half = self.bodies, self.cables, 0.5 * self.step
        seen: dict[str, list[Any]] = {"r": [], "tension": [], "energy": [], "momentum": []}
        self._drift(half)
        for _ in range(round(duration / self.step)):
            bodies.kick(self.step, force, nothing)
            cables.kick(bodies, self.step, nothing, None)
            self._drift(half)
            seen["energy"].append(self._energy())
            momentum = bodies.com_velocity / bodies.inverse_mass + LOAD * cables.velocity
            seen["momentum"].append(momentum)
            self._drift(half)
            seen["r"].append(cables.relative(bodies)[0])
            seen["tension"].append(cables.tension.copy())
        return {name: np.array(values) for name, values in seen.items()}

    def _drift(self, duration: float) -> None:
        self.bodies.drift(duration)
        self.cables.drift(duration)

    def _energy(self) -> np.ndarray:
        bodies, cables = self.bodies, self.cables
        mass = 1.0 / bodies.inverse_mass
        moving = mass * (bodies.com_velocity**2).sum(0) + LOAD * (cables.velocity**2).sum(0)
        turning = (self.heavier * np.array(INERTIA)[:, None] * bodies.rates**2).sum(0)
        high = mass * bodies.com[2] + LOAD * cables.position[2]
        return 0.5 * (moving + turning) + GRAVITY * high


@pytest.fixture
def no_drag(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(law, "DRAG", 0.0)


# ---------------------------------------------------------------------------------------------------------- mathematics


@pytest.mark.usefixtures("no_drag")
@pytest.mark.parametrize(("step", "accuracy"), [(0.001, 3e-6), (0.005, 6e-5)])
def test_the_period_and_tension_of_a_pendulum_are_those_of_mathematics(step: float, accuracy: float) -> None:
    swings = [0.1, 0.5, 1.0]
    found = Pendulums(swings, step, heavier=STILL).run(4.5, GRAVITY * STILL * MASS)
    time = step * np.arange(1, len(found["r"]) + 1)
    for i, swing in enumerate(swings):
        x = found["r"][:, 0, i]
        up = np.flatnonzero((x[:-1] < 0) & (x[1:] >= 0))
        crossed = time[up] - x[up] * step / (x[up + 1] - x[up])
        exact = 4.0 * np.sqrt(LENGTH / GRAVITY) * ellipk(np.sin(swing / 2) ** 2)
        assert np.diff(crossed).mean() == pytest.approx(exact, rel=accuracy)
        assert found["tension"][:, i].max() == pytest.approx(LOAD * GRAVITY * (3 - 2 * np.cos(swing)), abs=1e-3)
        assert np.abs(x).max() == pytest.approx(LENGTH * np.sin(swing), rel=1e-3)


@pytest.mark.usefixtures("no_drag")
@pytest.mark.parametrize("step", [0.001, 0.005])
def test_a_free_spin_keeps_energy_momentum_and_length(step: float) -> None:
    """Vehicle and load fall and turn about each other; the hook is off the center of mass."""
    pendulum = Pendulums([np.pi / 2], step, HOOK)
    pendulum.cables.velocity[1] = 2.0
    found = pendulum.run(3.0, 0.0)
    energy, momentum = found["energy"][:, 0], found["momentum"][..., 0]
    assert np.ptp(energy) < 5e-5 * (0.5 * LOAD * 4.0) / 0.7 * (step / 0.005) ** 2 + 1e-6
    assert np.ptp(momentum[:, :2], axis=0) == pytest.approx(0.0, abs=1e-12)
    weight = (MASS + LOAD) * GRAVITY
    assert momentum[-1, 2] - momentum[0, 2] == pytest.approx(-weight * step * (len(momentum) - 1), rel=1e-9)
    assert np.linalg.norm(found["r"], axis=1).max() < LENGTH + 1e-4  # ends of steps; their middles keep it to rounding
    assert np.abs(pendulum.bodies.rates).max() > 1.0


@pytest.mark.usefixtures("no_drag")
@pytest.mark.parametrize("step", [0.001, 0.005])
@pytest.mark.parametrize("heavier", [1.0, STILL])
def test_a_fall_into_the_cable_ends_inelastically(step: float, heavier: float) -> None:
    """The load falls by 0.2 m: an impulse mu v takes its speed relative to the hook away, and no more."""
    pendulum = Pendulums([0.0], step, heavier=heavier)
    pendulum.cables.position[2] += 0.2
    found = pendulum.run(1.0, heavier * MASS * GRAVITY)  # the bare vehicle hovers meanwhile
    tension, length = found["tension"][:, 0], np.linalg.norm(found["r"][..., 0], axis=1)
    taut = int(np.argmax(tension > 0))
    assert taut * step == pytest.approx(np.sqrt(0.4 / GRAVITY), abs=2 * step)
    mass = heavier * MASS
    reduced = LOAD * mass / (LOAD + mass)
    rest = reduced * GRAVITY  # tension that goes on, as the bare vehicle's thrust stays
    impulse = step * tension[taut : taut + 4].sum() - 4 * step * rest
    assert impulse == pytest.approx(reduced * np.sqrt(2 * GRAVITY * 0.2), abs=2.5 * step * rest)
    assert length.max() < LENGTH + 1e-9
    assert np.ptp(length[taut + 2 :]) < 1e-9  # no rebound
    assert tension[-1] == pytest.approx(rest, rel=1e-6)


def test_a_slack_cable_does_nothing_and_a_release_is_a_free_fall() -> None:
    pendulum = Pendulums([0.0, 0.0], 0.005)
    pendulum.cables.position[2, 0] += 0.3
    pendulum.cables.release(1)
    before = pendulum.bodies.com_velocity.copy()
    found = pendulum.run(0.1, MASS * GRAVITY)
    assert not found["tension"].any()
    np.testing.assert_allclose(pendulum.bodies.com_velocity, before, atol=1e-12)
    assert pendulum.cables.velocity[2] == pytest.approx(-0.1 * GRAVITY, rel=2e-2)


def test_floats_and_arrays_are_one_formula() -> None:
    rng = np.random.default_rng(0)
    for _ in range(50):
        numbers = rng.normal(size=18)
        rot = np.linalg.qr(rng.normal(size=(3, 3)))[0].ravel()

        def found(kind: Any, by: law.Functions, numbers: Any = numbers, rot: Any = rot) -> Any:
            v = [kind(x) for x in numbers]
            body = law.Body(kind(0.7), (kind(80.0), kind(80.0), kind(44.0)), tuple(map(kind, rot)), *_triples(v[:9]))
            load = law.Load(kind(2.9), *_triples(v[9:15]))
            return law.pull(body, load, (kind(0.01), kind(0.0), kind(-0.05)), kind(0.5), 0.005, by)

        one = found(float, law.FLOATS)
        many = found(lambda x: np.full(3, x), law.ARRAYS)
        assert np.all(np.abs(many.tension / max(one.tension, 1e-9) - one.tension / max(one.tension, 1e-9)) < 1e-12)
        assert one.tension >= 0


def _triples(values: list[Any]) -> list[tuple[Any, Any, Any]]:
    return [(values[i], values[i + 1], values[i + 2]) for i in range(0, len(values), 3)]


# -------------------------------------------------------------------------------------------------------------- engines


def slung(engine_name: EngineName, time_step: float = 0.001) -> Sling:
    engine = Sling(make_engine(engine_name, q450(), time_step))
    engine.reset((0.0, 0.0, 2.0), np.zeros(0))
    return engine


@pytest.mark.usefixtures("no_drag")
def test_every_engine_swings_as_bodies_in_numpy_do(engine_name: EngineName) -> None:
    """The vehicle, pushed off its balance, drifts and turns under its load; nobody controls it."""
    engine = slung(engine_name)
    engine.hang_payload(LOAD, HOOK, LENGTH)
    pendulum = Pendulums([0.0], 0.001, HOOK)
    lift = (MASS + LOAD) * GRAVITY
    for step in range(600):
        push = (1.0, 0.5, 0.0) if step < 100 else CENTER
        state = engine.state()
        up = law.times(law_rot(state), (0.0, 0.0, lift))
        engine.apply_world_wrench(up, (0.0, 0.001, 0.0))
        engine.apply_force("payload", push)
        engine.apply_force("front_left", (0.0, 0.0, 0.02))
        engine.step(np.zeros(0))
        pendulum_step(pendulum, lift, push)
    state = engine.state()
    np.testing.assert_allclose(state.position, pendulum.bodies.com[:, 0], atol=5e-4)
    np.testing.assert_allclose(engine.payload_position() or (), pendulum.cables.position[:, 0], atol=5e-4)
    r, _ = engine.cable(state)
    assert np.linalg.norm(r) == pytest.approx(LENGTH, abs=1e-6)
    assert np.hypot(r[0], r[1]) > 0.05
    assert engine.tension == pytest.approx(pendulum.cables.tension[0], rel=1e-2)


def law_rot(state: Any) -> Any:
    from artde_gym.sim.rotation import matrix

    return matrix(state.quat_xyzw)


def pendulum_step(pendulum: Pendulums, lift: float, push: Any) -> None:
    bodies = pendulum.bodies
    pendulum._drift(0.0005)
    site = (0.225 / np.sqrt(2), 0.225 / np.sqrt(2), 0.0)
    extra = np.array([0.0, 0.0, 0.02])
    force = bodies.rot[:, 2] * lift + extra[:, None]
    torque = bodies.rot[..., 0].T @ np.array([0.0, 0.001, 0.0]) + np.cross(site, bodies.rot[..., 0].T @ extra)
    bodies.kick(0.001, force, torque[:, None])
    pendulum.cables.kick(bodies, 0.001, np.array(push, dtype=float)[:, None], None)
    pendulum._drift(0.0005)


def test_a_copy_of_a_slung_world_goes_on_as_it_would(engine_name: EngineName) -> None:
    engine = slung(engine_name)
    engine.hang_payload(LOAD, HOOK, LENGTH)
    for _ in range(20):
        engine.apply_force("payload", (3.0, 0.0, 0.0))
        engine.step(np.zeros(0))
    other = copy.deepcopy(engine)
    for one in (engine, other):
        for _ in range(20):
            one.step(np.zeros(0))
    assert engine.state().position == other.state().position
    assert engine.payload_position() == other.payload_position()
    assert engine.payload_position() is not None


def test_a_robot_of_several_links_carries_no_cable() -> None:
    engine = Sling(make_engine("mujoco", ojas(), 0.001))
    with pytest.raises(RobotError, match=r"links is 1[0-9]; allowed: 1"):
        engine.hang_payload(1.0, HOOK, 0.5)


def test_a_push_of_a_fixed_payload_is_one_where_it_is(engine_name: EngineName) -> None:
    found = []
    for site, place in (("payload", (0.225 / np.sqrt(2), 0.225 / np.sqrt(2), 0.0)), ("front_left", CENTER)):
        engine = slung(engine_name)
        engine.attach_payload(1e-3, place)
        for _ in range(50):
            engine.apply_force(site, (0.1, 0.0, 0.2))
            engine.step(np.zeros(0))
        found.append(engine.state())
    np.testing.assert_allclose(found[0].angular_velocity, found[1].angular_velocity, rtol=2e-2, atol=1e-3)
    engine.release_payload()
    before = engine.state()
    engine.apply_force("payload", (100.0, 0.0, 0.0))  # there is none
    engine.step(np.zeros(0))
    assert engine.state().velocity[0] == pytest.approx(before.velocity[0], abs=1e-6)


# --------------------------------------------------------------------------------------------------------- environments

SLUNG: dict[str, Any] = {
    "payload": {"mass": 0.35, "cable": 0.5, "detach_time": 2.2},
    "push": {"body": "payload", "magnitude": 1.4, "direction": [1, 1, 0], "start": 0.5},
    "wind": 1.0,
}


def closed_loop(env: Any, duration: float) -> np.ndarray:
    """Positions of the vehicle under PID."""
    policy = controllers.make("pid", env)
    observation, _ = env.reset(seed=0)
    state, seen = None, []
    for _ in range(round(duration / env.unwrapped.control_period)):
        action, state = policy.predict(observation, state)
        observation, *_ = env.step(action)
        seen.append(observation.reshape(-1, 41)[0, :3])
    return np.array(seen)


def test_engines_agree_in_closed_loop(engine_name: EngineName) -> None:
    kwargs: dict[str, Any] = {"disturbances": SLUNG, "duration": 4.0}
    alone = closed_loop(gym.make(ID, engine=engine_name, **kwargs), 3.0)
    many = closed_loop(gym.make_vec(ID, 1, "vector_entry_point", engine="numpy", **kwargs), 3.0)
    assert np.abs(alone - many).max() < 1e-3
    bare = {**SLUNG, "payload": {"mass": 0.35, "detach_time": 2.2, "position": HOOK}}
    fixed = closed_loop(gym.make(ID, engine=engine_name, disturbances=bare, duration=4.0), 3.0)
    assert np.abs(alone - fixed).max() > 5e-3


VARIED: dict[str, Any] = {
    "payload": {
        "mass": {"uniform": [0.05, 0.5]},
        "cable": {"choice": [0.0, 0.3, 1.0, 2.0]},
        "position": {"choice": [[0.0, 0.0, -0.05], [0.02, -0.01, -0.08]]},
        "detach_time": {"uniform": [0.2, 0.9]},
        "attach_time": {"choice": [0.0, 0.1]},
    },
    "push": [
        {
            "body": "payload",
            "magnitude": {"uniform": [0.0, 9.0]},
            "direction": [0, 1, 2],
            "start": {"uniform": [0, 0.3]},
        },
        {"body": "front_left", "magnitude": 1.0, "start": 0.1},
    ],
    "wind": {"choice": [0.0, 3.0]},
    "mass_scale": {"uniform": [0.9, 1.1]},
}


@pytest.mark.parametrize("kwargs", [{}, {"dtype": "float32"}])
def test_batch_is_loop_to_the_bit(kwargs: dict[str, Any]) -> None:
    def flown(seeds: list[int]) -> list[bytes]:
        env: Any = gym.make_vec(
            ID, len(seeds), "vector_entry_point", engine="numpy", disturbances=VARIED, duration=0.6, **kwargs
        )
        observations, _ = env.reset(seed=seeds)
        logs = [observations.tobytes()[:0] for _ in seeds]
        action = np.tile([18.0, 0.002, -0.001, 0.0], (len(seeds), 1))
        for _ in range(60):  # flights end meanwhile, and begin anew
            observations, rewards, *_ = env.step(action)
            logs = [log + observations[i].tobytes() + rewards[i].tobytes() for i, log in enumerate(logs)]
        return logs

    seeds = list(range(9))
    assert flown(seeds) == [flown([seed])[0] for seed in seeds]


@pytest.mark.parametrize(
    ("given", "field", "allowed"),
    [
        ({"payload": {"cable": 0.5}}, "payload.mass", "required|no default"),
        ({"payload": {"mass": 0.3, "cable": -0.1}}, "payload.cable", "0 to 2 m"),
        ({"payload": {"mass": 0.3, "cable": 1e9}}, "payload.cable", "0 to 2 m"),
        ({"payload": {"mass": 0.3, "cable": float("nan")}}, "payload.cable", "0 to 2 m"),
        ({"payload": {"mass": 0.3, "cable": "long"}}, "payload.cable", "0 to 2 m"),
        ({"cable": 0.5}, "cable", "payload"),
        ({"push": {"body": "payload", "magnitude": 1.0, "start": 0.0}}, "push.body", "add a payload"),
    ],
)
def test_a_bad_cable_is_refused(given: dict[str, Any], field: str, allowed: str) -> None:
    with pytest.raises(DisturbanceError, match=rf"{field}.*({allowed})"):
        Disturbances.parse(given, WORDS["site"], WORDS["joint"], "q450")


def test_a_biped_has_no_cable() -> None:
    given = {"payload": {"mass": 1.0, "cable": 0.5}}
    with pytest.raises(DisturbanceError, match=r"payload key is 'cable'"):
        gym.make("BipedWalk-Payload-v0", disturbances=given)
    assert "cable" not in Disturbances.parse({"payload": 1.0}, (), (), "ojas").entries[0][1]


@pytest.mark.parametrize(
    ("given", "position"),
    [
        ({}, [0.01, 0.0, -0.1]),
        ({"cable": 0}, [0.01, 0.0, -0.1]),
        ({"cable": 0.4}, list(HOOK)),
        ({"cable": {"uniform": [0.1, 1.0]}}, list(HOOK)),
        ({"cable": 0.4, "position": [0.1, 0.0, 0.0]}, [0.1, 0.0, 0.0]),
    ],
)
def test_a_cable_begins_at_a_hook_of_its_own(given: dict[str, Any], position: list[float]) -> None:
    given = {"payload": {"mass": 0.3, **given}}
    ((_, entry),) = Disturbances.parse(given, WORDS["site"], WORDS["joint"], "q450").entries
    assert list(entry["position"]) == position


WILD: dict[str, Any] = {
    "payload": {
        "mass": {"uniform": [0.001, 5.0]},
        "cable": {"uniform": [0.0, 2.0]},
        "position": [{"uniform": [-0.5, 0.5]}] * 3,
        "attach_time": {"uniform": [0.0, 0.6]},
        "detach_time": {"uniform": [0.0, 1.2]},
    },
    "push": [
        {
            "body": "payload",
            "magnitude": {"uniform": [0.0, 500.0]},
            "direction": [{"normal": [0.0, 1.0]}] * 3,
            "start": {"uniform": [0.0, 1.0]},
            "duration": {"uniform": [0.001, 0.5]},
        },
        {"body": "front_left", "magnitude": {"uniform": [0.0, 50.0]}, "start": {"uniform": [0.0, 1.0]}},
    ],
    "wind": {"scale": {"uniform": [0.0, 10.0]}},
    "mass_scale": {"uniform": [0.5, 2.0]},
}


@pytest.mark.parametrize("count", [500, pytest.param(10_000, marks=pytest.mark.slow)])
def test_wild_flights_end_without_nan_or_growth(count: int) -> None:
    """Loads of a gram to 5 kg, cables of no length to 2 m, pushes of 500 N: every number stays finite."""
    n, sizes = 250, []
    env: Any = gym.make_vec(
        "QuadSling-Payload-v0", n, "vector_entry_point", engine="numpy", disturbances=WILD, duration=1.2
    )
    observations, info = env.reset(seed=0)
    ended, action = 0, np.tile([18.0, 0.0, 0.0, 0.0], (n, 1))
    tracemalloc.start()
    while ended < count:
        observations, rewards, terminated, truncated, info = env.step(action)
        ended += int((terminated | truncated).sum())
        assert np.isfinite(observations).all()
        assert np.isfinite(rewards).all()
        assert all(np.isfinite(info[name]).all() for name in ("load_error", "swing", "cable_impulse"))
        sizes.append(tracemalloc.get_traced_memory()[0])
    tracemalloc.stop()
    half = len(sizes) // 2
    assert max(sizes[half:]) < 1.5 * max(sizes[:half]) + 1e6
