"""The engine protocol by its words, for every engine: settings, state, forces; robots with joints and without."""

from __future__ import annotations

import dataclasses
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from artde_gym.errors import OptionError, RobotError
from artde_gym.multibody.dynamics import RigidBodyTree
from artde_gym.multibody.spec import RobotSpec, box_link
from artde_gym.robots.ojas.model import ojas
from artde_gym.sim.engine import Camera, Engine, State
from artde_gym.sim.factory import EngineName, make_engine

pytestmark = pytest.mark.once

DT = 0.001
G = 9.81
STANDING = 0.45  # m, hip line over the ground, with straight legs
NOTHING = (0.0, 0.0, 0.0)


def brick(center: tuple[float, float, float] = (0.03, -0.02, 0.05)) -> RobotSpec:
    """A floating box without joints, its center of mass off its frame's origin."""
    link = box_link("brick", 2.0, (0.2, 0.12, 0.1), center, collides=True)
    return RobotSpec("brick", (link,), (), 0.0, ("brick",), sites=(("corner", "brick", (0.13, 0.04, 0.1)),))


@pytest.fixture
def engine(engine_name: EngineName) -> Iterator[Engine]:
    """Ojas, hanging in the air with bent joints."""
    engine = make_engine(engine_name, ojas("lumped"), DT)
    engine.set_friction(0.8)
    engine.reset((0.3, -0.2, 3.0), np.linspace(-0.4, 0.5, 12))
    yield engine
    engine.close()


def steps(engine: Engine, count: int, tau: np.ndarray | None = None) -> State:
    for _ in range(count):
        engine.step(np.zeros(len(engine.spec.actuated)) if tau is None else tau)
    return engine.state()


def bits(state: State) -> bytes:
    return np.concatenate([np.ravel(part) for part in state]).tobytes()


def stand(engine: Engine, count: int = 100) -> State:
    """Ojas on straight legs, under stiff springs."""
    engine.reset((0.0, 0.0, STANDING), np.zeros(12))
    for _ in range(count):
        state = engine.state()
        engine.step(-400.0 * state.q - 10.0 * state.qd)
    return engine.state()


# --------------------------------------------------------------------------------------------------------------- state


def test_a_placed_robot_is_where_it_was_put_at_rest(engine: Engine) -> None:
    steps(engine, 20, np.ones(12))
    q = np.linspace(0.3, -0.2, 12)
    engine.reset((1.0, 2.0, 3.0), q)
    state = engine.state()
    np.testing.assert_allclose(state.q, q, atol=1e-15)
    np.testing.assert_allclose(state.position, (1.0, 2.0, 3.0), atol=1e-15)
    np.testing.assert_allclose(state.quat_xyzw, (0.0, 0.0, 0.0, 1.0), atol=1e-15)
    for speed in (state.qd, state.velocity, state.angular_velocity):
        assert not np.any(speed)


def test_velocities_are_rates_of_positions_in_world_axes(engine: Engine) -> None:
    """Central differences of what `read` says of places, while the robot tumbles and its joints swing."""
    for _ in range(100):
        engine.apply_force("chest", (30.0, 40.0, -20.0))
        engine.step(np.full(12, 0.3))
    before, now, after = (steps(engine, 1) for _ in range(3))
    spin = Rotation.from_quat(after.quat_xyzw) * Rotation.from_quat(before.quat_xyzw).inv()
    rates = (
        (np.subtract(after.position, before.position), now.velocity),
        (spin.as_rotvec(), now.angular_velocity),
        (after.q - before.q, now.qd),
    )
    assert np.linalg.norm(now.angular_velocity) > 1.0
    for change, rate in rates:  # semi-implicit: the step to now took the velocity of now
        np.testing.assert_allclose(change / (2 * DT), rate, rtol=0, atol=0.01 * float(np.linalg.norm(rate)))


def test_what_was_read_stays_as_it_was(engine: Engine) -> None:
    state, loads, forces = engine.state(), engine.foot_loads(), engine.ground_forces()
    kept = bits(state), loads, forces.tobytes()
    steps(engine, 10, np.ones(12))
    assert (bits(state), loads, forces.tobytes()) == kept


def test_a_snapshot_is_the_whole_state(engine: Engine) -> None:
    """Motion, contacts, what the solver remembers, friction: bit for bit, whatever happened since."""
    stand(engine)
    loads, forces = engine.foot_loads(), engine.ground_forces()
    snapshot = engine.save_state()
    expected = bits(steps(engine, 50, np.full(12, 0.2)))
    engine.set_friction(0.1)
    engine.attach_payload(2.0, (0.0, 0.0, 0.2))
    steps(engine, 30, np.full(12, -3.0))
    engine.release_payload()
    engine.restore_state(snapshot)
    assert engine.foot_loads() == loads
    np.testing.assert_array_equal(engine.ground_forces(), forces)
    assert bits(steps(engine, 50, np.full(12, 0.2))) == expected
    later = engine.save_state()
    engine.restore_state(snapshot)
    assert bits(steps(engine, 50, np.full(12, 0.2))) == expected
    engine.restore_state(later)
    assert bits(engine.state()) == expected


# -------------------------------------------------------------------------------------------------------------- forces


def test_torques_act_on_their_joints_in_the_order_of_the_spec(engine: Engine) -> None:
    tree, q = RigidBodyTree(engine.spec), engine.state().q
    engine.set_gravity(NOTHING)
    tau = np.linspace(-2.0, 3.0, 12)
    force = np.concatenate([np.zeros(6), tau])
    expected = np.linalg.solve(tree.mass_matrix(q), force)[6:]
    engine.step(tau)
    np.testing.assert_allclose(engine.state().qd / DT, expected, rtol=0, atol=float(2e-4 * np.abs(expected).max()))


def test_torques_find_joints_in_any_order_and_the_rest_is_held(engine_name: EngineName) -> None:
    whole = ojas("lumped")
    names = tuple(reversed(whole.actuated[::2]))
    engine = make_engine(engine_name, dataclasses.replace(whole, actuated=names, armature=(0.0,) * 6), DT)
    q = np.linspace(0.1, 0.6, 6)
    engine.set_gravity(NOTHING)
    engine.reset((0.0, 0.0, 3.0), q)
    np.testing.assert_allclose(engine.state().q, q, atol=1e-15)
    engine.step(np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0]))
    assert np.argmax(engine.state().qd) == 2
    engine.close()


def twist_of_mass(engine: Engine) -> tuple[np.ndarray, np.ndarray]:
    """Velocity of the base link's center of mass, and its spin."""
    state = engine.state()
    arm = Rotation.from_quat(state.quat_xyzw).apply(engine.spec.base.com)
    spin = np.array(state.angular_velocity)
    return state.velocity + np.cross(spin, arm), spin


def test_a_push_on_the_base_acts_at_its_centre_of_mass_for_one_step(engine_name: EngineName) -> None:
    spec = brick()
    engine = make_engine(engine_name, spec, DT)
    engine.set_gravity(NOTHING)
    engine.reset((0.0, 0.0, 3.0), np.zeros(0))
    engine.apply_force("corner", (30.0, -20.0, 50.0))  # a slow spin: its own change in a step is of the order of DT
    rot = Rotation.from_quat(steps(engine, 1500).quat_xyzw)
    assert rot.magnitude() > 0.5
    snapshot, force, torque = engine.save_state(), (3.0, -2.0, 1.0), (0.02, 0.05, -0.03)
    steps(engine, 1)
    free = twist_of_mass(engine)
    engine.restore_state(snapshot)
    engine.apply_base_wrench(force, torque)
    steps(engine, 1)
    pushed = twist_of_mass(engine)
    world = rot.as_matrix()
    inertia = rot.as_matrix() @ np.diag(spec.base.inertia) @ rot.as_matrix().T
    np.testing.assert_allclose(pushed[0] - free[0], DT * world @ force / spec.mass, rtol=1e-3, atol=1e-7)
    np.testing.assert_allclose(pushed[1] - free[1], DT * np.linalg.solve(inertia, world @ torque), rtol=0, atol=2e-5)
    steps(engine, 1)
    np.testing.assert_allclose(twist_of_mass(engine)[0], pushed[0], atol=1e-5)  # it does not act again
    engine.close()


def test_pushes_in_one_step_add_up_and_none_leaves_no_trace(engine: Engine) -> None:
    snapshot = engine.save_state()
    alone = bits(steps(engine, 20))
    engine.restore_state(snapshot)
    engine.apply_force("chest", NOTHING)
    engine.apply_base_wrench(NOTHING, NOTHING)
    assert bits(steps(engine, 20)) == alone

    def change(*forces: tuple[float, float, float]) -> np.ndarray:
        engine.restore_state(snapshot)
        for force in forces:
            engine.apply_force("left_foot", force)
        after = steps(engine, 1)
        return np.concatenate([after.qd, after.velocity, after.angular_velocity])

    together = change((3.0, 0.0, 1.0), (1.0, -2.0, 0.0))
    np.testing.assert_allclose(together, change((4.0, -2.0, 1.0)), rtol=0, atol=1e-12)
    assert np.abs(together - change()).max() > 1e-3


def test_a_site_that_is_none_is_refused(engine: Engine) -> None:
    with pytest.raises(RobotError, match=r"'tail'.*'chest'"):
        engine.apply_force("tail", (1.0, 0.0, 0.0))


def test_feet_feel_what_they_carry(engine: Engine) -> None:
    assert engine.foot_loads() == (0.0, 0.0)
    assert not engine.ground_forces().any()
    stand(engine, 400)
    loads, forces = engine.foot_loads(), engine.ground_forces()
    assert sum(loads) == pytest.approx(8.986 * G, rel=2e-3)
    np.testing.assert_allclose(forces[:, 2], loads, atol=1e-9)
    for _ in range(300):  # pressed to the left
        state = engine.state()
        engine.apply_force("torso", (0.0, 6.0, 0.0))
        engine.step(-400.0 * state.q - 10.0 * state.qd)
    left, right = engine.foot_loads()
    assert left > right + 10.0
    np.testing.assert_allclose(engine.ground_forces()[:, 1].sum(), -6.0, atol=0.6)


# ------------------------------------------------------------------------------------------------------------ settings


def test_settings_outlive_a_place_and_masses_a_restore(engine: Engine) -> None:
    snapshot = engine.save_state()
    engine.set_gravity((1.0, -2.0, -3.0))
    engine.scale_masses(1.5)
    engine.reset((0.0, 0.0, 3.0), np.zeros(12))
    np.testing.assert_allclose(steps(engine, 1).velocity, (DT, -2 * DT, -3 * DT), rtol=1e-9)
    engine.restore_state(snapshot)
    tree, q = RigidBodyTree(engine.spec), engine.state().q
    engine.set_gravity(NOTHING)
    engine.step(np.ones(12))
    expected = np.linalg.solve(1.5 * tree.mass_matrix(q), np.concatenate([np.zeros(6), np.ones(12)]))[6:]
    np.testing.assert_allclose(engine.state().qd / DT, expected, rtol=0, atol=float(1e-3 * np.abs(expected).max()))


def test_masses_can_be_scaled_while_a_payload_hangs_on(engine: Engine) -> None:
    engine.attach_payload(2.0, (0.0, 0.0, 0.2))
    engine.scale_masses(1.2)
    stand_loads = []
    for factor in (1.2, 0.8, 1.0):
        engine.scale_masses(factor)
        engine.reset((0.0, 0.0, STANDING), np.zeros(12))
        engine.attach_payload(2.0, (0.0, 0.0, 0.2))
        for _ in range(400):
            state = engine.state()
            engine.step(-400.0 * state.q - 10.0 * state.qd)
        stand_loads.append(sum(engine.foot_loads()))
    expected = [(factor * 8.986 + 2.0) * G for factor in (1.2, 0.8, 1.0)]
    np.testing.assert_allclose(stand_loads, expected, rtol=3e-3)


# ------------------------------------------------------------------------------------------------------ without joints


def test_a_robot_without_joints_falls_lands_and_rests(engine_name: EngineName) -> None:
    engine = make_engine(engine_name, brick((0.0, 0.0, 0.05)), DT)
    engine.set_friction(0.5)
    engine.reset((0.0, 0.0, 0.5), np.zeros(0))
    state = steps(engine, 100)
    assert state.q.shape == state.qd.shape == (0,)
    np.testing.assert_allclose(state.position, (0.0, 0.0, 0.5 - G * 0.1**2 / 2), atol=1e-3)
    assert engine.foot_loads() == (0.0,)
    state = steps(engine, 900)
    assert state.position[2] == pytest.approx(0.0, abs=2e-3)
    assert engine.foot_loads()[0] == pytest.approx(2.0 * G, rel=1e-3)
    assert engine.ground_forces().shape == (1, 3)
    engine.close()


def test_a_payload_on_a_robot_without_joints(engine_name: EngineName) -> None:
    """Held it is part of the body: they fall together, and a push turns both about their common center of mass."""
    engine, mass, place = make_engine(engine_name, brick(NOTHING), DT), 1.0, np.array([0.0, 0.0, -0.3])
    engine.set_gravity(NOTHING)
    engine.reset((0.0, 0.0, 3.0), np.zeros(0))
    engine.attach_payload(mass, (0.0, 0.0, -0.3))
    for _ in range(10):
        engine.apply_base_wrench((6.0, 0.0, 0.0), NOTHING)
        engine.step(np.zeros(0))
    state = engine.state()
    inertia = engine.spec.base.inertia[1] + 0.4 * mass * 0.08**2 + 2.0 * mass / 3.0 * 0.3**2
    spin = 0.06 * 0.1 / inertia  # impulse times its arm from the common center, a third of the way to the payload
    assert state.angular_velocity[1] == pytest.approx(spin, rel=5e-3)
    common = np.array(state.velocity) + np.cross(state.angular_velocity, place / 3)
    np.testing.assert_allclose(common, (0.06 / 3.0, 0.0, 0.0), atol=2e-4)
    engine.release_payload()
    after = steps(engine, 100)
    np.testing.assert_allclose(after.velocity, state.velocity, atol=2e-4)  # no jump, and nothing pulls any more
    np.testing.assert_allclose(after.angular_velocity, state.angular_velocity, rtol=2e-3, atol=1e-6)
    engine.close()


def test_resets_with_payloads_do_not_grow(engine: Engine) -> None:
    snapshot = engine.save_state()

    def cycle(count: int) -> None:
        for number in range(count):
            engine.restore_state(snapshot)
            engine.attach_payload(1.0 + number % 3, (0.0, 0.0, 0.2))
            steps(engine, 2)
            engine.release_payload()
            steps(engine, 2)

    def resident() -> int:
        return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * 4096

    cycle(500)
    before = resident()
    cycle(3000)
    assert resident() - before < 2e6


# ------------------------------------------------------------------------------------------------------------- pictures


def test_the_camera_looks_where_it_is_told(drawing_engine: EngineName) -> None:
    """A brick in the middle of the picture, and left, right, above and nearer by as much as perspective says."""
    engine = make_engine(drawing_engine, brick(NOTHING), DT, renders=True)
    engine.reset((0.0, 0.0, 1.0), np.zeros(0))

    def seen(camera: Camera) -> tuple[float, float, int]:
        """Column, row and number of the pixels that are brick: neither white nor blue."""
        picture = engine.render(camera).astype(int)
        assert picture.shape == (camera.height, camera.width, 3)
        rows, columns = np.nonzero((picture[..., 2] - picture[..., 0] < 20) & (picture.max(axis=-1) < 215))
        return columns.mean(), rows.mean(), len(rows)

    camera = Camera((0.0, 0.0, 1.0), distance=2.0, yaw_deg=0.0, pitch_deg=0.0, width=400, height=300)
    column, row, size = seen(camera)
    assert (column, row) == (pytest.approx(199.5, abs=3), pytest.approx(149.5, abs=6))
    pixels_per_meter = 150 / np.tan(np.radians(20.0)) / 2.0  # at two meters; 40 degrees from top to bottom
    assert size == pytest.approx(0.2 * 0.1 * pixels_per_meter**2, rel=0.15)  # seen from -y
    moved, *_ = seen(camera._replace(target=(0.3, 0.0, 1.0)))
    assert moved == pytest.approx(column - 0.3 * pixels_per_meter, abs=4)
    _, lower, _ = seen(camera._replace(target=(0.0, 0.0, 1.2)))
    assert lower == pytest.approx(row + 0.2 * pixels_per_meter, abs=4)
    *_, turned = seen(camera._replace(yaw_deg=90.0))
    assert turned == pytest.approx(size * 0.12 / 0.2, rel=0.15)
    assert seen(camera._replace(width=800, height=600))[2] == pytest.approx(4 * size, rel=0.05)
    engine.close()
    engine.close()


# ------------------------------------------------------------------------------------------------- what cannot be done


def test_unknown_engines_are_refused() -> None:
    with pytest.raises(OptionError, match=r"'ode'.*'bullet', 'mujoco'"):
        make_engine("ode", ojas(), DT)  # pyright: ignore[reportArgumentType]


def test_mujoco_refuses_rotors_that_are_links() -> None:
    with pytest.raises(RobotError, match="bullet"):
        make_engine("mujoco", ojas("rotor").with_rotor_links(), DT)


def test_mujoco_says_what_it_needs_to_draw() -> None:
    """In a process of its own, where no library of OpenGL can be found."""
    script = (
        "from artde_gym.sim import opengl\n"
        "opengl._LIBRARIES = {'egl': 'libNone.so.1'}\n"
        "import gymnasium, artde_gym\n"
        "kwargs = dict(duration=1.0, disable_env_checker=True, engine='mujoco')\n"
        "gymnasium.make('BipedWalk-Payload-v0', **kwargs)\n"
        "gymnasium.make('BipedWalk-Payload-v0', render_mode='rgb_array', **kwargs)\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert (
        done.stderr.rstrip()
        .splitlines()[-1]
        .startswith("artde_gym.errors.OptionError: render_mode 'rgb_array' needs OpenGL")
    )
    assert "libosmesa6" in done.stderr
    assert "'bullet'" in done.stderr
