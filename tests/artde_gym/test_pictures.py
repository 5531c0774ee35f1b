"""Pictures: what is where in them, what they show of pushes and payloads, and that drawing changes nothing."""

from __future__ import annotations

import dataclasses
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import controllers
from artde_gym.envs.view import PUSH
from artde_gym.errors import OptionError, RobotError
from artde_gym.multibody.dynamics import RigidBodyTree
from artde_gym.multibody.spec import RobotSpec, box_link
from artde_gym.robots.ojas.model import ojas
from artde_gym.sim.camera import Camera
from artde_gym.sim.factory import EngineName, make_engine
from artde_gym.sim.ground import SUN, Shadow
from artde_gym.sim.rotation import matrix

pytestmark = pytest.mark.once

WALK, FLIGHT = "BipedWalk-Payload-v0", "QuadInfinity-Payload-v0"
KICK = {"body": "chest", "magnitude": 30.0, "direction": [1.0, 0.0, 0.0], "start": 0.2, "duration": 0.1}


def make(env_id: str = WALK, **kwargs: Any) -> Any:
    return gym.make(env_id, disable_env_checker=True, **kwargs)


def cube() -> RobotSpec:
    """Black, so that it differs from everything else."""
    link = box_link("cube", 1.0, (0.1, 0.1, 0.1), (0.0, 0.0, 0.0))
    black = dataclasses.replace(link.visuals[0], color=(0.05, 0.05, 0.05, 1.0))
    return RobotSpec("cube", (dataclasses.replace(link, visuals=(black,)),), (), 0.0)


def run(env: Any, steps: int, *, draw: bool = False) -> np.ndarray:
    """Observations of a seeded episode under TDE."""
    policy, state = controllers.make("tde", env), None
    observation, _ = env.reset(seed=3)
    seen = [observation]
    for _ in range(steps):
        action, state = policy.predict(observation, state)
        observation = env.step(action)[0]
        seen.append(observation)
        if draw:
            env.unwrapped.view.reset()  # a new picture each time
            env.render()
    return np.array(seen)


def like(picture: np.ndarray, color: tuple[int, ...]) -> np.ndarray:
    return np.abs(picture.astype(int) - color).max(axis=-1) < 12


@pytest.mark.parametrize("pitch", [0.0, 25.0])
def test_a_camera_projects_as_engines_do(drawing_engine: EngineName, pitch: float) -> None:
    engine = make_engine(drawing_engine, cube(), 0.001, renders=True)
    camera = Camera((0.0, 0.0, 1.0), distance=2.5, yaw_deg=33.0, pitch_deg=pitch, width=400, height=300)
    for place in ((0.0, 0.0, 1.0), (0.5, -0.2, 1.3), (-0.4, 0.5, 0.8)):
        engine.reset(place, np.zeros(0))
        picture = engine.render(camera).astype(int)
        rows, columns = np.nonzero(picture.max(axis=-1) < 60)
        expected = camera.pixels([place])[0]
        np.testing.assert_allclose((columns.mean() + 0.5, rows.mean() + 0.5), expected, atol=4)
    engine.close()


def test_what_is_behind_the_eye_has_no_pixel() -> None:
    camera = Camera((0.0, 0.0, 1.0))
    behind = camera.eye - camera.axes[2]
    assert np.isnan(camera.pixels([behind])).all()
    np.testing.assert_allclose(camera.pixels([camera.target])[0], (320.0, 240.0), atol=1e-9)


def test_the_sun_casts_a_shadow_where_geometry_says(drawing_engine: EngineName) -> None:
    engine = make_engine(drawing_engine, cube(), 0.001, renders=True)
    engine.reset((0.0, 0.0, 0.6), np.zeros(0))
    camera = Camera((0.0, 0.0, 0.3), distance=3.0, pitch_deg=35.0)
    picture = engine.render(camera).astype(int)
    x, y, z = SUN
    shade = (-0.6 * x / z, -0.6 * y / z, 0.0)
    inside, outside = (picture[int(v), int(u)] for u, v in camera.pixels([shade, (0.4, 0.7, 0.0)]))
    assert inside[0] < 200 < outside[0]
    engine.close()


@pytest.mark.bullet
def test_a_shadow_is_a_projection_along_the_sun_of_every_box() -> None:
    """Corners of a robot's boxes, by its rigid-body algebra, fall into the hull of its shadow's polygons."""
    spec, rng = ojas("none"), np.random.default_rng(0)
    engine = make_engine("bullet", spec, 0.001)
    engine.reset((0.3, -0.1, 1.0), rng.uniform(-0.5, 0.5, 12))
    state = engine.state()
    points = np.concatenate(Shadow(spec).polygons(state, None))
    assert np.array_equal(points[:, 2], np.zeros(len(points)))
    frames = RigidBodyTree(spec).frames(state.q, np.array(matrix(state.quat_xyzw)).reshape(3, 3))
    names = [link.name for link in spec.merged().links]
    for link in spec.merged().links:
        for box in link.visuals:
            corner = np.add(box.center, np.multiply(box.size, 0.5))
            number = names.index(link.name)
            where = frames.rot[number] @ corner + frames.origin[number] + state.position
            fallen = where - where[2] / SUN[2] * np.asarray(SUN)
            assert np.abs(points - fallen).max(axis=1).min() < 1e-9
    engine.close()


def test_a_site_is_where_rigid_body_algebra_has_it(engine_name: EngineName) -> None:
    spec = ojas("lumped")
    engine = make_engine(engine_name, spec, 0.001)
    engine.set_friction(0.8)
    engine.reset((0.3, -0.2, 2.0), np.linspace(-0.4, 0.5, 12))
    for _ in range(30):
        engine.apply_base_wrench((0.0, 0.0, 0.0), (2.0, 1.0, 0.5))
        engine.step(np.zeros(12))
    state, tree = engine.state(), RigidBodyTree(spec)
    frames = tree.frames(state.q, np.array(matrix(state.quat_xyzw)).reshape(3, 3))
    names = [link.name for link in spec.merged().links]
    for name, link, offset in spec.sites:
        number = names.index(link)
        expected = frames.rot[number] @ offset + frames.origin[number] + state.position
        np.testing.assert_allclose(engine.site(name), expected, atol=1e-6)
    with pytest.raises(RobotError, match="'nose'"):
        engine.site("nose")
    engine.close()


@pytest.mark.parametrize("env_id", [WALK, FLIGHT])
def test_drawing_changes_nothing(drawing_engine: EngineName, env_id: str) -> None:
    kwargs = {"engine": drawing_engine, "duration": 2.0, "disturbances": {"payload": 0.3}}
    quiet, drawn = make(env_id, **kwargs), make(env_id, render_mode="rgb_array", width=64, height=48, **kwargs)
    assert run(quiet, 40).tobytes() == run(drawn, 40, draw=True).tobytes()
    quiet.close()
    drawn.close()


def test_a_push_is_an_arrow_onto_its_point_while_it_acts(drawing_engine: EngineName) -> None:
    env = make(engine=drawing_engine, duration=1.0, render_mode="rgb_array", disturbances={"push": [KICK]})
    plant = env.unwrapped
    run(env, 250)
    picture = env.render()
    camera = plant.view.following((float(plant.pattern.base[250, 0]), 0.0, 0.42))
    column, row = camera.pixels([plant.engine.site("chest")])[0]
    rows, columns = np.nonzero(like(picture, PUSH))
    ahead = columns > column - 15  # the head of the arrow, which points to the right
    assert len(columns) > 300
    assert columns.max() == pytest.approx(column, abs=4)
    assert rows[ahead].mean() == pytest.approx(row, abs=6)
    run(env, 150)
    assert not like(env.render(), PUSH).any()
    env.close()


def test_a_new_picture_thirty_times_a_second_and_in_the_end() -> None:
    env = make(duration=0.5, render_mode="rgb_array", width=64, height=48, disturbances={})
    assert env.metadata["render_fps"] == 50
    env.reset(seed=0)
    pictures, over = [env.render()], False
    while not over:
        _, _, terminated, truncated, _ = env.step(env.unwrapped._tau)
        over = terminated or truncated
        pictures.append(env.render())
    assert len(pictures) == 501
    assert 1 < len({picture.tobytes() for picture in pictures}) <= 16
    env.close()


def test_words_and_size_are_the_users() -> None:
    env = make(duration=1.0, render_mode="rgb_array", width=320, height=240, disturbances={})
    env.reset(seed=0)
    plain = env.render()
    env.unwrapped.view.caption = "tde"
    env.unwrapped.view.reset()
    named = env.render()
    assert plain.shape == named.shape == (240, 320, 3)
    changed = np.nonzero((plain != named).any(axis=-1))
    assert changed[0].min() > 190  # in the lower left corner
    assert changed[1].max() < 160
    env.close()
    cases: list[dict[str, Any]] = [{"width": 0}, {"height": 99999}, {"width": 12.5}]
    for wrong in cases:
        with pytest.raises(OptionError, match="16 to 4096"):
            make(duration=1.0, **wrong)


def test_the_payload_is_in_the_picture_until_it_is_dropped(drawing_engine: EngineName) -> None:
    env = make(FLIGHT, engine=drawing_engine, render_mode="rgb_array", disturbances={"payload": 0.35})

    def orange() -> int:
        env.unwrapped.view.reset()
        picture = env.render().astype(int)
        return int((picture[..., 0] > picture[..., 2] + 80).sum())

    run(env, 20)
    held = orange()
    assert held > 150
    assert env.unwrapped.drop_payload()
    for _ in range(100):
        env.step(np.array([1.48 * 9.81, 0.0, 0.0, 0.0]))
    assert env.unwrapped.engine.payload_position()[2] < -1.0
    assert orange() < held / 5
    env.close()
