// Charts that scroll along with a simulation.
import { lifted, make } from "./page.js";
import { axes, line } from "./plots.js";

export const SPAN = 10;  // s, that are seen
const KEPT = 600;  // samples of them at most

/** One signal of all players over the last seconds. */
export class Strip {
  constructor(label) {
    this.lines = [];
    this.canvas = make("canvas", { role: "img", "aria-label": `${label} over the last ${SPAN} seconds` });
    this.element = make("div", { class: "plot" }, make("p", {}, label), this.canvas);
  }
  clear() { this.lines = []; }
  add(i, time, value) {
    const own = (this.lines[i] ??= { times: [], values: [] }), last = own.times.at(-1);
    if (!Number.isFinite(value) || (last !== undefined && time - last < SPAN / KEPT)) return;
    own.times.push(time); own.values.push(value);
    const old = own.times.findIndex((t) => t >= time - SPAN);
    if (old > KEPT / 4) { own.times.splice(0, old); own.values.splice(0, old); }
  }
  draw(time, runs, spans, ink) {
    const to = Math.max(SPAN, time), values = this.lines.flatMap((own) => own.values).sort((a, b) => a - b);
    this.element.classList.toggle("empty", !values.length);
    const high = 1.06 * Math.min(values.at(-1) ?? 1, 4 * (values[Math.floor(0.98 * (values.length - 1))] ?? 1)) || values.at(-1) || 1;
    const view = axes(this.canvas, to - SPAN, to, high, spans, ink);
    if (!view) return;
    this.lines.forEach((own, i) => { if (runs[i]) line(view, lifted(runs[i].color), own.values, (k) => own.times[k]); });
    view.g.restore();
  }
}
