// What actuators have done, and what is planned, over time: a Gantt chart.

import { byId, make } from "./dom.js";
import { chosen, now, rowsOf, watch } from "./store.js";
import { byName, clock } from "./words.js";

const SVG = "http://www.w3.org/2000/svg";
const LANE = 30; // pixels
const TOP = 18; // for the times
const AHEAD = 0.4; // of the width, for what is planned
const LETTER = 6.6; // pixels of a character, about
const SLOWEST = 250; // ms between two drawings

const LEGEND = [
  ["success", "✓", "done"],
  ["failure", "✕", "failed"],
  ["open", "▶", "under way"],
  ["planned", "┄", "planned, as long as such actions take in the mean"],
];
byId("legend").append(
  ...LEGEND.map(([kind, sign, text]) =>
    make("span", {}, make("span", { class: `sample ${kind}`, "aria-hidden": "true", text: sign }), ` ${text}`),
  ),
);

function shape(parent, tag, attributes, text) {
  const made = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  if (text !== undefined) made.textContent = text;
  parent.append(made);
  return made;
}

/** Where the planned actions of each actuator will be, if they take as long as others have. */
function outlook(system, at) {
  const means = rowsOf(system, "means");
  const mean = (name) => means.get(name)?.seconds ?? means.get("")?.seconds ?? 5;
  const free = new Map();
  const last = new Map();
  for (const [name, row] of rowsOf(system, "actuators")) {
    last.set(name, row.action);
    free.set(name, row.action && row.since ? Math.max(at, row.since + mean(name)) : at);
  }
  const found = [];
  let begin = at;
  let step = null;
  for (const [number, actuator, action, how] of rowsOf(system, "plan").get("plan")?.actions ?? []) {
    // An action that goes on over several steps is one.
    const goesOn = last.get(actuator) === action;
    last.set(actuator, action);
    if (goesOn || how === "done" || how === "acts") continue;
    if (number !== step) {
      step = number;
      begin = Math.max(at, ...free.values()); // the steps of most encodings have a barrier
    }
    const from = Math.max(begin, free.get(actuator) ?? at);
    free.set(actuator, from + mean(actuator));
    found.push({ actuator, action, from, to: from + mean(actuator), kind: "planned" });
  }
  return found;
}

const SIGNS = { success: "✓ ", failure: "✕ ", open: "▶ ", planned: "", other: "" };

function bars(system, at) {
  const done = [...rowsOf(system, "bars").values()].map((bar) => ({
    ...bar,
    from: bar.began,
    to: bar.ended ?? at,
    kind: bar.ended === null ? "open" : ["success", "failure"].includes(bar.answer) ? bar.answer : "other",
  }));
  return [...done, ...outlook(system, at)];
}

let drawnAt = 0;

watch(() => {
  if (performance.now() - drawnAt < SLOWEST) return;
  drawnAt = performance.now();
  const drawing = byId("drawing"),
    system = chosen(),
    width = Math.max(200, drawing.parentElement.clientWidth - 24),
    names = [...rowsOf(system, "actuators").keys()].sort(byName),
    label = Math.min(110, 14 + 7 * Math.max(0, ...names.map((name) => name.length))),
    at = now(),
    past = Number(byId("span").value),
    scale = ((width - label) * (1 - AHEAD)) / past,
    height = TOP + LANE * Math.max(1, names.length) + 4;
  const x = (seconds) => label + (seconds - at + past) * scale;
  drawing.replaceChildren();
  drawing.setAttribute("width", width);
  drawing.setAttribute("height", height);
  drawing.setAttribute("viewBox", `0 0 ${width} ${height}`);
  drawing.setAttribute("aria-label", `What ${names.join(", ") || "nobody"} did and will do; the lists have the same in words`);
  const clip = shape(shape(drawing, "clipPath", { id: "lanes" }), "rect", { x: label, y: 0, width: width - label, height });
  clip.setAttribute("class", "clip");
  names.forEach((name, i) => {
    const y = TOP + i * LANE;
    shape(drawing, "rect", { x: 0, y, width, height: LANE, class: i % 2 ? "lane odd" : "lane" });
    shape(drawing, "text", { x: 4, y: y + LANE / 2, class: "name" }, name.length > 14 ? `${name.slice(0, 13)}…` : name);
  });
  const inside = shape(drawing, "g", { "clip-path": "url(#lanes)" });
  for (const part of width > 500 ? [1, 0.5] : [1]) {
    const seconds = at - past * part;
    shape(inside, "text", { x: x(seconds) + (part === 1 ? 2 : 0), y: 9, class: part === 1 ? "time" : "time middle" }, clock(seconds));
  }
  shape(inside, "text", { x: x(at), y: 9, class: "time middle" }, "now");
  for (const bar of bars(system, at)) {
    const lane = names.indexOf(bar.actuator);
    if (lane < 0 || bar.to < at - past || x(bar.from) > width) continue;
    const left = Math.max(x(bar.from), label),
      wide = Math.max(2, x(bar.to) - left - 1),
      y = TOP + lane * LANE + 3;
    const group = shape(inside, "g", {});
    shape(group, "rect", { x: left, y, width: wide, height: LANE - 6, rx: 4, class: `bar ${bar.kind}` });
    const room = Math.floor((wide - 8) / LETTER);
    const text = SIGNS[bar.kind] + bar.action;
    if (room >= 2) {
      const shown = text.length > room ? `${text.slice(0, room - 1)}…` : text;
      shape(group, "text", { x: left + 4, y: y + (LANE - 6) / 2, class: `in ${bar.kind}` }, shown);
    }
    shape(group, "title", {}, `${bar.actuator}: ${bar.action}${bar.answer ? `, ${bar.answer}` : ""}`);
  }
  shape(drawing, "line", { x1: x(at), x2: x(at), y1: TOP - 4, y2: height, class: "now" });
});
byId("span").addEventListener("change", () => (drawnAt = 0));
