// What actuators have done, and what is planned, over time: a Gantt chart.

import { byId, make } from "./elements.js";
import { drawLanes, sample } from "./lanes.js";
import { chosen, now, rowsOf, state, watch } from "./store.js";
import { byName, clock } from "./words.js";

const LANE = 30; // pixels
const LABELS = 170; // pixels of the names of actuators, at most
const AHEAD = 0.4; // of the width, for what is planned
const SLOWEST = 250; // ms between two drawings

const LEGEND = {
  success: "done",
  failure: "failed",
  other: "another answer, or none",
  open: "under way",
  planned: "planned, as long as such actions take in the mean",
  hold: "paused or on hold",
  approval: "waits for an approval",
};
byId("legend").append(...Object.entries(LEGEND).map(([kind, text]) => make("span", {}, sample(kind), text)));

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

function lanesOf(system, names, at) {
  const tell = (bar) => `${bar.actuator}: ${bar.action}${bar.answer ? `, ${bar.answer}` : ""}`;
  const lanes = new Map(names.map((name) => [name, { name, bars: [], tell }]));
  const done = [...rowsOf(system, "bars").values()].map((bar) => ({
    ...bar,
    from: bar.began,
    to: bar.ended ?? at,
    kind: bar.ended === null ? "open" : ["success", "failure"].includes(bar.answer) ? bar.answer : "other",
  }));
  for (const bar of [...done, ...outlook(system, at)]) {
    lanes.get(bar.actuator)?.bars.push({ ...bar, text: bar.action });
  }
  for (const { bars } of lanes.values()) bars.sort((a, b) => a.from - b.from);
  return [...lanes.values(), ...holdsOf(system, at)];
}

/** The lane of what an operator held; none if that was nothing. */
function holdsOf(system, at) {
  const bars = [...rowsOf(system, "holds").values()].map(({ began, ended, kind, name }) => ({
    from: began,
    to: ended ?? Math.max(began, at),
    kind,
    text: name,
  }));
  bars.sort((a, b) => a.from - b.from);
  return bars.length ? [{ name: "operator", bars, tell: (bar) => bar.text }] : [];
}

const TABLES = ["actuators", "bars", "holds", "means", "plan"];

let drawnAt = 0,
  drawn = { what: "", at: 0 };

watch(() => {
  if (performance.now() - drawnAt < SLOWEST) return;
  const drawing = byId("drawing"),
    at = now(),
    past = Number(byId("span").value),
    width = Math.max(200, drawing.parentElement.clientWidth - 24),
    system = chosen();
  // Only what has changed, or has moved by a pixel, is drawn anew.
  const changes = TABLES.map((name) => system?.changes[name]);
  const what = [state.chosen, system?.count, past, width, ...changes].join(" ");
  if (what === drawn.what && Math.abs(at - drawn.at) < (past / width) * (1 - AHEAD)) return;
  drawn = { what, at };
  drawnAt = performance.now();
  const names = [...rowsOf(system, "actuators").keys()].sort(byName),
    lanes = lanesOf(system, names, at);
  drawing.setAttribute("aria-label", `What ${names.join(", ") || "nobody"} did and will do; the lists have the same in words`);
  drawLanes(byId("axis"), drawing, lanes, {
    from: at - past,
    to: at + (past * AHEAD) / (1 - AHEAD),
    width,
    labels: Math.min(LABELS, width / 4, 18 + 7 * Math.max(0, ...lanes.map(({ name }) => name.length))),
    row: LANE,
    clock,
    marks: [{ at, kind: "now", text: "now" }],
  });
});
byId("span").addEventListener("change", () => (drawnAt = 0));
