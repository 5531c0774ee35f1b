// Live play: poses come over a WebSocket, what a person does goes back.
import { Hand } from "./hand.js";
import { darkness, make } from "./page.js";
import { Panel } from "./panel.js";
import { Stage } from "./stage.js";
import { SPAN, Strip } from "./strips.js";

const STIFFNESS = 5;  // 1/m, force of a pull over the robot's usual push

/** The page: it waits for its server's words, and then shows them. */
export class Live {
  constructor(root, drawn) {
    Object.assign(this, { root, drawn, frames: 0 });
    this.waiting = make("p", { class: "failed", role: "status" }, "The simulation is being prepared …");
    root.append(this.waiting);
    this.socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/socket${location.search}`);
    this.socket.binaryType = "arraybuffer";
    this.socket.onmessage = ({ data }) => (typeof data === "string" ? this.#words(JSON.parse(data)) : this.#frame(new Float32Array(data)));
    this.socket.onclose = () => {
      root.append(make("p", { class: "ended", role: "alert" }, "The connection has ended: start artde-gym play again, or reload."));
      root.dataset.ended = "1";
    };
  }
  say(order) { if (this.socket.readyState === 1) this.socket.send(JSON.stringify(order)); }
  #words({ start, told }) {
    if (start) this.#begin(start);
    if (!told) return;
    this.told = told;
    this.scene.told(told);
    this.panel.told(told);
  }
  #begin(start) {
    this.start = start;
    document.title = `${start.title} · artde-gym play`;
    const left = make("div", { class: "replay" }), right = make("aside", { "aria-label": "what can be done" });
    this.scene = new Scene(left, start, this.drawn, (site, force) => this.say({ do: "pull", site, force }));
    this.panel = new Panel(right, start, (order) => this.say(order));
    left.append(this.panel.bar, this.panel.help, this.panel.refused);
    this.waiting.remove();
    this.root.append(left, this.scene.charts(), right);
  }
  #frame(data) {
    if (!this.told) return;
    this.frames++;
    this.scene.frame(data);
    this.panel.time(data[0]);
    this.root.dataset.ready = "1";
  }
}

/** Robots and charts. */
class Scene extends Stage {
  constructor(root, start, drawn, pull) {
    super(root, start.scene, drawn, `${start.title}. Drag the robot to pull it, drag beside it to turn the view; arrow keys push, space pauses`);
    this.start = start;
    this.strips = start.signals.map((label) => new Strip(label));
    if (!this.world) return;
    this.controls();
    const { force, most } = start.push;
    if (start.able.push) this.hand = new Hand(this, start.sites, { stiffness: STIFFNESS * force, most, say: pull });
  }
  /** Make the charts, which stand beside or below the robots. */
  charts() {
    const charts = make("div", { class: "replay charts" }, make("div", { class: "plots" }, ...this.strips.map((strip) => strip.element))), seen = new ResizeObserver(() => this.ask());
    for (const root of [this.root, charts]) seen.observe(root);
    darkness.addEventListener("change", () => this.ask());
    return charts;
  }
  told(told) {
    const look = JSON.stringify([told.players.map(({ name, color }) => [name, color]), told.hook]);
    if (look !== this.look) {
      this.hand?.release();
      for (const run of this.runs) this.remove(run);
      const first = !this.runs.length, center = this.runs[0]?.center;
      this.runs = told.players.map((player) => this.add({ name: player.name, color: player.color, hook: told.hook }));
      if (center) this.runs[0].center.copy(center);
      this.look = look;
      this.first = first;
    }
    this.runs.forEach((run, i) => {
      const player = told.players[i], [fell] = [player.fault || (player.fall && `fell at ${player.end.toFixed(2)}\u00a0s (${player.fall})`)];
      Object.assign(run, { pushes: told.pushes, end: player.over ? player.end : Infinity });
      run.tag.lastChild.textContent = fell || (player.over ? "the end" : "");
      run.robot?.gray(Boolean(fell));
    });
    this.ask();
  }
  frame(data) {
    const { joints, loads, signals } = this.start, size = 10 + joints + loads + signals.length, before = this.runs[0].center.clone();
    if (data[0] < this.time) for (const strip of this.strips) strip.clear();
    this.time = data[0];
    this.runs.forEach((run, i) => {
      const part = data.subarray(1 + i * size, 1 + (i + 1) * size), over = this.time > run.end - 1e-4;
      if (part.length < size) return;  // of a moment before
      run.center.set(part[0], part[1], part[2]);
      signals.forEach((_, k) => { if (!over) this.strips[k].add(i, this.time, part[10 + joints + loads + k]); });
      if (!run.robot) return;
      run.robot.pose(part.subarray(0, 7), part.subarray(10, 10 + joints), part[9] > -0.3 ? part.subarray(7, 10) : null);
      this.pressed(run, over ? this.sceneData.contacts.map(() => 0) : part.subarray(10 + joints, 10 + joints + loads));
      this.pushed(run);
    });
    this.hand?.show();
    this.hand?.pull();
    if (this.first) { this.first = false; this.home(); } else this.follow(before);
    this.ask();
  }
  turn() {
    const style = getComputedStyle(this.root), ink = (name) => style.getPropertyValue(name).trim();
    if (!this.runs.length) return;
    this.tallest = Math.max(300, (this.root.clientWidth + 1 < innerWidth * 0.9 ? 0.6 : 0.42) * innerHeight);  // alone in its row, it stays in sight
    if (this.world && this.root.clientWidth) this.paintWorld();
    const spans = this.runs[0].pushes.filter((push) => push.end > this.time - SPAN && push.start <= this.time).map((push) => [push.start, push.end]);
    for (const strip of this.strips) strip.draw(this.time, this.runs, spans, ink);
  }
}
