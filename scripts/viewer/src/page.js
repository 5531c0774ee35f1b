// Small helpers of the page. Text is always put in as text, never as markup.
export const make = (tag, attributes = {}, ...children) => {
  const node = document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  node.append(...children);
  return node;
};

const SVG = "http://www.w3.org/2000/svg";
export const draw = (tag, attributes = {}, ...children) => {
  const node = document.createElementNS(SVG, tag);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  node.append(...children);
  return node;
};

const ICONS = {
  play: "M5 3l9 5-9 5z", pause: "M4 3h3v10h-3zM9 3h3v10h-3z", back: "M11 3v10l-6-5zM3 3h1.6v10h-1.6z", ahead: "M5 3v10l6-5zM11.4 3h1.6v10h-1.6z",
};
/** A button with an icon or words; `name` is what screen readers say. */
export const button = (name, { icon, text, ...more } = {}) => {
  const node = make("button", { type: "button", title: name, "aria-label": name, ...more });
  node.append(icon ? draw("svg", { viewBox: "0 0 16 16", "aria-hidden": "true" }, draw("path", { d: ICONS[icon] })) : text);
  node.icon = (other) => node.querySelector("path").setAttribute("d", ICONS[other]);
  node.say = (words) => { node.title = words; node.setAttribute("aria-label", words); };
  return node;
};

export const darkness = matchMedia("(prefers-color-scheme: dark)"), paper = matchMedia("print");
export const isDark = () => darkness.matches && !paper.matches;

const DIMMEST = 105;  // of 255, of a line in the dark; black would be lost there

/** A controller's color that shows on the page, lifted in the dark as the report's charts lift it. */
export const lifted = (color) => {
  if (!isDark()) return color;
  const parts = [1, 3, 5].map((i) => 0.68 * parseInt(color.slice(i, i + 2), 16) + 0.32 * 255), lack = Math.max(0, DIMMEST - Math.max(...parts));
  return `#${parts.map((part) => Math.round(part + lack).toString(16).padStart(2, "0")).join("")}`;
};

/** A round step of an axis that has about `count` of them. */
export const roundStep = (span, count) => {
  const rough = span / count, size = 10 ** Math.floor(Math.log10(rough));
  return [1, 2, 5, 10].map((factor) => factor * size).find((step) => step >= rough * 0.999) ?? size;
};
