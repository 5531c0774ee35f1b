// One figure: several controllers on the same seed, side by side or in one world, in step with their charts.
import { Bar } from "./bar.js";
import { darkness, make, paper } from "./page.js";
import { plotsOf } from "./plots.js";
import { Stage } from "./stage.js";
import { unpack } from "./unpack.js";

export class Replay extends Stage {
  constructor(root, data, drawn) {
    super(root, data.scene, drawn, `${data.title}. Drag to turn; click, then wheel to come closer; space plays, arrow keys step`);
    Object.assign(this, { data, speed: 1, playing: false, plots: [] });
    this.bar = new Bar(this);
    this.notes = make("p", { class: "said" });
    this.charts = make("div", { class: "plots" });
    root.append(this.bar.element, this.bar.events, this.notes, this.charts);
  }
  async start() {
    await this.show(0);
    if (this.world) this.controls();
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
    for (const run of this.runs) this.remove(run);
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
    const size = run.motion.units.length, trail = [];
    for (let i = 0; i < run.motion.samples; i += 2) trail.push(run.columns[i * size], run.columns[i * size + 1], scene.outlook.follows ? 0.006 : run.columns[i * size + 2]);
    return this.add({ ...run, size }, trail);
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
    this.follow(before);
    this.ask();
  }
  #pose(run) {
    const { size, columns, motion, robot } = run, at = Math.min(motion.samples - 1, this.time / motion.period);
    const i = Math.max(0, Math.min(motion.samples - 2, Math.floor(at))), f = motion.samples > 1 ? at - i : 0, j = Math.min(motion.samples - 1, i + 1);
    const value = (c) => (f ? columns[i * size + c] * (1 - f) + columns[j * size + c] * f : columns[i * size + c]);
    const q = Array.from({ length: motion.joints }, (_, c) => value(7 + c)), ball = 7 + motion.joints;
    run.over = this.time >= run.end - 1e-6;
    run.center.set(value(0), value(1), value(2));
    run.tag.lastChild.textContent = run.over && run.fall ? `fell at ${run.end.toFixed(2)}\u00a0s` : "";
    if (!robot) return;
    robot.pose(Array.from({ length: 7 }, (_, c) => value(c)), q, columns[Math.round(at) * size + ball + 3] > 0.5 ? [value(ball), value(ball + 1), value(ball + 2)] : null);
    robot.gray(run.over && Boolean(run.fall));
    run.trail.show(Math.floor(at / 2) + 1);
    this.pushed(run);
    this.pressed(run, this.data.scene.contacts.map((_, c) => (run.over ? 0 : value(ball + 4 + c))));
  }
  turn(now) {
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
    if (this.world && this.orbit && this.root.clientWidth) this.paintWorld();
    const spans = this.runs[0].pushes.map((push) => [push.start, push.end]);
    for (const plot of this.plots) plot.draw(this.time, this.length, spans, ink);
  }
}
