// Charts under a replay, on one time axis with it; a click or a drag there is a seek.
import { lifted, make, roundStep } from "./page.js";
import { unpack } from "./unpack.js";

const LEFT = 40, RIGHT = 8, BOTTOM = 16;

/** One chart for each label that any of the runs has. */
export async function plotsOf(runs, seek) {
  const labels = [...new Set(runs.flatMap((run) => run.series.map((one) => one.label)))];
  return Promise.all(labels.map(async (label) => {
    const lines = runs.flatMap((run) => run.series.filter((one) => one.label === label).map((one) => ({ run, one })));
    return new Plot(label, await Promise.all(lines.map(async ({ run, one }) => ({ run, period: one.period, values: await unpack(one) }))), seek);
  }));
}

/** Begin a chart from one time to another and up to a value; null where it has no room. Clipped until `g.restore()`. */
export function axes(canvas, from, to, high, spans, ink) {
  const scale = Math.min(2, devicePixelRatio), width = canvas.clientWidth, height = canvas.clientHeight;
  if (!width) return null;
  if (canvas.width !== Math.round(width * scale)) { canvas.width = Math.round(width * scale); canvas.height = Math.round(height * scale); }
  const g = canvas.getContext("2d"), span = to - from, x = (t) => LEFT + ((t - from) / span) * (width - LEFT - RIGHT), y = (v) => height - BOTTOM - (v / high) * (height - BOTTOM - 6);
  g.setTransform(scale, 0, 0, scale, 0, 0);
  g.clearRect(0, 0, width, height);
  Object.assign(g, { font: "11px system-ui, sans-serif", fillStyle: ink("--soft"), textAlign: "right", strokeStyle: ink("--line"), lineWidth: 1 });
  const step = roundStep(high, 5);
  for (let v = 0; v <= high; v += step) { g.beginPath(); g.moveTo(LEFT, y(v)); g.lineTo(width - RIGHT, y(v)); g.stroke(); g.fillText(String(Number(v.toPrecision(6))), LEFT - 5, y(v) + 4); }
  g.textAlign = "center";
  const second = roundStep(span, Math.max(2, width / 70)), first = Math.ceil(from / second - 1e-9) * second;
  for (let t = first; t <= to - 0.4 * second; t += second) g.fillText(`${Number(t.toPrecision(4))}${t === first ? " s" : ""}`, x(t), height - 3);
  g.save(); g.beginPath(); g.rect(LEFT, 0, width - LEFT - RIGHT, height - BOTTOM + 1); g.clip();
  g.fillStyle = ink("--push"); g.globalAlpha = 0.16;
  for (const [begin, end] of spans) g.fillRect(x(begin), 0, Math.max(2, x(end) - x(begin)), height - BOTTOM);
  g.globalAlpha = 1;
  return { g, x, y, height };
}

/** Draw values over the times that `time(i)` gives. */
export function line({ g, x, y }, color, values, time) {
  g.strokeStyle = color; g.lineWidth = 1.4; g.beginPath();
  values.forEach((v, i) => (i ? g.lineTo(x(time(i)), y(v)) : g.moveTo(x(time(i)), y(v))));
  g.stroke();
}

class Plot {
  constructor(label, lines, seek) {
    this.label = label; this.lines = lines;
    this.canvas = make("canvas", { role: "img", "aria-label": `${label} over time; click to go there` });
    this.element = make("div", { class: "plot" }, make("p", {}, label), this.canvas);
    const all = lines.flatMap((line) => [...line.values]).sort((a, b) => a - b);
    this.high = 1.06 * Math.min(all.at(-1) ?? 1, 4 * (all[Math.floor(0.98 * (all.length - 1))] ?? 1)) || all.at(-1) || 1;  // a fall's peak may leave
    const go = (event) => {
      const box = this.canvas.getBoundingClientRect();
      seek(((event.clientX - box.left - LEFT) / (box.width - LEFT - RIGHT)) * this.length);
    };
    this.canvas.onpointerdown = (event) => { this.canvas.setPointerCapture(event.pointerId); go(event); };
    this.canvas.onpointermove = (event) => { if (event.buttons & 1) go(event); };
  }
  draw(time, length, spans, ink) {
    const { high } = this, view = axes(this.canvas, 0, length, high, spans, ink);
    this.length = length;
    if (!view) return;
    const { g, x, y, height } = view;
    for (const { run, period, values } of this.lines.toReversed()) line(view, lifted(run.color), values, (i) => i * period);
    g.strokeStyle = ink("--ink"); g.lineWidth = 1; g.beginPath(); g.moveTo(x(time), 0); g.lineTo(x(time), height - BOTTOM); g.stroke();
    for (const { run, period, values } of this.lines.toReversed()) {
      const v = values[Math.round(time / period)];
      if (v === undefined) continue;
      g.fillStyle = lifted(run.color); g.beginPath(); g.arc(x(time), y(Math.min(v, high)), 3, 0, 7); g.fill();
    }
    g.restore();
  }
}
