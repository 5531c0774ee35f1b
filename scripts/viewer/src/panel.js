// What can be pressed in live play; each is an order, and shows what the simulation says of it.
import { button, make } from "./page.js";

const SPEEDS = [1 / 16, 1 / 8, 1 / 4, 1 / 2, 1, 2, 4];
const PUSHES = [["ahead", "↑", [1, 0, 0]], ["back", "↓", [-1, 0, 0]], ["left", "←", [0, 1, 0]], ["right", "→", [0, -1, 0]], ["up", "", [0, 0, 1]], ["down", "", [0, 0, -1]]];
const KEYS = { ArrowUp: [1, 0, 0], ArrowDown: [-1, 0, 0], ArrowLeft: [0, 1, 0], ArrowRight: [0, -1, 0] };
const HARDER = 1.25;  // of a key
const PAYLOAD = { none: "there is none", waiting: "not attached yet", held: "attached", dropped: "dropped" };

const press = (text, act, more = {}) => { const node = button(more.name ?? text, { text, ...more }); node.onclick = act; return node; };
const choice = (name, options, act) => {
  const node = make("select", { "aria-label": name }, ...options.map(([value, text]) => make("option", { value }, text)));
  node.onchange = () => act(node.value);
  return node;
};
const short = (value) => String(Number(value.toPrecision(3)));

/** A slider with its value in words; on a logarithmic scale if `log`. `act` is called when it is let go. */
function slider(name, { low, high, value, step = "any", log = false, unit = "", act = () => {} }) {
  const out = make("output"), to = log ? Math.log : (v) => v, from = log ? Math.exp : (v) => v;
  const input = make("input", { type: "range", min: to(low), max: to(high), step, "aria-label": name });
  const say = () => { out.textContent = `${short(from(Number(input.value)))}${unit && ` ${unit}`}`; input.setAttribute("aria-valuetext", out.textContent); };
  const row = make("label", { class: "row" }, make("span", {}, name), input, out);
  input.oninput = say;
  input.onchange = () => act(from(Number(input.value)));
  Object.defineProperty(row, "value", { get: () => from(Number(input.value)), set: (v) => { input.value = to(v); say(); } });
  row.tell = (v) => { if (document.activeElement !== input || !input.matches(":active")) row.value = v; };
  row.value = value;
  return row;
}

export class Panel {
  constructor(root, start, say) {
    Object.assign(this, { root, start, say, gains: [] });
    this.bar = this.#bar();
    this.help = make("p", { class: "help" }, start.able.push ? "Drag a robot to pull it, drag beside it to turn the view." : "Drag to turn the view.", make("span", {}, ` Keys: ${start.able.push ? "arrows push, + and \u2212 change the size, " : ""}${start.able.drop ? "d drops, " : ""}space pauses, r resets, comma and period change the speed.`));
    this.refused = make("p", { class: "refused", role: "status" });
    root.append(...(start.able.push ? [this.#pushes()] : []), ...(start.able.drop || start.able.attach ? [this.#payload()] : []), this.#who(), this.#gains(), ...this.#conditions(), this.#save());
    addEventListener("keydown", (event) => this.#key(event));
  }
  #bar() {
    this.pause = press("pause", () => this.say({ do: "pause", on: !this.last.paused }), { class: "pause" });
    this.clock = make("span", { class: "clock" });
    this.speed = choice("speed", SPEEDS.map((speed) => [speed, `${speed < 1 ? `1/${1 / speed}` : speed}×`]), (value) => this.say({ do: "speed", value: Number(value) }));
    this.seed = make("input", { type: "number", min: 0, step: 1, value: 0, "aria-label": "seed" });
    this.again = press("reset", () => this.#reset(), { name: "reset, with this seed" });
    return make("div", { class: "bar" }, this.pause, this.speed, this.clock, make("label", {}, "seed ", this.seed), this.again);
  }
  /** Begin anew, with the seed that is written. */
  #reset() { this.say({ do: "reset", seed: Math.round(Number(this.seed.value)) }); }
  #who() {
    const names = this.start.controllers.map((name) => [name, name]);
    this.first = choice("controller", names, (name) => this.say({ do: "controller", player: 0, name }));
    this.second = choice("beside it", [["", "none"], ...names], (name) => this.say({ do: "compare", name: name || null }));
    return this.#part("controllers", make("label", { class: "row" }, make("span", {}, "controller"), this.first), make("label", { class: "row" }, make("span", {}, "beside it"), this.second));
  }
  #pushes() {
    const { push, sites } = this.start;
    this.force = slider("size", { low: push.most / 100, high: push.most, value: push.force, unit: "N" });
    this.site = choice("push at", sites.map((site) => [site, site.replaceAll("_", " ")]), () => {});
    this.site.value = push.site;
    const pad = make("div", { class: "pad" }, ...PUSHES.map(([name, arrow, way]) => press(`${arrow} ${name}`.trim(), () => this.#push(way), { name: `push ${name}` })));
    return this.#part("push", make("label", { class: "row" }, make("span", {}, "at"), this.site), this.force, pad);
  }
  #push(way) { this.say({ do: "push", site: this.site.value, force: way.map((part) => part * this.force.value) }); }
  #payload() {
    const { mass, able } = this.start;
    this.drop = press("drop (d)", () => this.say({ do: "drop" }), { name: "drop the payload" });
    this.mass = slider("mass", { low: Math.min(0.05, mass / 4), high: 4 * mass, value: mass, log: true, unit: "kg" });
    this.attach = press("attach", () => this.say({ do: "attach", mass: this.mass.value }), { name: "attach a payload" });
    this.laden = make("input", { type: "checkbox" });
    this.laden.onchange = () => this.say({ do: "payload", on: this.laden.checked });
    this.load = make("span", { class: "soft" });
    const buttons = make("div", { class: "pad" }, ...(able.drop ? [this.drop] : []), ...(able.attach ? [this.attach] : []));
    return this.#part("payload", this.load, buttons, this.mass, make("label", { class: "check" }, this.laden, "there from the start (begins anew)"));
  }
  #gains() {
    this.tuned = make("div");
    return make("details", {}, make("summary", {}, "gains"), this.tuned);
  }
  #conditions() {
    const { conditions } = this.start;
    if (!conditions.length) return [];
    this.sizes = conditions.map(({ kind, text, unit, low, high, integer }) => {
      const on = make("input", { type: "checkbox", "aria-label": kind.replaceAll("_", " ") }), set = () => this.say({ do: "condition", kind, value: on.checked ? row.value : null });
      const row = slider(kind.replaceAll("_", " "), { low, high, value: low, unit, step: integer ? 1 : (high - low) / 200, act: () => { on.checked = true; set(); } });
      on.onchange = set;
      row.prepend(on);
      row.title = text;
      return { kind, on, row };
    });
    this.around = make("details", {}, make("summary", {}, this.sizes.some(({ kind }) => kind === "wind") ? "wind and other conditions" : "conditions"), make("p", { class: "soft" }, "They last for an episode: it begins anew."), ...this.sizes.map(({ row }) => row));
    return [this.around];
  }
  #save() {
    this.file = make("a", { class: "button", href: `/disturbances.json${location.search}`, download: "play.json" }, "save what was done");
    this.command = make("code", { tabindex: "0" });
    this.inexact = make("p", { class: "soft" }, "A controller or a gain has changed on the way: another run differs until there is a reset.");
    return this.#part("who survives it?", this.file, make("p", { class: "soft" }, "The disturbances of this episode, and what runs them again:"), this.command, this.inexact);
  }
  #part(title, ...children) { return make("section", {}, make("h3", {}, title), ...children); }
  time(seconds) { this.clock.textContent = `${seconds.toFixed(2)} s`; }
  told(told) {
    this.last = told;
    this.pause.textContent = told.paused ? "go on" : "pause";
    this.pause.say(told.paused ? "go on" : "pause");
    this.pause.setAttribute("aria-pressed", String(told.paused));
    this.pause.disabled = told.over;
    this.again.setAttribute("aria-pressed", String(told.over));
    this.speed.value = String(told.speed);
    if (document.activeElement !== this.seed) this.seed.value = told.seed;
    this.#players(told.players);
    if (this.load) {
      this.load.textContent = PAYLOAD[told.payload];
      this.drop.disabled = told.payload !== "held" || told.over;
      this.attach.disabled = told.payload !== "none" || told.over;
      this.laden.checked = told.laden;
    }
    for (const { kind, on, row } of this.sizes ?? []) {
      on.checked = kind in told.conditions;
      if (on.checked) row.tell(told.conditions[kind]);
      else row.querySelector("output").textContent = "off";
    }
    this.command.replaceChildren(...told.command.split(/ (?=--)/).flatMap((word, i) => [...(i ? [" "] : []), make("span", {}, word)]));
    this.inexact.hidden = told.exact;
    this.refused.textContent = told.refused;
  }
  #players(players) {
    const name = (select, value) => { if (![...select.options].some((one) => one.value === value)) select.append(make("option", { value }, value)); select.value = value; };
    name(this.first, players[0].name);
    name(this.second, players[1]?.name ?? "");
    const shape = JSON.stringify(players.map((player) => [player.name, Object.keys(player.gains)]));
    if (shape !== this.shape) {
      this.shape = shape;
      this.gains = players.map(({ gains }, player) => Object.entries(gains).map(([gain, [, low, high, value]]) => slider(gain, { low, high, value, log: true, step: 0.001, act: (now) => this.say({ do: "gain", player, gain, value: now }) })));
      this.tuned.replaceChildren(...players.flatMap((player, i) => [make("h4", {}, player.name), ...(this.gains[i].length ? this.gains[i] : [make("p", { class: "soft" }, "nothing to tune")])]));
    }
    players.forEach(({ gains }, i) => Object.values(gains).forEach(([, , , value], k) => this.gains[i][k].tell(value)));
  }
  #key(event) {
    const { tagName, type } = event.target;
    if (tagName === "SELECT" || (tagName === "INPUT" && type !== "checkbox") || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === " " && ["BUTTON", "SUMMARY", "INPUT", "A"].includes(tagName)) return;
    const harder = (factor) => { if (this.force) this.force.value = this.force.value * factor; }, pace = (by) => { const at = SPEEDS.indexOf(this.last.speed) + by; if (at in SPEEDS) this.say({ do: "speed", value: SPEEDS[at] }); };
    const act = {
      " ": () => this.say({ do: "pause", on: !this.last.paused }), d: () => this.say({ do: "drop" }), r: () => this.#reset(),
      "+": () => harder(HARDER), "=": () => harder(HARDER), "-": () => harder(1 / HARDER), ",": () => pace(-1), ".": () => pace(1),
    }[event.key] ?? (event.key in KEYS && this.start.able.push ? () => this.#push(KEYS[event.key]) : null);
    if (act) { act(); event.preventDefault(); }
  }
}
