// Robots side by side, or in one world, that a person looks at from all sides; of replays and of live play.
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { lifted, make } from "./page.js";
import { Arrow, Robot } from "./robot.js";
import { Path, Vector3, World } from "./world.js";

const PUSH = "#c4163c", LOAD = "#2f80c9", FADE = 0.3;  // s, in which an arrow goes when its push is over
const NARROW = 620, METERS_PER_NEWTON = 0.012, ARROW = [0.25, 0.6], LOAD_LENGTH = 0.0035;  // pixels, m/N, m, m/N
const SHAPE = 0.78;  // height of a panel over its width, at most
const ROOM = 0.4;  // m, around a path that is seen as a whole
const LABEL = [32, 16];  // pixels, from the middle of a note to its arrow, across and up

export class Stage {
  /** A stage in an element of the page; `drawn` says whether this browser can draw. */
  constructor(root, scene, drawn, label) {
    Object.assign(this, { root, outlook: scene.outlook, sceneData: scene, time: 0, together: false, loads: true, tallest: 440, runs: [] });
    this.world = drawn ? new World(scene) : null;
    this.stage = make("div", { class: "stage" });
    this.canvas = make("canvas", { tabindex: "0", role: "img", "aria-label": label });
    this.stage.append(this.canvas);
    if (!this.world) { this.stage.className = "keys"; this.canvas.remove(); }  // the colors of the charts
    root.append(this.stage);
  }
  /** Add a run's robot with its arrows; `trail` is its path over the ground (flat list). */
  add(run, trail) {
    const scene = this.sceneData, tag = make("div", { class: "tag" }, make("i"), run.name, make("b")), note = make("div", { class: "note" });
    run = { ...run, tag, note, center: new Vector3(), parts: [], arrows: [] };
    this.stage.append(tag);
    if (!this.world) { tag.style.cssText = `--c:${lifted(run.color)}`; return run; }
    run.robot = new Robot(scene, run.color, run.hook);
    run.arrow = new Arrow(PUSH);
    run.arrows = scene.contacts.map(() => new Arrow(LOAD, 0.6));
    run.parts = [run.robot, run.arrow, ...run.arrows];
    if (trail) run.parts.push((run.trail = new Path(trail, run.color)));
    this.world.scene.add(...run.parts);
    this.stage.append(note);
    return run;
  }
  remove(run) {
    this.world?.scene.remove(...run.parts);
    for (const part of run.parts) part.dispose();
    run.tag.remove();
    run.note.remove();
  }
  /** Let the eye go along with the first robot, as a person has turned it. */
  follow(before) {
    if (!this.orbit || !this.outlook.follows) return;
    const move = this.runs[0].center.clone().sub(before).setZ(0);
    this.orbit.target.add(move);
    this.world.camera.position.add(move);
  }
  /** Show the ground's forces (N) at the contacts. */
  pressed(run, loads) {
    this.sceneData.contacts.forEach((contact, c) => {
      const load = this.loads ? loads[c] : 0, foot = run.robot.point(contact);
      if (!(load > 1)) return run.arrows[c].hide();
      const length = 0.05 + LOAD_LENGTH * load;
      run.arrows[c].show(foot.setZ(foot.z + length), new Vector3(0, 0, 1), length, 0.85);
    });
  }
  controls() {
    const orbit = (this.orbit = new OrbitControls(this.world.camera, this.canvas));
    Object.assign(orbit, { enableDamping: false, enableZoom: false, maxPolarAngle: 0.52 * Math.PI, minDistance: 0.4, maxDistance: 25 });
    orbit.addEventListener("change", () => this.ask());
    // the wheel scrolls the page until the stage has been pressed
    this.canvas.addEventListener("pointerdown", () => { orbit.enableZoom = true; this.canvas.focus({ preventScroll: true }); }, true);
    this.canvas.addEventListener("pointerleave", (event) => { if (event.pointerType === "mouse") orbit.enableZoom = false; });
    this.canvas.addEventListener("dblclick", () => this.home());
  }
  /** The camera of `Outlook`. */
  home() {
    if (!this.orbit) return;
    const { yaw_deg: yaw, pitch_deg: pitch, height, follows } = this.outlook, y = (yaw * Math.PI) / 180, p = (pitch * Math.PI) / 180;
    const away = new Vector3(-Math.sin(y) * Math.cos(p), Math.cos(y) * Math.cos(p), -Math.sin(p)), { center } = this.runs[0], places = follows ? [] : this.#places();
    const middle = (axis) => (Math.min(...places.map((place) => place[axis])) + Math.max(...places.map((place) => place[axis]))) / 2;
    if (places.length) this.orbit.target.set(middle("x"), middle("y"), height);
    else this.orbit.target.set(follows ? center.x : 0, follows ? center.y : 0, height);
    this.world.camera.position.copy(this.orbit.target).addScaledVector(away, -this.#distance(places, away));
    this.orbit.update();
    this.ask();
  }
  /** Where the robots are meant to be, and are; nothing without a path. */
  #places() {
    const { path } = this.sceneData;
    if (!path) return [];
    return [...Array.from({ length: path.length / 3 }, (_, i) => new Vector3(...path.slice(3 * i, 3 * i + 3))), ...this.runs.map((run) => run.center)];
  }
  /** From where, looking that way at the orbit's target, all of the places are in the panel. */
  #distance(places, away) {
    const { w, h } = this.#panels(), [across, up] = this.world.slopes(w, h), right = new Vector3().crossVectors(away, new Vector3(0, 0, 1)).normalize(), top = new Vector3().crossVectors(right, away);
    if (!places.length) return this.outlook.distance * (this.together ? 1.15 : 1);
    return Math.max(...places.map((place) => {
      const from = place.clone().sub(this.orbit.target);
      return Math.max((Math.abs(from.dot(right)) + ROOM) / across, (Math.abs(from.dot(top)) + ROOM) / up) - from.dot(away);
    }));
  }
  /** How many panels there are, and their size (pixels). */
  #panels() {
    const count = this.runs.length, width = this.root.clientWidth;
    const columns = this.together ? 1 : Math.min(count, width < NARROW || (count === 4 && width < 1000) ? 2 : count), rows = this.together ? 1 : Math.ceil(count / columns);
    const w = width / columns, h = Math.round(Math.min(this.tallest, Math.max(250, SHAPE * w)) * (rows > 1 ? 0.8 : 1));
    return { columns, rows, w, h };
  }
  /** Show the push that acts at this time, or just did. */
  pushed(run) {
    const push = run.pushes.find((one) => one.start <= this.time && this.time < one.end + FADE && one.start < run.end), tip = push && run.robot.site(push.site);
    run.force = 0;
    if (!tip) return run.arrow.hide();
    const force = new Vector3(...push.force);
    run.force = force.length();
    run.arrow.show(tip, force, Math.min(ARROW[1], Math.max(ARROW[0], METERS_PER_NEWTON * run.force)), this.time < push.end ? 1 : 1 - (this.time - push.end) / FADE);
  }
  /** Ask for a new picture. */
  ask() {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame((now) => { this.asked = false; this.turn(now); });
  }
  paintWorld() {
    const { world, runs } = this, { camera } = world, { columns, rows, w, h } = this.#panels(), height = rows * h;
    if (this.stage.style.height !== `${height}px`) this.stage.style.height = `${height}px`;
    world.begin(columns * w, height);
    const place = camera.position.clone(), first = runs[0].center;
    runs.forEach((run, i) => {
      const x = this.together ? 0 : (i % columns) * w, y = this.together ? 0 : Math.floor(i / columns) * h;
      run.tag.style.cssText = `--c:${lifted(run.color)};left:${x + 8}px;top:${y + 8 + (this.together ? 28 * i : 0)}px;max-width:${w - 16}px`;
      if (!this.together || i === 0) {
        for (const other of runs) {
          const here = this.together || other === run;
          for (const part of other.parts) part.visible = here && part.shown !== false;
        }
        const target = this.orbit.target.clone(), shift = run.center.clone().sub(first).setZ(0);
        if (this.outlook.follows && !this.together) { target.add(shift); camera.position.copy(place).add(shift); }
        camera.lookAt(target);
        world.draw(x, y, w, h, this.together ? first.clone() : target, this.together ? 1.3 : 1);
        run.seen = { x, y, w, h, camera: (run.seen?.camera ?? camera.clone()).copy(camera) };
      }
      this.#note(run, x, y, w, h);
      camera.position.copy(place);
    });
    camera.lookAt(this.orbit.target);
    world.copy(this.canvas);
    this.#edges(columns, rows, w, h);
  }
  #edges(columns, rows, w, h) {
    const g = this.canvas.getContext("2d"), scale = this.canvas.width / (columns * w);
    g.fillStyle = getComputedStyle(this.root).getPropertyValue("--line");
    for (let i = 1; i < columns; i++) g.fillRect(Math.round(i * w * scale), 0, 1, this.canvas.height);
    for (let i = 1; i < rows; i++) g.fillRect(0, Math.round(i * h * scale), this.canvas.width, 1);
  }
  #note(run, x, y, w, h) {
    const on = run.arrow.shown && run.force > 0, [end, other] = on ? run.arrow.ends.map((place) => place.clone().project(this.world.camera)) : [];
    const inside = on && Math.abs(end.x) < 1 && Math.abs(end.y) < 1;
    run.note.style.display = inside ? "block" : "none";
    if (!inside) return;
    const dx = ((end.x - other.x) * w) / 2, dy = ((other.y - end.y) * h) / 2, far = Math.min(LABEL[0] / Math.abs(dx), LABEL[1] / Math.abs(dy));
    const at = (middle, low, high) => Math.min(high, Math.max(low, middle)), [left, top] = Number.isFinite(far) ? [far * dx, far * dy] : [0, -LABEL[1]];
    run.note.style.left = `${x + at(((end.x + 1) / 2) * w + left, 28, w - 28)}px`;
    run.note.style.top = `${y + at(((1 - end.y) / 2) * h + top, 10, h - 10)}px`;
    run.note.textContent = `${run.force.toPrecision(3)} N`;
  }
}
