// Begin live play, or every replay of the page: those in sight at once, the others one by one when there is time, for print.
import { Live } from "./live.js";
import { make } from "./page.js";
import { Replay } from "./replay.js";
import { able } from "./world.js";

const NO_WEBGL = "This browser has no WebGL 2, so that the robot cannot be shown;";
const drawn = able(), waiting = new Set(document.querySelectorAll(".replay"));
let last = Promise.resolve();

function begin(root) {
  if (!waiting.delete(root)) return last;
  return (last = last.then(async () => {
    try {
      if (!drawn) root.append(make("p", { class: "failed" }, `${NO_WEBGL} events and charts are below.`));
      root.replay = new Replay(root, JSON.parse(root.querySelector("script").textContent), drawn);
      await root.replay.start();
      root.dataset.ready = "1";
    } catch (error) {
      root.append(make("p", { class: "failed" }, `The replay cannot be shown here: ${error.message}`));
      root.dataset.failed = error.message;
    }
  }));
}

const watch = new IntersectionObserver((entries) => entries.filter((one) => one.isIntersecting).forEach((one) => { watch.unobserve(one.target); begin(one.target); }), { rootMargin: "300px" });
for (const root of waiting) watch.observe(root);
const idle = globalThis.requestIdleCallback ?? ((act) => setTimeout(act, 200));
const rest = () => { const [next] = waiting; if (next) idle(() => begin(next).then(rest)); };
addEventListener("load", () => setTimeout(rest, 1000), { once: true });
if (document.readyState === "complete") setTimeout(rest, 1000);
for (const root of document.querySelectorAll(".live")) {
  if (!drawn) root.append(make("p", { class: "failed" }, `${NO_WEBGL} everything else is below.`));
  root.live = new Live(root, drawn);
}
addEventListener("beforeprint", () => document.querySelectorAll(".replay[data-ready]").forEach((root) => root.replay.paint()));
if (parent !== window) new ResizeObserver(() => parent.postMessage({ replayHeight: document.body.offsetHeight }, "*")).observe(document.body);  // a page fits its frame to it
