// One figure: several controllers on the same seed, side by side or in one world, in step with their charts.
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { Bar } from "./bar.js";
import { darkness, lifted, make, paper } from "./page.js";
import { plotsOf } from "./plots.js";
import { Arrow, Robot } from "./robot.js";
import { unpack } from "./unpack.js";
import { Path, Vector3, World } from "./world.js";

const PUSH = "#c4163c", LOAD = "#2f80c9", FADE = 0.3;  // s, in which an arrow goes when its push is over
const NARROW = 620, METERS_PER_NEWTON = 0.012, ARROW = [0.25, 0.6], LOAD_LENGTH = 0.0035;  // pixels, m/N, m, m/N
const SHAPE = 0.78;  // height of a panel over its width, at most

export class Replay {
  constructor(root, data, drawn) {
    Object.assign(this, { root, data, time: 0, speed: 1, playing: false, together: false, loads: true, runs: [], plots: [] });
    this.world = drawn ? new World(data.scene) : null;
    this.stage = make("div", { class: "stage" });
    this.canvas = make("canvas", { tabindex: "0", role: "img", "aria-label": `${data.title}. Drag to turn; click, then wheel to come closer; space plays, arrow keys step` });
    this.stage.append(this.canvas);
    this.bar = new Bar(this);
    this.notes = make("p", { class: "said" });
    this.charts = make("div", { class: "plots" });
    if (this.world) root.append(this.stage);
    root.append(this.bar.element, this.bar.events, this.notes, this.charts);
  }
  async start() {
    await this.show(0);
    if (this.world) this.#controls();
    this.root.addEventListener("keydown", (event) => this.#key(event));
    new ResizeObserver(() => this.ask()).observe(this.root);
    for (const media of [darkness, paper]) media.addEventListener("change", () => this.ask());
    this.home();
    this.paint();
  }
  /** Show another episode. */
  async show(number) {
    const { scene } = this.data, episode = this.data.episodes[number];
    const runs = await Promise.all(episode.runs.map(async (run) => ({ ...run, columns: await unpack(run.motion) })));
    for (const run of this.runs) this.#remove(run);
    this.runs = runs.map((run) => this.#add(run, scene));
    this.length = Math.max(...runs.map((run) => run.end), 1e-3);
    this.plots = await plotsOf(this.runs, (time) => { this.play(false); this.seek(time); });
    this.charts.replaceChildren(...this.plots.map((plot) => plot.element));
    this.notes.textContent = runs.map((run) => run.note).filter(Boolean).join(". ");
    this.notes.hidden = !this.notes.textContent;
    this.bar.show(this.runs, this.length);
    this.arrange(this.together);
    this.play(false);
    this.seek(0);
    this.home();
  }
  #add(run, scene) {
    const size = run.motion.units.length, tag = make("div", { class: "tag" }, make("i"), run.name, make("b")), note = make("div", { class: "note" });
    run = { ...run, size, tag, note, center: new Vector3(), tip: new Vector3(), parts: [], arrows: [] };
    if (!this.world) return run;
    const trail = [];
    for (let i = 0; i < run.motion.samples; i += 2) trail.push(run.columns[i * size], run.columns[i * size + 1], scene.outlook.follows ? 0.006 : run.columns[i * size + 2]);
    run.robot = new Robot(scene, run.color, run.hook);
    run.trail = new Path(trail, run.color);
    run.arrow = new Arrow(PUSH);
    run.arrows = scene.contacts.map(() => new Arrow(LOAD, 0.6));
    run.parts = [run.robot, run.trail, run.arrow, ...run.arrows];
    this.world.scene.add(...run.parts);
    this.stage.append(tag, note);
    return run;
  }
  #remove(run) {
    this.world?.scene.remove(...run.parts);
    for (const part of run.parts) part.dispose();
    run.tag.remove();
    run.note.remove();
  }
  #controls() {
    const orbit = (this.orbit = new OrbitControls(this.world.camera, this.canvas));
    Object.assign(orbit, { enableDamping: false, enableZoom: false, maxPolarAngle: 0.52 * Math.PI, minDistance: 0.4, maxDistance: 25 });
    orbit.addEventListener("change", () => this.ask());
    // the wheel scrolls the page until the stage has been pressed
    this.canvas.addEventListener("pointerdown", () => { orbit.enableZoom = true; this.canvas.focus({ preventScroll: true }); }, true);
    this.canvas.addEventListener("pointerleave", (event) => { if (event.pointerType === "mouse") orbit.enableZoom = false; });
    this.canvas.addEventListener("dblclick", () => this.home());
  }
  #key(event) {
    if (["INPUT", "SELECT"].includes(event.target.tagName) || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === " " && event.target.tagName === "BUTTON") return;
    const far = event.shiftKey ? 1 / this.runs[0].motion.period : 1;
    const act = {
      " ": () => this.play(!this.playing), ArrowLeft: () => this.step(-far), ArrowRight: () => this.step(far), Home: () => this.seek(0), End: () => this.seek(this.length),
      "+": () => this.bar.faster(1), "=": () => this.bar.faster(1), "-": () => this.bar.faster(-1),
    }[event.key];
    if (act) { act(); event.preventDefault(); }
  }
  /** The camera of `Outlook`. */
  home() {
    if (!this.orbit) return;
    const { distance, yaw_deg: yaw, pitch_deg: pitch, height, follows } = this.data.scene.outlook, y = (yaw * Math.PI) / 180, p = (pitch * Math.PI) / 180;
    const away = new Vector3(-Math.sin(y) * Math.cos(p), Math.cos(y) * Math.cos(p), -Math.sin(p)), { center } = this.runs[0];
    this.orbit.target.set(follows ? center.x : 0, follows ? center.y : 0, height);
    this.world.camera.position.copy(this.orbit.target).addScaledVector(away, -distance * (this.together ? 1.15 : 1));
    this.orbit.update();
    this.ask();
  }
  arrange(together) {
    this.together = together && this.runs.length > 1;
    this.runs.forEach((run, i) => run.robot?.ghost(this.together && i > 0));
    this.ask();
  }
  forces(on) { this.loads = on; this.seek(this.time); }
  play(on) {
    if (on && this.time >= this.length - 1e-6) this.seek(0);
    this.playing = on; this.last = null;
    this.bar.playing(on);
    if (on) this.ask();
  }
  step(count) { this.play(false); this.seek(this.time + count * this.runs[0].motion.period); }
  seek(time) {
    this.time = Math.min(this.length, Math.max(0, time));
    const before = this.runs[0].center.clone();
    for (const run of this.runs) this.#pose(run);
    this.bar.told(this.time, this.length);
    if (this.orbit && this.data.scene.outlook.follows) {  // the eye goes along, as a person has turned it
      const move = this.runs[0].center.clone().sub(before).setZ(0);
      this.orbit.target.add(move);
      this.world.camera.position.add(move);
    }
    this.ask();
  }
  #pose(run) {
    const { size, columns, motion, robot } = run, at = Math.min(motion.samples - 1, this.time / motion.period);
    const i = Math.max(0, Math.min(motion.samples - 2, Math.floor(at))), f = motion.samples > 1 ? at - i : 0, j = Math.min(motion.samples - 1, i + 1);
    const value = (c) => (f ? columns[i * size + c] * (1 - f) + columns[j * size + c] * f : columns[i * size + c]);
    const q = Array.from({ length: motion.joints }, (_, c) => value(7 + c)), ball = 7 + motion.joints;
    run.over = this.time >= run.end - 1e-6;
    run.center.set(value(0), value(1), value(2));
    if (!robot) return;
    robot.pose(Array.from({ length: 7 }, (_, c) => value(c)), q, columns[Math.round(at) * size + ball + 3] > 0.5 ? [value(ball), value(ball + 1), value(ball + 2)] : null);
    robot.gray(run.over && Boolean(run.fall));
    run.trail.show(Math.floor(at / 2) + 1);
    run.tag.lastChild.textContent = run.over && run.fall ? `fell at ${run.end.toFixed(2)} s` : "";
    this.#pushed(run);
    this.data.scene.contacts.forEach((contact, c) => {
      const load = this.loads && !run.over ? value(ball + 4 + c) : 0, foot = robot.point(contact);
      if (!(load > 1)) return run.arrows[c].hide();
      const length = 0.05 + LOAD_LENGTH * load;
      run.arrows[c].show(foot.setZ(foot.z + length), new Vector3(0, 0, 1), length, 0.85);
    });
  }
  #pushed(run) {
    const push = run.pushes.find((one) => one.start <= this.time && this.time < one.end + FADE && one.start < run.end), site = push && this.data.scene.sites[push.site];
    run.force = 0;
    if (!site) return run.arrow.hide();
    const force = new Vector3(...push.force);
    run.force = force.length();
    run.arrow.show(run.robot.point(site), force, Math.min(ARROW[1], Math.max(ARROW[0], METERS_PER_NEWTON * run.force)), this.time < push.end ? 1 : 1 - (this.time - push.end) / FADE);
  }
  /** Ask for a new picture. */
  ask() {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame((now) => { this.asked = false; this.#turn(now); });
  }
  #turn(now) {
    if (this.playing) {
      if (this.last !== null) this.seek(this.time + Math.min(0.1, (now - this.last) / 1000) * this.speed);
      this.last = now;
      if (this.time >= this.length) this.play(false);
      else this.ask();
    }
    this.paint();
  }
  /** Draw all of it now. */
  paint() {
    const style = getComputedStyle(this.root), ink = (name) => style.getPropertyValue(name).trim();
    if (this.world && this.orbit && this.root.clientWidth) this.#paintWorld();
    const spans = this.runs[0].pushes.map((push) => [push.start, push.end]);
    for (const plot of this.plots) plot.draw(this.time, this.length, spans, ink);
  }
  #paintWorld() {
    const { world, runs } = this, { camera } = world, count = runs.length, width = this.root.clientWidth;
    const columns = this.together ? 1 : Math.min(count, width < NARROW || (count === 4 && width < 1000) ? 2 : count), rows = this.together ? 1 : Math.ceil(count / columns);
    const w = width / columns, h = Math.round(Math.min(440, Math.max(250, SHAPE * w)) * (rows > 1 ? 0.8 : 1)), height = rows * h;
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
        if (this.data.scene.outlook.follows && !this.together) { target.add(shift); camera.position.copy(place).add(shift); }
        camera.lookAt(target);
        world.draw(x, y, w, h, this.together ? first.clone() : target, this.together ? 1.3 : 1);
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
