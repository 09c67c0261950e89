// What actuators have done, and what is planned, over time: a Gantt chart.

import { byId, make } from "./elements.js";
import { drawLanes, sample } from "./lanes.js";
import { chosen, now, rowsOf, state, watch } from "./store.js";
import { byName, clock, lasted } from "./words.js";

const LANE = 30; // pixels
const LABELS = 170; // pixels of the names of actuators, at most
const AHEAD = 0.4; // of the width, for what is planned
const MOST_GOALS = 12; // that have a lane
const SLOWEST = 250; // ms between two drawings

const LEGEND = {
  success: "done",
  failure: "failed",
  other: "another answer, or none",
  open: "under way",
  planned: "planned: as long as the plan says, or else as similar actions take on average",
  late: "after the deadline",
  hold: "paused or on hold",
  approval: "waits for an approval",
};
byId("legend").append(...Object.entries(LEGEND).map(([kind, text]) => make("span", {}, sample(kind), text)));

/** How many seconds later the clock of the page is than ROS's. */
const ahead = () => (state.beat ? state.beat.now - state.beat.ros : 0);

/** What is planned and under way from now on, by the times of the plan. */
function timed(times, at) {
  const found = times.map(([actuator, action, begins, ends]) => ({
    actuator,
    action,
    from: Math.max(at, begins + ahead()),
    to: ends + ahead(),
    kind: "planned",
  }));
  return found.filter(({ from, to }) => from < to);
}

/** The lanes of the first open goals of which it is known when they are expected; with deadlines. */
function goalsOf(system, at) {
  const goals = [...rowsOf(system, "goals").values()].filter((goal) => goal.expected !== null && goal.ended === null);
  return goals.sort((a, b) => a.number - b.number).slice(0, MOST_GOALS).map((goal) => {
    const due = goal.due === null ? null : goal.due + ahead(),
      to = Math.max(at, goal.expected + ahead()),
      late = due === null || to - due < 1 ? "in time" : `late by ${lasted(to - due)}`;
    const bar = { from: goal.came ?? at, to, due, kind: "open", text: due === null ? "" : late, notes: [[due, "⚑"]] };
    return { name: goal.request, bars: [bar], tell: () => `${goal.request}${due === null ? "" : `: ${late}`}` };
  });
}

/** Where the planned actions of each actuator will be, if they take as long as others have. */
function outlook(system, at) {
  const times = rowsOf(system, "plan").get("plan")?.times;
  if (times?.length) return timed(times, at);
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
  return [...lanes.values(), ...goalsOf(system, at), ...holdsOf(system, at)];
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

const TABLES = ["actuators", "bars", "goals", "holds", "means", "plan"];

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
