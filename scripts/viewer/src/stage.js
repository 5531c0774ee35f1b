// Robots side by side, or in one world, that a person looks at from all sides; of replays and of live play.
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { lifted, make } from "./page.js";
import { Arrow, Robot } from "./robot.js";
import { Path, Vector3, World } from "./world.js";

const PUSH = "#c4163c", LOAD = "#2f80c9", FADE = 0.3;  // s, in which an arrow goes when its push is over
const NARROW = 620, METERS_PER_NEWTON = 0.012, ARROW = [0.25, 0.6], LOAD_LENGTH = 0.0035;  // pixels, m/N, m, m/N
const SHAPE = 0.78;  // height of a panel over its width, at most

export class Stage {
  /** A stage in an element of the page; `drawn` says whether this browser can draw. */
  constructor(root, scene, drawn, label) {
    Object.assign(this, { root, outlook: scene.outlook, sceneData: scene, time: 0, together: false, loads: true, tallest: 440, runs: [] });
    this.world = drawn ? new World(scene) : null;
    this.stage = make("div", { class: "stage" });
    this.canvas = make("canvas", { tabindex: "0", role: "img", "aria-label": label });
    this.stage.append(this.canvas);
    if (this.world) root.append(this.stage);
  }
  /** Add a run's robot with its arrows; `trail` is its path over the ground (flat list). */
  add(run, trail) {
    const scene = this.sceneData, tag = make("div", { class: "tag" }, make("i"), run.name, make("b")), note = make("div", { class: "note" });
    run = { ...run, tag, note, center: new Vector3(), parts: [], arrows: [] };
    if (!this.world) return run;
    run.robot = new Robot(scene, run.color, run.hook);
    run.arrow = new Arrow(PUSH);
    run.arrows = scene.contacts.map(() => new Arrow(LOAD, 0.6));
    run.parts = [run.robot, run.arrow, ...run.arrows];
    if (trail) run.parts.push((run.trail = new Path(trail, run.color)));
    this.world.scene.add(...run.parts);
    this.stage.append(tag, note);
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
    const { distance, yaw_deg: yaw, pitch_deg: pitch, height, follows } = this.outlook, y = (yaw * Math.PI) / 180, p = (pitch * Math.PI) / 180;
    const away = new Vector3(-Math.sin(y) * Math.cos(p), Math.cos(y) * Math.cos(p), -Math.sin(p)), { center } = this.runs[0];
    this.orbit.target.set(follows ? center.x : 0, follows ? center.y : 0, height);
    this.world.camera.position.copy(this.orbit.target).addScaledVector(away, -distance * (this.together ? 1.15 : 1));
    this.orbit.update();
    this.ask();
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
    const { world, runs } = this, { camera } = world, count = runs.length, width = this.root.clientWidth;
    const columns = this.together ? 1 : Math.min(count, width < NARROW || (count === 4 && width < 1000) ? 2 : count), rows = this.together ? 1 : Math.ceil(count / columns);
    const w = width / columns, h = Math.round(Math.min(this.tallest, Math.max(250, SHAPE * w)) * (rows > 1 ? 0.8 : 1)), height = rows * h;
    if (this.stage.style.height !== `${height}px`) this.stage.style.height = `${height}px`;
    world.begin(width, height);
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
    const on = run.arrow.shown && run.force > 0, p = on && run.arrow.tail.clone().project(this.world.camera);
    const inside = on && Math.abs(p.x) < 1 && Math.abs(p.y) < 1;
    run.note.style.display = inside ? "block" : "none";
    if (!inside) return;
    run.note.style.left = `${Math.min(x + w - 28, Math.max(x + 28, x + ((p.x + 1) / 2) * w))}px`;
    run.note.style.top = `${Math.max(y + 10, y - 16 + ((1 - p.y) / 2) * h)}px`;
    run.note.textContent = `${run.force.toPrecision(3)} N`;
  }
}
