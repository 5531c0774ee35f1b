// What is pressed: play, steps, the time line with its events, speed, episode and views.
import { button, draw, lifted, make } from "./page.js";

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4];

export class Bar {
  constructor(replay) {
    this.replay = replay;
    this.play = button("play", { icon: "play", class: "play" });
    this.play.onclick = () => replay.play(!replay.playing);
    const back = button("one step back", { icon: "back" }), ahead = button("one step ahead", { icon: "ahead" });
    back.onclick = () => replay.step(-1);
    ahead.onclick = () => replay.step(1);
    this.slider = make("input", { type: "range", min: 0, max: 1, step: "any", value: 0, "aria-label": "time" });
    this.slider.oninput = () => replay.seek(Number(this.slider.value));
    this.marks = draw("svg", { "aria-hidden": "true" });
    this.clock = make("span", { class: "clock" });
    this.speed = make("select", { "aria-label": "speed" }, ...SPEEDS.map((speed) => make("option", { value: speed, ...(speed === 1 && { selected: "" }) }, `${speed}×`)));
    this.speed.onchange = () => { replay.speed = Number(this.speed.value); };
    const choice = make("div", { class: "choice" });
    if (replay.data.episodes.length > 1) {
      const episodes = make("select", { "aria-label": "episode" }, ...replay.data.episodes.map((one, i) => make("option", { value: i }, `episode ${one.number}${one.rank && `, ${one.rank}`}`)));
      episodes.onchange = () => replay.show(Number(episodes.value));
      choice.append(episodes);
    }
    if (replay.world) choice.append(...this.#views());
    const move = make("div", { class: "move" }, back, this.play, ahead);
    this.element = make("div", { class: "bar" }, move, make("div", { class: "track" }, this.slider, this.marks), this.clock, this.speed, choice);
    this.events = make("ol", { class: "events", "aria-label": "events" });
  }
  #views() {
    const { replay } = this, parts = [], toggle = (name, text, on, act) => {
      const node = button(name, { text, "aria-pressed": String(on) });
      node.onclick = () => { const now = node.getAttribute("aria-pressed") !== "true"; node.setAttribute("aria-pressed", String(now)); act(now); };
      parts.push(node);
    };
    if (replay.data.episodes.some((one) => one.runs.length > 1)) toggle("all robots in one world", "one world", false, (on) => replay.arrange(on));
    if (replay.data.scene.contacts.length) toggle("forces of the ground", "forces", true, (on) => replay.forces(on));
    const home = button("look from where it began", { text: "reset view" });
    home.onclick = () => replay.home();
    return [...parts, home];
  }
  faster(by) {
    const at = SPEEDS.indexOf(this.replay.speed) + by;
    if (!(at in SPEEDS)) return;
    this.speed.value = String(this.replay.speed = SPEEDS[at]);
  }
  playing(on) { this.play.icon(on ? "pause" : "play"); this.play.say(on ? "pause" : "play"); }
  told(time, length) {
    this.slider.value = time;
    this.slider.setAttribute("aria-valuetext", `${time.toFixed(2)} seconds of ${length.toFixed(1)}`);
    this.clock.textContent = `${time.toFixed(2)} / ${length.toFixed(2)} s`;
  }
  /** Marks on the time line, and the same as a list of buttons. */
  show(runs, length) {
    this.slider.max = length;
    const x = (t) => `${((100 * t) / length).toFixed(2)}%`, events = eventsOf(runs);
    this.marks.replaceChildren(...events.map(({ time, end, kind, color }) => {
      if (kind === "push") return draw("rect", { x: x(time), y: 0, height: 7, class: "push", style: `width:max(3px,${x(end - time)})` });
      if (kind === "fall") return draw("svg", { x: x(time), y: 27, overflow: "visible" }, draw("path", { d: "M-4-4L4 4M-4 4L4-4", class: "fall", style: `--c:${lifted(color)}` }));
      return draw("circle", { cx: x(time), cy: 4, r: 3.5, class: "payload" });
    }));
    this.events.replaceChildren(...events.map(({ time, text, kind }) => {
      const node = button(`go to ${text} at ${time.toFixed(2)} s`, { text: `${time.toFixed(2)} s  ${text}`, class: kind });
      node.onclick = () => { this.replay.play(false); this.replay.seek(time); };
      return make("li", {}, node);
    }));
    this.events.hidden = !events.length;
  }
}

/** What happens to any of the runs, each thing once, in the order of time. */
function eventsOf(runs) {
  const found = new Map(), add = (one) => { const key = `${one.kind} ${one.time.toFixed(3)} ${one.text}`; if (!found.has(key)) found.set(key, one); };
  for (const run of runs) {
    for (const push of run.pushes) add({ time: push.start, end: push.end, kind: "push", text: `push ${Math.hypot(...push.force).toPrecision(3)} N, ${push.site.replaceAll("_", " ")}` });
    for (const [time, text] of run.events) add({ time, kind: "payload", text });
    if (run.fall) add({ time: run.end, kind: "fall", color: run.color, text: `${run.name} fell (${run.fall})` });
  }
  return [...found.values()].sort((a, b) => a.time - b.time);
}
