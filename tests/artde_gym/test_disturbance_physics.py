"""Each kind of disturbance by its physics, judged from outside: momentum, weight, friction cones, exact lags."""

from __future__ import annotations

import dataclasses
import functools
import math
import warnings
from typing import Any, Literal, NamedTuple

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env

import controllers
from artde_gym.disturbances import Disturbances
from artde_gym.disturbances.ground import AIRBORNE, GrfPulses
from artde_gym.disturbances.schedule import EVENTS
from artde_gym.multibody.dynamics import RigidBodyTree
from artde_gym.multibody.spec import RobotSpec
from artde_gym.robots.ojas.model import HIP_OFFSET, SIDES, TOTAL_MASS, ojas
from artde_gym.sim.engine import Engine, State
from artde_gym.sim.factory import EngineName, make_engine
from artde_gym.sim.mujoco import MujocoEngine, mj

pytestmark = pytest.mark.once

G = 9.81
WEIGHT = TOTAL_MASS * G
DT = 0.001  # s, of the physics
KNEE = 3  # index of the left knee in q
SWING = round(AIRBORNE / DT)  # physics steps without load that make a swing
POINT = tuple[float, float, float]

# ------------------------------------------------------------------------------------------------------------- helpers


def make(disturbances: dict[str, Any], **kwargs: Any) -> Any:
    """A quick environment that stands for 2 s."""
    options: dict[str, Any] = {"control_period": 0.004, "actuator_inertia": "lumped", "duration": 2.0, **kwargs}
    return gym.make("BipedWalk-Payload-v0", disable_env_checker=True, disturbances=disturbances, **options).unwrapped


def sampled(env: Any, **kwargs: Any) -> Any:
    """Reset, and tell what was sampled."""
    env.reset(**kwargs)
    return env.unwrapped.sampled_disturbances


class Run(NamedTuple):
    """An episode; row k is after k control periods."""

    fields: dict[str, np.ndarray]  # observed
    states: list[State]  # true
    infos: list[dict[str, Any]]
    actions: np.ndarray

    @property
    def bits(self) -> bytes:
        true = [np.concatenate([np.concatenate([np.ravel(x) for x in state]) for state in self.states])]
        return b"".join(array.tobytes() for array in (*self.fields.values(), *true))

    @property
    def load(self) -> np.ndarray:
        """Whole vertical force of the ground (N)."""
        return np.array([sum(info["foot_loads"]) for info in self.infos])

    @property
    def position(self) -> np.ndarray:
        return np.array([state.position for state in self.states])


def run(env: Any, steps: int, seed: int = 0, actions: np.ndarray | None = None, **options: Any) -> Run:
    """The first `steps` periods under TDE, or under given `actions`."""
    policy, state = controllers.make("tde", env), None
    observation, info = env.reset(seed=seed, options=options or None)
    observations, states, infos, used = [observation], [env._engine.state()], [info], []
    for k in range(steps):
        if actions is None:
            action, state = policy.predict(observation, state)
        else:
            action = actions[k]
        observation, _, terminated, _, info = env.step(action)
        assert not terminated, info
        used.append(action)
        observations.append(observation)
        states.append(env._engine.state())
        infos.append(info)
    return Run(env.observation_layout.split(np.array(observations)), states, infos, np.array(used))


class Recorder:
    """Notes what an environment asks of its engine, by physics step since the last reset."""

    def __init__(self, env: Any, monkeypatch: pytest.MonkeyPatch) -> None:
        engine = env._engine
        self.pushes: dict[int, list[tuple[str, np.ndarray]]] = {}
        self.torques: list[np.ndarray] = []
        self.loads: list[tuple[float, ...]] = []  # after each step
        push, lift, step, loads = engine.apply_force, engine.lift_feet, engine.step, engine.foot_loads

        def note_push(site: str, force: POINT) -> None:
            self.pushes.setdefault(len(self.torques), []).append((site, np.array(force)))
            push(site, force)

        def note_lift(forces: list[float]) -> None:
            lifted = [(f"{side}_foot", np.array([0.0, 0.0, f])) for side, f in zip(SIDES, forces, strict=True) if f]
            if lifted:
                self.pushes.setdefault(len(self.torques), []).extend(lifted)
            lift(forces)

        def note_step(tau: np.ndarray) -> None:
            self.torques.append(tau.copy())
            step(tau)
            self.loads.append(loads())

        monkeypatch.setattr(engine, "apply_force", note_push)
        monkeypatch.setattr(engine, "lift_feet", note_lift)
        monkeypatch.setattr(engine, "step", note_step)

    def clear(self) -> None:
        for record in (self.pushes, self.torques, self.loads):
            record.clear()


def rotation(quat_xyzw: tuple[float, float, float, float]) -> np.ndarray:
    x, y, z, w = quat_xyzw
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def bullet() -> Any:
    """PyBullet, where the engine under test has it."""
    from artde_gym.sim.pybullet_module import bullet

    return bullet


class Mechanics:
    """A simulated robot in our own rigid-body algebra; held joints move, so all of them are read."""

    def __init__(self, engine: Any) -> None:
        self.engine, self.tree = engine, RigidBodyTree(engine.spec)

    def joints(self) -> tuple[np.ndarray, np.ndarray]:
        if isinstance(self.engine, MujocoEngine):
            joints = [self.engine._data.joint(name) for name in self.tree.joints]
            return np.concatenate([joint.qpos for joint in joints]), np.concatenate([joint.qvel for joint in joints])
        links = [self.engine._links[name] for name in self.tree.joints]
        states = bullet().getJointStates(self.engine._robot, links, physicsClientId=self.engine._client)
        return np.array([state[0] for state in states]), np.array([state[1] for state in states])

    def momentum(self) -> np.ndarray:
        """[linear; angular about the world's origin], (6,)."""
        state, (q, qd) = self.engine.state(), self.joints()
        matrix = self.tree.mass_matrix(q, rotation(state.quat_xyzw))
        generalized = matrix[:6] @ np.concatenate([state.velocity, state.angular_velocity, qd])
        return np.concatenate([generalized[:3], generalized[3:] + np.cross(state.position, generalized[:3])])

    def site(self, name: str) -> np.ndarray:
        """World position of a site."""
        link, offset = next((link, offset) for site, link, offset in self.engine.spec.sites if site == name)
        state, (q, _) = self.engine.state(), self.joints()
        frames = self.tree.frames(q, rotation(state.quat_xyzw))
        body = self.tree._body(link)
        return np.asarray(state.position) + frames.origin[body] + frames.rot[body] @ np.asarray(offset)


def payload_velocity(engine: Any) -> np.ndarray:
    """Of a payload that is held."""
    if isinstance(engine, MujocoEngine):
        mj.mj_kinematics(engine._model, engine._data)
        mj.mj_comPos(engine._model, engine._data)
        jacobian = np.zeros((3, engine._model.nv))
        mj.mj_jacBodyCom(engine._model, engine._data, jacobian, None, engine._blueprint.payload)
        return jacobian @ engine._data.qvel
    return np.array(bullet().getBaseVelocity(engine._payload, physicsClientId=engine._client)[0])


def flying(engine_name: EngineName, spec: RobotSpec, gravity: float = 0.0) -> Engine:
    engine = make_engine(engine_name, spec, DT)
    q = np.zeros(12)
    q[[2, 3, 4, 8, 9, 10]] = [-0.4, 0.8, -0.4, -0.2, 0.4, -0.2]
    engine.set_gravity((0.0, 0.0, -gravity))
    engine.reset((0.3, -0.2, 5.0), q)
    return engine


def realize(disturbances: dict[str, Any], **words: Any) -> dict[str, Any]:
    return Disturbances.parse(disturbances, words.get("sites", ()), ojas().actuated).sample(np.random.default_rng(0))


# ---------------------------------------------------------------------------------------------------------------- push


@pytest.mark.parametrize("site", ["chest", "left_arm", "left_foot"])
@pytest.mark.parametrize(
    ("inertia", "arms"), [("lumped", "fixed"), ("rotor", "fixed"), ("none", "fixed"), ("lumped", "revolute")]
)
def test_a_push_adds_its_impulse_to_the_momentum(
    engine_name: EngineName, inertia: Literal["lumped", "rotor", "none"], arms: Literal["fixed", "revolute"], site: str
) -> None:
    """Free floating: linear momentum by F dt, angular momentum about the world's origin by r x F dt.

    A light push: what the engine's integrator loses grows with the square of the joints' speeds.
    """
    engine = flying(engine_name, ojas(inertia, arms=arms))
    mechanics, force, impulse = Mechanics(engine), np.array([0.3, -0.2, 0.1]), np.zeros(6)
    before = mechanics.momentum()
    for _ in range(50):
        impulse += DT * np.concatenate([force, np.cross(mechanics.site(site), force)])
        engine.apply_force(site, (0.3, -0.2, 0.1))
        engine.step(np.zeros(12))
    change = mechanics.momentum() - before
    np.testing.assert_allclose(change[:3], impulse[:3], rtol=0, atol=float(1e-3 * np.linalg.norm(impulse[:3])))
    np.testing.assert_allclose(change[3:], impulse[3:], rtol=0, atol=float(1e-3 * np.linalg.norm(impulse[3:])))
    engine.close()


def test_gravity_adds_its_impulse_too(engine_name: EngineName) -> None:
    engine = flying(engine_name, ojas("lumped"), gravity=G)
    mechanics = Mechanics(engine)
    before = mechanics.momentum()
    for _ in range(100):
        engine.step(np.zeros(12))
    np.testing.assert_allclose((mechanics.momentum() - before)[:3], [0, 0, -0.1 * WEIGHT], atol=1e-3)
    engine.close()


def test_the_arm_push_moves_the_real_arm(engine_name: EngineName) -> None:
    """With movable arms the push acts on the upper arm, which gives way to it before its motors hold it."""
    spec = ojas("lumped", arms="revolute")
    assert {site: link for site, link, _ in spec.sites}["left_arm"] == "left_shoulder_yaw"
    fixed = Mechanics(flying(engine_name, ojas("lumped")))
    turned = {}
    for site in ("left_arm", "torso"):
        mechanics = Mechanics(flying(engine_name, spec))
        # halfway down the upper arm, and in the same place whether the arm is a link of its own or not
        np.testing.assert_allclose(mechanics.site("left_arm"), [0.3, -0.2 + 0.125, 5.0 + 0.26 - 0.06], atol=1e-9)
        np.testing.assert_allclose(mechanics.site(site), fixed.site(site), atol=1e-9)
        mechanics.engine.apply_force(site, (40.0, 0.0, 0.0))
        mechanics.engine.step(np.zeros(12))
        arm = mechanics.tree.joints.index("left_shoulder_pitch")
        turned[site] = mechanics.joints()[1][arm]
    assert turned["left_arm"] < -1e-6  # forward about +y is downward for what hangs: the angle falls
    assert abs(turned["left_arm"]) > 3 * abs(turned["torso"])


@pytest.mark.parametrize("control_period", [0.001, 0.004])
@pytest.mark.parametrize(
    ("start", "duration"), [(0.0, 0.2), (0.1, 0.001), (0.011, 0.033), (0.0507, 0.2), (0.029, 0.007)]
)
def test_a_push_acts_on_exactly_its_steps(
    control_period: float, start: float, duration: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    push = {"body": "chest", "magnitude": 3.0, "direction": [0, 3, -4], "start": start, "duration": duration}
    env = make({"push": [push]}, control_period=control_period)
    env.reset(seed=0)
    record = Recorder(env, monkeypatch)
    count = math.ceil((start + duration) / control_period) + 3
    infos = [env.step(env._tau)[-1] for _ in range(count)]
    first, end = round(start / DT), round(start / DT) + round(duration / DT)
    assert sorted(record.pushes) == list(range(first, end))
    for ((site, force),) in record.pushes.values():
        assert site == "chest"
        np.testing.assert_allclose(force, [0, 1.8, -2.4], atol=1e-12)
    events = [(round((info["time_s"] - control_period) / DT), e) for info in infos for e in EVENTS if info[e]]
    substeps = round(control_period / DT)
    assert events == [
        (first // substeps * substeps, "push_begins"),
        (end // substeps * substeps, "push_ends"),
    ]


def test_pushes_add_up(monkeypatch: pytest.MonkeyPatch) -> None:
    pushes = [
        {"body": "torso", "magnitude": 2.0, "start": 0.01, "duration": 0.02},
        {"body": "right_arm", "magnitude": 1.0, "direction": [0, 0, 1], "start": 0.02, "duration": 0.02},
    ]
    env = make({"push": pushes})
    env.reset(seed=0)
    record = Recorder(env, monkeypatch)
    infos = [env.step(env._tau)[-1] for _ in range(12)]
    events = [name for info in infos for name in EVENTS for _ in range(info[name])]
    assert events == ["push_begins", "push_begins", "push_ends", "push_ends"]
    sites = {step: [site for site, _ in pushed] for step, pushed in record.pushes.items()}
    assert sites == {
        **{step: ["torso"] for step in range(10, 20)},
        **{step: ["torso", "right_arm"] for step in range(20, 30)},
        **{step: ["right_arm"] for step in range(30, 40)},
    }


# ------------------------------------------------------------------------------------------------------------- payload


def ground_moment(episode: Run) -> np.ndarray:
    """Moment (x, y) (Nm) of the ground's forces about the middle of the ankles, from ankle torques and foot loads.

    A foot at rest: tau + r x F = 0 about its ankle, but for its own weight, which no payload changes.
    """
    window = np.hanning(700) / np.hanning(700).sum()  # the robot rocks on its soles, with a period of some 270 samples
    tau = window @ episode.fields["tau_applied"][-700:]
    left, right = window @ np.array([info["foot_loads"] for info in episode.infos])[-700:]
    return np.array([HIP_OFFSET * (left - right) - tau[5] - tau[11], -tau[4] - tau[10]])


def test_a_payload_off_centre_moves_the_centre_of_pressure(engine_name: EngineName) -> None:
    env, mass = make({}, duration=4.0, engine=engine_name), 1.3
    nominal = run(env, 999, disturbances={"payload": mass})
    for dx, dy in [(0.04, 0.0), (0.0, 0.05), (-0.03, -0.04)]:
        there = run(env, 999, disturbances={"payload": {"mass": mass, "position": [dx, dy, 0.16]}})
        assert there.load[300:].mean() == pytest.approx(WEIGHT + mass * G, rel=1e-3)
        change = ground_moment(there) - ground_moment(nominal)
        np.testing.assert_allclose(change, [mass * G * dy, -mass * G * dx], atol=0.02 * mass * G * math.hypot(dx, dy))


def test_a_payload_comes_and_goes(engine_name: EngineName) -> None:
    env = make({"payload": {"mass": 2.0, "attach_time": 0.6, "detach_time": 1.2}}, engine=engine_name)
    episode = run(env, 499)
    time = np.array([info["time_s"] for info in episode.infos])
    for begin, end, weight in [(0.2, 0.6, WEIGHT), (0.9, 1.2, WEIGHT + 2.0 * G), (1.5, 2.0, WEIGHT)]:
        window = (time > begin) & (time <= end)
        assert episode.load[window].mean() == pytest.approx(weight, rel=0.005), begin
    events = [(info["time_s"], event) for info in episode.infos for event in EVENTS if info[event]]
    assert events == [(pytest.approx(0.604), "payload_attached"), (pytest.approx(1.204), "payload_dropped")]


def test_the_dropped_ball_falls_freely(engine_name: EngineName) -> None:
    env = make({"payload": {"mass": 2.0, "position": [0.0, 0.0, 0.2], "detach_time": 0.1}}, engine=engine_name)
    env.reset(seed=0)
    engine, heights = env._engine, []
    for _ in range(100):
        env.step(env._tau)
        heights.append(engine.payload_position()[2])
    held, falling = np.array(heights[:25]), np.array(heights[25:])
    assert np.ptp(held) < 1e-3
    time = 0.004 * np.arange(1, len(falling) + 1)
    np.testing.assert_allclose(held[-1] - falling, G * time**2 / 2, atol=3e-3)


def test_attaching_a_payload_makes_no_jump(engine_name: EngineName) -> None:
    """The ball takes over the motion of its point of the base: nobody's momentum changes, whatever the base does."""
    mass, point = 1.5, (0.05, -0.02, 0.2)
    engine = flying(engine_name, ojas("lumped"))
    mechanics = Mechanics(engine)
    for _ in range(50):
        engine.apply_force("chest", (60.0, 30.0, 0.0))
        engine.step(np.zeros(12))
    robot, before = mechanics.momentum(), engine.state()
    engine.attach_payload(mass, point)
    arm = rotation(before.quat_xyzw) @ np.asarray(point)
    ball = np.asarray(before.velocity) + np.cross(before.angular_velocity, arm)
    together = robot[:3] + mass * ball
    for steps in (1, 100):
        for _ in range(steps):
            engine.step(np.zeros(12))
        after = engine.state()
        total = mechanics.momentum()[:3] + mass * payload_velocity(engine)
        np.testing.assert_allclose(total, together, atol=float(2e-3 * np.linalg.norm(together)))
        if steps == 1:
            jump = np.subtract(after.velocity, before.velocity)
            assert np.linalg.norm(jump) < 0.05 * mass / TOTAL_MASS * np.linalg.norm(before.velocity)
    engine.close()


# ----------------------------------------------------------------------------------------------------------- grf_pulse


def pulses(loads: list[float], **entry: Any) -> np.ndarray:
    """Force on the left foot at each step of a sequence of its loads, as planned; the right foot stands."""
    given = entry if "share" in entry else {"magnitude": 60.0, **entry}
    pulse = GrfPulses(1, np.array([0.0 if load == 0 else 0.5 for load in loads]), DT)
    pulse.begin(0, realize({"grf_pulse": given})["grf_pulse"], ojas())
    forces = np.array([pulse.forces(np.array([[load, 50.0]]), np.array([step]))[0] for step, load in enumerate(loads)])
    assert not forces[:, 1].any()
    return forces[:, 0]


@pytest.mark.parametrize(
    ("entry", "impulse"),
    [
        ({}, 2 * 60.0 * 0.1 / math.pi),
        ({"magnitude": 25.0, "duration": 0.3}, 2 * 25.0 * 0.3 / math.pi),
        ({"shape": "double_hump", "duration": 1.0}, 60.0 * 1.0 * 2 / math.pi * (1 + 0.4 / 3)),
        ({"shape": "double_hump", "duration": 0.5, "q": 0.8}, 60.0 * 0.5 * 2 / math.pi * (1 + 0.8 / 3)),
    ],
)
def test_a_landing_starts_one_pulse_of_the_right_impulse(entry: dict[str, Any], impulse: float) -> None:
    force = pulses([40.0] * 20 + [0.0] * SWING + [40.0] * 1500, **entry)
    assert not force[: 20 + SWING].any()
    duration = entry.get("duration", 0.1)
    (acting,) = np.nonzero(np.abs(force) > 1e-9)
    assert acting[0] in (20 + SWING, 21 + SWING)
    assert acting[-1] < 20 + SWING + round(duration / DT) + 1
    assert force.sum() * DT == pytest.approx(impulse, rel=1e-3)


def test_flicker_of_the_load_starts_no_pulse() -> None:
    assert not pulses([40.0] * 20 + ([0.0] * (SWING - 1) + [40.0]) * 5 + [40.0] * 50).any()
    once = pulses([40.0] + [0.0] * (SWING + 10) + [40.0] * 200)
    flickering = pulses([40.0] + [0.0] * (SWING + 10) + [40.0, 0.0, 0.0, 40.0] * 50)
    np.testing.assert_array_equal(flickering, once)  # neither cut short nor started again
    twice = pulses(([40.0] + [0.0] * (SWING + 10) + [40.0] * 200) * 2)
    np.testing.assert_allclose(twice, np.tile(once, 2), atol=1e-9)


@pytest.mark.parametrize("magnitude", [0.0, 30.0])
def test_the_pulse_acts_on_the_foot_that_lands(
    engine_name: EngineName, magnitude: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Landings by an independent count over the loads of every physics step, and the balance of vertical momentum."""
    env = make({"grf_pulse": magnitude} if magnitude else {}, duration=6.0, engine=engine_name)
    env.reset(seed=0)
    mechanics, record = Mechanics(env._engine), Recorder(env, monkeypatch)
    before = mechanics.momentum()
    run(env, 1490)
    loads = np.array(record.loads)
    assert len(loads) == 1490 * 4  # neither reset had to settle
    change = mechanics.momentum() - before
    force = np.zeros((len(loads), 2))
    for step, pushed in record.pushes.items():
        for site, vector in pushed:
            assert not vector[:2].any()
            force[step, ("left_foot", "right_foot").index(site)] = vector[2]

    landings = []
    for foot in (0, 1):
        unloaded = 0
        for step, load in enumerate(loads[:, foot]):
            if load <= 1.0:
                unloaded += 1
            else:
                if unloaded >= AIRBORNE / DT - 0.5:
                    landings.append((step, foot))
                unloaded = 0
    assert {foot for _, foot in landings} == {0, 1}
    expected = np.zeros_like(force)
    for landing, foot in sorted(landings):
        # the load of `landing` is known from the next step on
        time = DT * np.arange(100)
        expected[landing + 1 : landing + 101, foot] = magnitude * np.sin(math.pi * time / 0.1)
    np.testing.assert_allclose(force, expected, atol=1e-6 * max(magnitude, 1.0))
    impulse = DT * (loads.sum() + force.sum() - WEIGHT * len(loads))
    assert change[2] == pytest.approx(impulse, abs=0.01)


# -------------------------------------------------------------------------------------------------- friction and slope


@pytest.mark.parametrize("heading", [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1)])
def test_the_robot_slides_beyond_the_friction_angle_only(engine_name: EngineName, heading: tuple[int, int]) -> None:
    """Coulomb: it slides where the tangent of the slope exceeds the coefficient of the pair, within 4 %."""
    direction = np.array(heading) / np.hypot(*heading)
    env = make({}, observe_ground_force=True, engine=engine_name)
    mu = 0.1
    for excess in (0.96, 1.04):
        pitch, roll = np.degrees(np.arctan(excess * mu * direction))
        slope = {"pitch_deg": pitch, "roll_deg": roll}
        episode = run(env, 499, disturbances={"friction": mu, "slope": slope})
        down = -(episode.position[:, :2] @ direction)
        late = down[-1] - down[250]  # after it has come to rest, if it does
        x, y, z = episode.fields["ground_force"].reshape(-1, 2, 3)[250:].sum(axis=1).mean(axis=0)
        if excess < 1:
            assert abs(late) < 2e-3
        else:
            acceleration = G * (excess - 1) * mu / math.sqrt(1 + (excess * mu) ** 2)
            assert late > 0.8 * acceleration * (2.0**2 - 1.0**2) / 2
            assert math.hypot(x, y) / z == pytest.approx(mu, rel=0.01)


@pytest.mark.parametrize("slope", [{"pitch_deg": 4.0}, {"roll_deg": -5.0}, {"pitch_deg": -3.0, "roll_deg": 4.0}])
def test_a_slope_tilts_the_ground_force(engine_name: EngineName, slope: dict[str, float]) -> None:
    """At rest the ground's force opposes gravity, whose size a slope leaves alone."""
    env = make({"slope": slope}, observe_ground_force=True, engine=engine_name)
    episode = run(env, 499)
    force = episode.fields["ground_force"].reshape(-1, 2, 3).sum(axis=1)[250:].mean(axis=0)
    ahead, left = (math.tan(math.radians(slope.get(name, 0.0))) for name in ("pitch_deg", "roll_deg"))
    assert force[0] / force[2] == pytest.approx(ahead, abs=1e-3)
    assert force[1] / force[2] == pytest.approx(left, abs=1e-3)
    assert np.linalg.norm(force) == pytest.approx(WEIGHT, rel=2e-3)


def test_a_slope_falls_off_with_the_reset(engine_name: EngineName) -> None:
    env = make({}, observe_ground_force=True, engine=engine_name)
    run(env, 10, disturbances={"slope": 5.0})
    assert run(env, 100, disturbances={}).bits == run(make({}, observe_ground_force=True, engine=engine_name), 100).bits


def test_ground_forces_are_foot_loads_and_weight(engine_name: EngineName) -> None:
    env = make({}, observe_ground_force=True, engine=engine_name)
    episode = run(env, 400)
    force = episode.fields["ground_force"].reshape(-1, 2, 3)
    np.testing.assert_allclose(force[:, :, 2], [info["foot_loads"] for info in episode.infos], atol=1e-9)
    np.testing.assert_allclose(force[200:].sum(axis=1).mean(axis=0), [0, 0, WEIGHT], atol=1e-3 * WEIGHT)


# ------------------------------------------------------------------------------------------------------------- sensing

NOISE = {"position": 0.002, "velocity": 0.3, "tilt": 0.01, "angular_velocity": 0.05}
MEASURED = {"position": "q", "velocity": "qd", "tilt": "tilt", "angular_velocity": "base_angular_velocity"}


@functools.cache
def clean(control_period: float = 0.004, steps: int = 480) -> Run:
    """An undisturbed stand, whose torques can be fed to a robot with disturbed sensors."""
    return run(make({}, control_period=control_period, observe_ground_force=True), steps)


@pytest.mark.parametrize("only", [None, *NOISE])
def test_sensor_noise_is_white_and_where_it_belongs(only: str | None) -> None:
    noise = NOISE if only is None else {only: NOISE[only]}
    true = clean()
    env = make({"sensor_noise": noise}, observe_ground_force=True)
    noisy = run(env, 480, actions=true.actions)
    for name, field in MEASURED.items():
        error = noisy.fields[field] - true.fields[field]
        if name not in noise:
            assert not error.any()
            continue
        assert abs(error.mean()) < 4 * noise[name] / math.sqrt(error.size)
        assert error.std() == pytest.approx(noise[name], rel=4 / math.sqrt(2 * error.size))
        neighbor = (error[1:] * error[:-1]).mean() / noise[name] ** 2
        assert abs(neighbor) < 4 / math.sqrt(error.size)
    for field in set(true.fields) - set(MEASURED.values()):
        np.testing.assert_array_equal(noisy.fields[field], true.fields[field])


def test_sensors_leave_the_physics_alone() -> None:
    true = clean()
    noisy = run(make({"sensor_noise": NOISE, "encoder_bits": 10}), 480, actions=true.actions)
    for one, other in zip(noisy.states, true.states, strict=True):
        for here, there in zip(one, other, strict=True):
            np.testing.assert_array_equal(here, there)


@pytest.mark.parametrize("bits", [8, 12, 16])
@pytest.mark.parametrize("control_period", [0.001, 0.004])
def test_encoders_count(bits: int, control_period: float) -> None:
    env = make({"encoder_bits": bits}, control_period=control_period)
    episode = run(env, 200, actions=clean(control_period, 200).actions)
    count = 2 * math.pi / 2**bits
    q = episode.fields["q"]
    true = np.array([state.q for state in episode.states])
    np.testing.assert_allclose(q / count, np.round(q / count), atol=1e-9)
    assert np.abs(q - true).max() <= count / 2 + 1e-12
    assert not episode.fields["qd"][0].any()
    np.testing.assert_allclose(episode.fields["qd"][1:], np.diff(q, axis=0) / control_period, atol=1e-9)


# ----------------------------------------------------------------------------------------------------------- actuation


def probe(env: Any, change: np.ndarray, joint: int = KNEE) -> tuple[np.ndarray, np.ndarray]:
    """Feeds rest torques plus `change` (periods,) to a joint; returns rest torques and tau_applied of each period."""
    observation, _ = env.reset(seed=0)
    part = env.observation_layout["tau_applied"]
    rest, applied = observation[part].copy(), []
    for more in change:
        action = rest.copy()
        action[joint] += more
        applied.append(env.step(action)[0][part])
    return rest, np.array(applied)


@pytest.mark.parametrize("samples", [0, 1, 3])
@pytest.mark.parametrize("control_period", [0.001, 0.004])
def test_a_delay_of_n_samples_is_n_samples(
    samples: int, control_period: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    env = make({"action_delay": samples}, control_period=control_period)
    env.reset(seed=0)
    record, impulse = Recorder(env, monkeypatch), np.zeros(12)
    impulse[4] = 1.5
    rest, applied = probe(env, impulse)
    expected = np.tile(rest, (12, 1))
    expected[4 + samples, KNEE] += 1.5
    np.testing.assert_allclose(applied, expected, rtol=0, atol=1e-12)
    acting = np.array(record.torques[-12 * env._task.substeps :])  # what the engine really got
    np.testing.assert_allclose(acting, np.repeat(expected, env._task.substeps, axis=0), rtol=0, atol=1e-12)


@pytest.mark.parametrize("constant", [0.0, 0.002, 0.02, 0.1])
@pytest.mark.parametrize("control_period", [0.001, 0.004])
def test_motors_lag_exponentially(constant: float, control_period: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """tau(t) = tau_0 + 1 - exp(-t / T); what is reported is its mean over each control period, and what acts too."""
    env = make({"motor_lag": constant}, control_period=control_period)
    env.reset(seed=0)
    record = Recorder(env, monkeypatch)
    rest, applied = probe(env, np.ones(20))
    begin = control_period * np.arange(20)
    share = np.ones(20)
    if constant:
        lost = np.exp(-begin / constant) - np.exp(-(begin + control_period) / constant)
        share -= constant / control_period * lost
    expected = np.tile(rest, (20, 1))
    expected[:, KNEE] += share
    np.testing.assert_allclose(applied, expected, rtol=0, atol=1e-9)
    acting = np.array(record.torques[-20 * env._task.substeps :]).reshape(20, env._task.substeps, 12).mean(axis=1)
    np.testing.assert_allclose(acting, expected, rtol=0, atol=1e-9)


def in_the_air(env: Any) -> Mechanics:
    """Lifts the robot off the ground, its joints at rest where they are."""
    q = env._engine.state().q
    env._engine.reset((0.0, 0.0, 5.0), q)
    return Mechanics(env._engine)


def joint_acceleration(spec: RobotSpec, q: np.ndarray, tau: np.ndarray) -> np.ndarray:
    """qdd of the robot at rest in free fall, (12,)."""
    matrix = RigidBodyTree(spec).mass_matrix(q)
    return np.linalg.solve(matrix, np.concatenate([np.zeros(6), tau]))[6:]


def test_the_robot_feels_the_lag(engine_name: EngineName) -> None:
    env = make({"motor_lag": 0.01}, control_period=0.001, engine=engine_name)
    observation, _ = env.reset(seed=0)
    part, spec = env.observation_layout["tau_applied"], ojas("lumped")
    mechanics, tau = in_the_air(env), np.zeros(12)
    tau[KNEE] = 2.0
    for _ in range(10):
        before = mechanics.joints()
        applied = env.step(observation[part] + tau)[0][part]
        measured = (mechanics.joints()[1] - before[1]) / DT
        expected = joint_acceleration(spec, before[0], applied)
        np.testing.assert_allclose(measured, expected, atol=0.02 * np.abs(expected).max())


@pytest.mark.parametrize("control_period", [0.001, 0.004])
@pytest.mark.parametrize("start", [0.0, 0.008, 0.009, 0.012, 0.023])
def test_a_lost_actuator_gives_its_share_from_its_start(
    control_period: float, start: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    env = make(
        {"actuator_effectiveness": {"joint": "left_knee", "factor": 0.3, "start": start}}, control_period=control_period
    )
    env.reset(seed=0)
    record, count = Recorder(env, monkeypatch), 30
    rest, applied = probe(env, np.zeros(count))
    expected = np.tile(rest, (count * env._task.substeps, 1))
    expected[round(start / DT) :, KNEE] *= 0.3
    np.testing.assert_allclose(record.torques[-len(expected) :], expected, rtol=1e-12)
    mean = expected.reshape(count, env._task.substeps, 12).mean(axis=1)
    np.testing.assert_allclose(applied, mean, rtol=1e-12)


def test_all_actuators_can_be_lost() -> None:
    env = make({"actuator_effectiveness": {"joint": "all", "factor": 0.5, "start": 0.02}})
    rest, applied = probe(env, np.zeros(10))
    np.testing.assert_allclose(applied, np.concatenate([[rest] * 5, [0.5 * rest] * 5]), rtol=1e-12)


def test_losses_start_on_time_wherever_they_fall() -> None:
    """k * 0.001 is not always the double nearest to k / 1000: no start may slip by a step for it."""
    from artde_gym.disturbances.actuation import Actuation

    joints, one = ojas().actuated, np.ones(12)
    for step in (1, 9, 1001, 4097, 28001, 57999):
        losses = {"actuator_effectiveness": {"joint": "left_knee", "start": step / 1000}}
        actuation = Actuation(realize(losses), joints, DT)
        actuation.start(one)
        acting = [actuation.advance(actuation.target(one), k)[KNEE] for k in range(step - 2, step + 2)]
        assert acting == [1.0, 1.0, 0.0, 0.0]


# ---------------------------------------------------------------------------------------------------------- mass_scale


def scaled(spec: RobotSpec, factor: float) -> RobotSpec:
    links = [
        dataclasses.replace(link, mass=factor * link.mass, inertia=tuple(factor * moment for moment in link.inertia))
        for link in spec.links
    ]
    return dataclasses.replace(spec, links=tuple(links), armature=tuple(factor * a for a in spec.armature))


@pytest.mark.parametrize("factor", [0.7, 1.0, 1.4])
@pytest.mark.parametrize("inertia", ["lumped", "rotor"])
def test_mass_error_scales_weight_and_inertia(
    engine_name: EngineName, factor: float, inertia: Literal["lumped", "rotor"]
) -> None:
    env = make({"mass_scale": factor}, actuator_inertia=inertia, engine=engine_name)
    episode = run(env, 250)
    assert episode.load[100:].mean() == pytest.approx(factor * WEIGHT, rel=2e-3)

    spec = scaled(env._engine.spec, factor)  # with rotors as links: their own spin pushes the base
    for joint in (1, 2, KNEE, 4, 9):
        env.reset(seed=0)
        in_the_air(env)
        tau = np.zeros(12)
        tau[joint] = 3.0
        q = env._engine.state().q
        env._engine.step(tau)
        expected = joint_acceleration(spec, q, tau)
        measured = env._engine.state().qd / DT
        np.testing.assert_allclose(measured, expected, atol=2e-4 * np.abs(expected).max())


# -------------------------------------------------------------------------------------------------------- initial_pose


CROUCH = {f"{side}_{joint}": x for side in ("left", "right") for joint, x in (("hip_pitch", -0.1), ("knee", 0.2))}


@pytest.mark.parametrize(
    ("offsets", "compliance"),
    [
        ({**CROUCH, "left_ankle_pitch": -0.1, "right_ankle_pitch": -0.1}, 0.03),
        ({"left_ankle_pitch": 0.04, "right_ankle_pitch": 0.04}, 0.08),
        ({"right_hip_yaw": -0.1}, 0.1),  # turns the foot against friction
        ({"left_knee": 0.05}, 0.35),  # legs and ground are a closed chain: the other joints give way as well
    ],
    ids=["crouch", "ankles", "hip_yaw", "knee"],
)
def test_an_initial_pose_starts_off_by_its_offset_at_rest(
    engine_name: EngineName, offsets: dict[str, float], compliance: float
) -> None:
    env = make(
        {"initial_pose": [{"joint": joint, "offset": offset} for joint, offset in offsets.items()]}, engine=engine_name
    )
    observation, _ = env.reset(seed=0)
    fields = env.observation_layout.split(observation)
    expected = np.array([offsets.get(joint, 0.0) for joint in ojas().actuated])
    np.testing.assert_allclose(fields["q"] - fields["q_ref"], expected, atol=compliance * np.abs(expected).max())
    assert np.abs(fields["qd"]).max() < 0.03
    assert np.abs(fields["base_velocity"]).max() < 0.015
    assert np.array(env._engine.foot_loads()).sum() == pytest.approx(WEIGHT, rel=0.03)


def test_an_initial_pose_can_name_all_joints(engine_name: EngineName) -> None:
    env = make({"initial_pose": {"joint": "all", "offset": {"uniform": [-0.02, 0.02]}}}, engine=engine_name)
    env.reset(seed=3)
    drawn = env.unwrapped.sampled_disturbances["initial_pose"]
    assert [entry["joint"] for entry in drawn] == list(ojas().actuated)
    assert len({entry["offset"] for entry in drawn}) == 12
    error = env._engine.state().q - env.pattern.q[0]
    np.testing.assert_allclose(error, [entry["offset"] for entry in drawn], atol=0.012)


# --------------------------------------------------------------------------------------------------------- composition

UNIFORM = {"uniform": [-0.01, 0.01]}
EVERYTHING: dict[str, Any] = {
    "payload": {"mass": {"uniform": [0.5, 1.5]}, "position": [UNIFORM, UNIFORM, 0.16], "detach_time": 0.9},
    "push": [
        {
            "body": "chest",
            "magnitude": {"uniform": [1, 5]},
            "direction": [{"normal": [0, 1]}, {"normal": [0, 1]}, 0],
            "start": {"uniform": [0.1, 0.2]},
        }
    ],
    "grf_pulse": {"magnitude": {"uniform": [10, 20]}},
    "friction": {"choice": [0.7, 0.8]},
    "slope": {"pitch_deg": {"uniform": [-1, 1]}, "roll_deg": {"uniform": [-1, 1]}},
    "encoder_bits": {"uniform": [18, 20]},
    "action_delay": {"choice": [0, 1]},
    "motor_lag": {"uniform": [0.0005, 0.001]},
    "actuator_effectiveness": {"joint": "all", "factor": {"uniform": [0.9, 1.0]}, "start": 0.3},
    "mass_scale": {"normal": [1.0, 0.02]},
    "initial_pose": {"joint": "all", "offset": {"uniform": [-0.005, 0.005]}},
}


def test_all_at_once_are_deterministic_and_can_be_repeated_from_what_was_drawn(engine_name: EngineName) -> None:
    kwargs: dict[str, Any] = {"control_period": 0.001}
    env = make(EVERYTHING, **kwargs, engine=engine_name)
    first = run(env, 600, seed=7)
    run(env, 30, seed=8)
    assert run(env, 600, seed=7).bits == first.bits
    assert run(make(EVERYTHING, **kwargs, engine=engine_name), 600, seed=7).bits == first.bits
    drawn = env.unwrapped.sampled_disturbances
    assert drawn.keys() == EVERYTHING.keys()
    assert Disturbances.parse(drawn, ("chest",), ojas().actuated, "ojas").sample(np.random.default_rng(1)) == drawn
    assert run(make(drawn, **kwargs, engine=engine_name), 600, seed=99).bits == first.bits


def test_noise_comes_from_the_seed() -> None:
    env = make({**EVERYTHING, "sensor_noise": 1e-5}, control_period=0.001)
    first = run(env, 100, seed=7)
    assert run(env, 100, seed=7).bits == first.bits
    drawn = env.unwrapped.sampled_disturbances
    repeated = make(drawn, control_period=0.001)
    other = run(repeated, 100, seed=99)
    assert repeated.unwrapped.sampled_disturbances == drawn
    assert other.bits != first.bits


FORMER: list[dict[str, Any]] = [
    {"mass_scale": 1.4},
    {"friction": 0.1, "slope": {"roll_deg": 3.0}},
    {"payload": {"mass": 2.0, "detach_time": 0.1}},
    {"initial_pose": {"joint": "left_knee", "offset": 0.1}},
    {"actuator_effectiveness": {"joint": "all"}, "action_delay": 2, "motor_lag": 0.01},
]


@pytest.mark.parametrize(
    ("inertia", "before"),
    [*(("lumped", before) for before in FORMER), ("rotor", FORMER[0]), ("rotor", FORMER[1])],
    ids=lambda value: value if isinstance(value, str) else next(iter(value)),
)
def test_a_reset_without_a_disturbance_leaves_no_trace(
    engine_name: EngineName, inertia: str, before: dict[str, Any]
) -> None:
    """Bit for bit the trajectory of an environment that has never been disturbed, even after a fall."""
    env, fresh = (
        make({}, actuator_inertia=inertia, engine=engine_name),
        make({}, actuator_inertia=inertia, engine=engine_name),
    )
    env.reset(seed=0, options={"disturbances": before})
    for _ in range(300):
        if env.step(np.zeros(12))[2]:
            break
    else:
        pytest.fail("it stands without torques")
    nominal = run(fresh, 60)
    assert run(env, 60, disturbances={}).bits == nominal.bits
    changed = {"friction": 0.75}
    assert run(env, 60, disturbances=changed).bits == run(fresh, 60, disturbances=changed).bits


# -------------------------------------------------------------------------------------------------------- BipedPush-v0


def test_biped_push_has_the_pushes_of_the_thesis() -> None:
    env = gym.make("BipedPush-v0", disable_env_checker=True, actuator_inertia="lumped", duration=2.0)
    drawn = sampled(env, seed=0)
    assert drawn["payload"]["mass"] == 1.3
    chest, arm = drawn["push"]
    assert chest == {"body": "chest", "magnitude": 10.0, "direction": [1.0, 0.0, 0.0], "start": 28.0, "duration": 0.2}
    assert (arm["body"], arm["magnitude"], arm["start"], arm["duration"]) == ("left_arm", 10.0, 37.0, 0.2)
    direction = np.array(arm["direction"]) / np.linalg.norm(arm["direction"])
    assert abs(direction[2]) == pytest.approx(math.cos(math.radians(45)))


@pytest.mark.parametrize("kwargs", [{}, {"arms": "revolute", "observe_ground_force": True}])
def test_biped_push_passes_gymnasiums_checker(drawing_engine: EngineName, kwargs: dict[str, Any]) -> None:
    shared: dict[str, Any] = {"duration": 4.0, "actuator_inertia": "lumped", "render_mode": "rgb_array"}
    env = gym.make("BipedPush-v0", engine=drawing_engine, **shared, **kwargs)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", ".* can never happen")
        # torques are in Nm by design; RescaleAction gives [-1, 1]
        warnings.filterwarnings("ignore", message=".*recommend using a symmetric and normalized space")
        check_env(env.unwrapped)
    env.close()


def test_biped_push_spec_survives_json() -> None:
    kwargs: dict[str, Any] = {"duration": 2.0, "actuator_inertia": "lumped", "disturbances": EVERYTHING}
    env = gym.make("BipedPush-v0", disable_env_checker=True, **kwargs)
    assert env.spec is not None
    again = gym.make(EnvSpec.from_json(env.spec.to_json()))
    first, second = (sampled(each, seed=3) for each in (env, again))
    assert first == second
    assert first["grf_pulse"]["magnitude"] > 10
