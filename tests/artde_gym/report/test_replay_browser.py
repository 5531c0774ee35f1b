"""Replays in a real browser: the poses are the simulation's, everything can be pressed, and nothing fails."""

from __future__ import annotations

import json
import time
from typing import Any

import numpy as np
import pytest
from PIL import Image

import artde_gym
import controllers
from artde_gym.evaluation import evaluate
from artde_gym.evaluation.cells import cells_of, single_of
from artde_gym.evaluation.seeds import episode_seed
from artde_gym.motion.motion import DEEPEST, JOINT, PLACE, TURN
from artde_gym.motion.replay import Replay
from artde_gym.report import write_report

pytestmark = pytest.mark.browser

PUSH = {"body": "chest", "magnitude": 20.0, "direction": [1.0, 0.0, 0.0], "start": 0.3, "duration": 0.1}
WALK = {
    "disturbances": {"payload": {"mass": 1.3, "detach_time": 0.6}, "push": [PUSH]},
    "actuator_inertia": "lumped",
    "control_period": 0.004,
    "duration": 1.2,
}
FLIGHT = {"disturbances": {"payload": {"mass": 0.35, "detach_time": 0.6}}, "duration": 1.2}
CASES: dict[str, tuple[str, dict[str, Any]]] = {
    "walk": ("BipedWalk-Payload-v0", WALK),
    "push": ("BipedPush-v0", {**WALK, "arms": "revolute"}),
    "flight": ("QuadInfinity-Payload-v0", FLIGHT),
}
SHOWN = "document.querySelector('.replay')"
REPLAY = f"{SHOWN}.replay"
READY = "[...document.querySelectorAll('.replay')].every((one) => one.dataset.ready || one.dataset.failed)"
LOOK = """
(() => {
  const replay = document.querySelector(".replay").replay, [run] = replay.runs;
  replay.seek(%d * run.motion.period);
  const places = %s.map((site) => run.robot.point(replay.data.scene.sites[site]).toArray());
  return [places, run.robot.ball.visible ? run.robot.ball.position.toArray() : null];
})()"""
COLORS = """
(() => {
  const { canvas } = document.querySelector(".replay").replay, seen = new Set();
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  for (let i = 0; i < data.length; i += 4) seen.add((data[i] << 16) | (data[i + 1] << 8) | data[i + 2]);
  return [seen.size, data[0]];
})()"""
CLICK = """
(() => {
  const chart = document.querySelector(".replay .plot canvas"), box = chart.getBoundingClientRect();
  chart.setPointerCapture = () => {};
  chart.dispatchEvent(new PointerEvent("pointerdown", { clientX: box.left + 40 + (box.width - 48) / 2 }));
})()"""
BESIDE = """
(() => {
  const { runs: [run], canvas } = document.querySelector(".replay").replay, { x, y, w, h, camera } = run.seen;
  const [tail, tip] = run.arrow.ends.map((place) => {
    const p = place.clone().project(camera);
    return [x + ((p.x + 1) / 2) * w, y + ((1 - p.y) / 2) * h];
  });
  const note = run.note.getBoundingClientRect(), box = canvas.getBoundingClientRect();
  return [[(note.left + note.right) / 2 - box.left, (note.top + note.bottom) / 2 - box.top], tip, tail];
})()"""
LEVER = 1.0  # m, that a turn moves a site by


def shown(browser, page, width: int = 1280, height: int = 900, *, dark: bool = False) -> None:
    """Open a page and wait for its replays."""
    browser.errors.clear()
    browser.open(page, width, height, dark=dark)
    end = time.monotonic() + 60
    while not browser.run(READY):
        assert time.monotonic() < end, "no replay after a minute"
        time.sleep(0.05)
    assert browser.run(f"{SHOWN}.dataset.failed ?? ''") == ""
    assert browser.errors == []


def _parted(kwargs: dict[str, Any]) -> tuple[dict[str, Any], Any]:
    """Arguments of an environment, and its disturbances."""
    return {name: value for name, value in kwargs.items() if name != "disturbances"}, kwargs.get("disturbances")


def made(env_id: str, kwargs: dict[str, Any], names=("tde", "artde")) -> Replay:
    own, disturbances = _parted(kwargs)
    return artde_gym.replay(list(names), env_id, disturbances=disturbances, env_kwargs=own)


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    return made(*CASES["walk"]).save(tmp_path_factory.mktemp("walk") / "walk.html")


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    """A report of two scenarios; motion is stored of one of them."""
    folder = tmp_path_factory.mktemp("report") / "run"
    kwargs = {"duration": 1.2, "control_period": 0.03}
    evaluate(["tde", "pid"], scenario=["Q1", "Q1-calm"], episodes=3, out=folder, env_kwargs=kwargs)
    for file in (folder / "traces/Q1-calm").iterdir():
        file.unlink()
    return write_report(folder)


@pytest.mark.parametrize("case", CASES)
def test_poses_in_the_page_are_the_simulations(solid_browser, tmp_path, engine_name, case):
    env_id, kwargs = CASES[case]
    kwargs = {**kwargs, "engine": engine_name}
    shown(solid_browser, made(env_id, kwargs, ["tde"]).save(tmp_path / "x.html"))
    (cell,) = cells_of(env_id, None, *_parted(kwargs))
    env, options = single_of(cell)
    plant: Any = env.unwrapped
    policy = controllers.make("tde", plant)
    sites = [name for name, _, _ in plant.nominal_robot.sites]
    period = solid_browser.run(f"{REPLAY}.runs[0].motion.period")
    stride = 12 * round(period / plant.control_period)
    observation, _ = plant.reset(seed=episode_seed(0, 0), options=options)
    state, over, step, looks = None, False, 0, 0
    while not over:
        if step % stride == 0:
            found = solid_browser.run(LOOK % (12 * (step // stride), json.dumps(sites)))
            truth = [plant.engine.site(name) for name in sites]
            np.testing.assert_allclose(found[0], truth, rtol=0, atol=PLACE + LEVER * (TURN + 6 * JOINT) / 2)
            payload = plant.engine.payload_position()
            assert (found[1] is None) == (payload is None or payload[2] < DEEPEST)
            if found[1] is not None and payload is not None:
                np.testing.assert_allclose(found[1], payload, rtol=0, atol=0.51 * PLACE)
            looks += 1
        action, state = policy.predict(observation, state)
        observation, _, terminated, truncated, _ = plant.step(action)
        over, step = terminated or truncated, step + 1
    assert looks > 5


@pytest.mark.parametrize(("width", "dark"), [(375, False), (800, True), (1280, False)])
def test_it_fits_and_is_drawn(solid_browser, walk, width, dark):
    shown(solid_browser, walk, width, dark=dark)
    assert solid_browser.run("document.documentElement.scrollWidth") <= width
    solid_browser.run(f"{REPLAY}.paint()")
    colors = solid_browser.run(COLORS)
    assert colors[0] > 200
    assert colors[1] < 60 if dark else colors[1] > 200  # the sky is the page's paper


def test_buttons_keys_charts_and_events_move_it(solid_browser, walk):
    shown(solid_browser, walk)
    run = solid_browser.run
    at = f"{REPLAY}.time"
    period = run(f"{REPLAY}.runs[0].motion.period")
    run(f"[...{SHOWN}.querySelectorAll('.move button')].at(-1).click()")
    assert run(at) == pytest.approx(period)
    for key, expected in (
        ("ArrowRight", 2 * period),
        ("ArrowLeft", period),
        ("Home", 0.0),
        ("End", run(f"{REPLAY}.length")),
    ):
        run(f"{REPLAY}.canvas.dispatchEvent(new KeyboardEvent('keydown', {{key: '{key}', bubbles: true}}))")
        assert run(at) == pytest.approx(expected)
    run(f"{SHOWN}.querySelector('.events .push').click()")
    assert run(at) == pytest.approx(0.3)
    assert run(f"{REPLAY}.runs.map((one) => one.arrow.shown)") == [True, True]
    run(CLICK)
    assert run(at) == pytest.approx(run(f"{REPLAY}.length") / 2, rel=0.02)
    run(f"(() => {{ const s = {SHOWN}.querySelector('input'); s.value = 0.9; s.oninput(); }})()")
    assert run(at) == pytest.approx(0.9)
    assert run(f"{SHOWN}.querySelector('input').getAttribute('aria-valuetext')") == "0.90 seconds of 1.2"


def test_it_plays_to_the_end_and_stops(solid_browser, walk):
    shown(solid_browser, walk)
    run = solid_browser.run
    run(f"{REPLAY}.speed = 4; {REPLAY}.seek({REPLAY}.length - 0.2)")
    run(f"{SHOWN}.querySelector('.play').click()")
    assert run(f"{SHOWN}.querySelector('.play').getAttribute('aria-label')") == "pause"
    end = time.monotonic() + 60
    while run(f"{REPLAY}.playing"):
        assert time.monotonic() < end
        time.sleep(0.05)
    assert run(f"{REPLAY}.time === {REPLAY}.length")
    assert run(f"{SHOWN}.querySelector('.play').getAttribute('aria-label')") == "play"


def test_a_drag_turns_the_view_and_reset_brings_it_back(solid_browser, walk):
    shown(solid_browser, walk)
    eye = f"{REPLAY}.world.camera.position.toArray()"
    before = solid_browser.run(eye)
    for kind, x in (("mousePressed", 300), ("mouseMoved", 400), ("mouseReleased", 400)):
        solid_browser.call("Input.dispatchMouseEvent", type=kind, x=x, y=300, button="left", buttons=1, clickCount=1)
    assert np.abs(np.subtract(solid_browser.run(eye), before)).max() > 0.1
    solid_browser.run(
        f"[...{SHOWN}.querySelectorAll('button')].find((one) => one.textContent === 'reset view').click()"
    )
    np.testing.assert_allclose(solid_browser.run(eye), before, atol=1e-9)


@pytest.mark.parametrize("width", [375, 1280])
def test_a_whole_flight_is_in_sight(solid_browser, tmp_path, width):
    page = artde_gym.replay(
        ["tde", "artde"], "QuadInfinity-Payload-v0", env_kwargs={"duration": 15.0, "engine": "mujoco"}, disturbances={}
    )
    shown(solid_browser, page.save(tmp_path / "x.html"), width)
    for share in (0.0, 0.3, 0.6, 1.0):
        solid_browser.run(f"{REPLAY}.seek({share} * {REPLAY}.length)")
        solid_browser.run(f"{REPLAY}.paint()")
        place = solid_browser.run(f"{REPLAY}.runs[0].center.clone().project({REPLAY}.runs[0].seen.camera).toArray()")
        assert np.abs(place[:2]).max() < 0.9


def test_the_size_of_a_push_stands_beside_its_arrow(solid_browser, walk):
    shown(solid_browser, walk)
    solid_browser.run(f"{REPLAY}.seek(0.35); {REPLAY}.paint()")
    note, tip, tail = solid_browser.run(BESIDE)
    assert np.dot(np.subtract(note, tail), np.subtract(tip, tail)) < 0  # beyond the end that does not touch the robot


def test_a_fall_is_frozen_and_gray(solid_browser, tmp_path):
    class Rest:
        def predict(self, observation, state=None, episode_start=None, deterministic=True):
            return np.zeros(4), None

    page = artde_gym.replay({"tde": "tde", "rest": Rest()}, "QuadInfinity-Payload-v0", env_kwargs={"duration": 1.5})
    shown(solid_browser, page.save(tmp_path / "x.html"))
    solid_browser.run(f"{REPLAY}.seek(1.4)")
    assert solid_browser.run(f"{REPLAY}.runs.map((one) => Boolean(one.robot.grayed))") == [False, True]
    assert "fell at" in solid_browser.run(f"{REPLAY}.runs[1].tag.textContent")
    still = f"{REPLAY}.runs[1].robot.bodies[0].position.toArray()"
    before = solid_browser.run(still)
    solid_browser.run(f"{REPLAY}.seek(1.5)")
    assert solid_browser.run(still) == before
    solid_browser.run(f"{REPLAY}.seek(0)")
    assert solid_browser.run(f"{REPLAY}.runs.map((one) => Boolean(one.robot.grayed))") == [False, False]


def test_a_report_shows_the_worst_the_median_and_the_best(solid_browser, report):
    shown(solid_browser, report)
    choice = f"{SHOWN}.querySelector('select[aria-label=episode]')"
    labels = solid_browser.run(f"[...{choice}.options].map((one) => one.textContent)")
    assert [label.split(", ")[1] for label in labels] == ["worst", "median", "best"]
    before = solid_browser.run(f"{REPLAY}.runs[0].motion.data")
    solid_browser.run(f"{REPLAY}.show(2)")
    assert solid_browser.run(f"{REPLAY}.runs[0].motion.data") != before
    assert solid_browser.run(f"{SHOWN}.querySelectorAll('.tag').length") == 2
    text = report.read_text()
    assert text.count('<div class="replay"') == 1
    assert "runs an episode again from its seed" in text


def test_it_lives_in_a_frame_without_an_origin(solid_browser, walk, tmp_path):
    page = tmp_path / "notebook.html"
    frame = Replay(tuple(made(*CASES["flight"]).figures))._repr_html_()
    page.write_text(f"<!doctype html><title>x</title><link rel=icon href=data:,>{frame}", encoding="utf-8")
    solid_browser.errors.clear()
    solid_browser.open(page)
    time.sleep(0.5)
    end = time.monotonic() + 60
    while True:
        solid_browser.picture(tmp_path / "x.png")
        if len(set(Image.open(tmp_path / "x.png").convert("RGB").crop((0, 100, 1200, 500)).getdata())) > 200:
            break
        assert time.monotonic() < end
    assert solid_browser.errors == []


def test_a_hostile_name_is_text(solid_browser, tmp_path):
    name = '</script><img src=x onerror="document.title=1"><b>x'
    page = artde_gym.replay({name: "tde"}, "QuadInfinity-Payload-v0", env_kwargs={"duration": 0.1}, disturbances={})
    shown(solid_browser, page.save(tmp_path / "x.html"))
    assert solid_browser.run("document.images.length") == 0
    assert solid_browser.run(f"{REPLAY}.runs[0].tag.textContent") == name


def test_black_shows_in_the_dark(solid_browser, tmp_path):
    page = artde_gym.replay(
        {"computed-torque": "tde"}, "QuadInfinity-Payload-v0", env_kwargs={"duration": 0.1}, disturbances={}
    )
    assert page.figures[0]["episodes"][0]["runs"][0]["color"] == "#000000"
    shown(solid_browser, page.save(tmp_path / "x.html"), dark=True)
    key = f"getComputedStyle({SHOWN}.querySelector('.tag i')).backgroundColor.match(/[0-9]+/g).map(Number)"
    assert min(solid_browser.run(key)) > 100


def test_without_webgl_a_sentence_events_and_charts(browser, walk):
    shown(browser, walk)
    assert "no WebGL" in browser.run(f"{SHOWN}.querySelector('.failed').textContent")
    assert browser.run(f"{SHOWN}.querySelector('.stage')") is None
    assert browser.run(f"[...{SHOWN}.querySelectorAll('.keys .tag')].map((one) => one.textContent)") == ["tde", "artde"]
    browser.run(f"{SHOWN}.querySelector('.events .push').click()")
    assert browser.run(f"{REPLAY}.time") == pytest.approx(0.3)


def test_on_paper_there_is_a_still_and_no_buttons(solid_browser, walk):
    shown(solid_browser, walk, dark=True)
    solid_browser.call("Emulation.setEmulatedMedia", media="print")
    solid_browser.run("window.dispatchEvent(new Event('beforeprint'))")
    hidden = f"getComputedStyle({SHOWN}.querySelector('.bar')).display"
    assert solid_browser.run(hidden) == "none"
    sky = f"{REPLAY}.canvas.getContext('2d').getImageData(2, 2, 1, 1).data[0]"
    assert solid_browser.run(sky) > 200  # light, though the screen is dark
    solid_browser.call("Emulation.setEmulatedMedia", media="")


def test_everything_that_is_pressed_has_a_name(solid_browser, walk):
    shown(solid_browser, walk)
    names = (
        f"[...{SHOWN}.querySelectorAll('button, select, input, canvas')].map((one) => one.getAttribute('aria-label'))"
    )
    found = solid_browser.run(names)
    assert len(found) > 10
    assert all(found)
