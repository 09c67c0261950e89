// Draws the report. Texts of the bag get into the page by textContent and fillText alone.

const DATA = JSON.parse(document.getElementById("data").textContent);
const ROW = 20,
  LABELS = 108,
  AXIS = 24,
  GAP = 8; // heights and widths on the time line, in pixels
const PAGE = 25; // rows of a table that are shown at once
const MOST_CAUSES = 4; // that are named of one plan change
const LEAST = 0.05; // shortest section, in seconds

const byId = (id) => document.getElementById(id);
const style = getComputedStyle(document.documentElement);
const colours = {};
const colour = (name) => (colours[name] ??= style.getPropertyValue(`--${name}`).trim() || "#777");

function unpack(table) {
  return table.rows.map((row) => Object.fromEntries(table.names.map((name, i) => [name, row[i]])));
}

function element(tag, text, parent, className) {
  const made = document.createElement(tag);
  if (text !== undefined) made.textContent = text;
  if (className) made.className = className;
  if (parent) parent.append(made);
  return made;
}

function dot(name, parent) {
  element("i", "", parent).style.background = colour(name);
}

const goals = unpack(DATA.goals),
  actions = unpack(DATA.actions),
  messages = unpack(DATA.messages);
const searches = unpack(DATA.searches),
  steps = unpack(DATA.steps),
  changes = unpack(DATA.changes),
  answers = unpack(DATA.answers),
  restarts = unpack(DATA.restarts);
const END = Math.max(DATA.ended, DATA.began + LEAST);
const CAUSES = {
  start: "the first plan",
  goal: "goal",
  queued: "goal from the queue",
  cancel: "cancel request",
  message: "message",
  failure: "failed",
  answer: "answer",
  success: "done",
  none: "nothing came",
};

// Words.

function clock(seconds, unit = 0.001) {
  const digits = unit >= 1 ? 0 : Math.min(3, Math.ceil(-Math.log10(unit)));
  const sign = seconds < 0 ? "−" : "";
  const rounded = Math.abs(seconds).toFixed(digits);
  if (rounded < 60) return `${sign}${rounded} s`;
  const whole = Math.floor(rounded),
    parts = [Math.floor(whole / 60) % 60, whole % 60];
  if (whole >= 3600) parts.unshift(Math.floor(whole / 3600));
  const text = parts.map((part, i) => (i ? String(part).padStart(2, "0") : part)).join(":");
  return sign + text + (digits ? (rounded - whole).toFixed(digits).slice(1) : "");
}

function lasted(seconds) {
  if (!seconds) return "0 s";
  if (seconds < 0.9995) return `${(seconds * 1000).toPrecision(3)} ms`;
  return seconds < 60 ? `${seconds.toFixed(1)} s` : clock(seconds, 1);
}

const counted = (number, word) => `${number} ${word}${number === 1 ? "" : word.endsWith("h") ? "es" : "s"}`;

function causesOf(change) {
  const texts = change.causes.map(([kind, text]) => (text ? `${CAUSES[kind]} ${text}` : CAUSES[kind]));
  const more = texts.length > MOST_CAUSES ? `; and ${texts.length - MOST_CAUSES} more` : "";
  return texts.slice(0, MOST_CAUSES).join("; ") + more;
}

const waited = (goal) => Math.max(0, (goal.accepted ?? goal.ended ?? END) - goal.came);
const ran = (goal) => (goal.accepted === null ? 0 : (goal.ended ?? END) - goal.accepted);
const listed = (texts) => texts.join(", ") || "nothing";

function tellGoal(goal) {
  const lines = [`goal ${goal.name || goal.id}: ${goal.outcome}${goal.reason && ` (${goal.reason})`}`];
  if (goal.information.length) lines.push(`information: ${goal.information.join(", ")}`);
  lines.push(`came at ${clock(goal.came)}${goal.behind && `, queued behind ${goal.behind}`}`);
  if (goal.accepted !== null) {
    lines.push(
      `accepted${goal.slot && ` in slot ${goal.slot}`} at ${clock(goal.accepted)}, after ${lasted(waited(goal))}`,
    );
  }
  if (goal.cancels !== null) lines.push(`asked to be cancelled at ${clock(goal.cancels)}`);
  if (goal.ended !== null) {
    const how =
      goal.accepted === null
        ? `waited ${lasted(waited(goal))}`
        : `ran ${lasted(ran(goal))}, ${counted(goal.steps, "step")}`;
    lines.push(`ended at ${clock(goal.ended)}: ${how}`);
  }
  return lines.join("\n");
}

function tellAction(action) {
  const end = action.ended === null ? "no answer" : action.answer || "another action came before the answer";
  const time = action.ended === null ? "" : ` after ${lasted(action.ended - action.began)}`;
  return `${action.actuator}: ${action.name}\n${end}${time}\nstep ${action.step}, published at ${clock(action.began)}`;
}

function tellMessage(message) {
  const what = message.id ? `message ${message.id}: ${message.value}\n` : "";
  const why = message.dropped && `dropped: ${message.dropped}\n`;
  return `${what}${why}step ${message.step}, at ${clock(message.seconds)}`;
}

const tellChange = (change) =>
  `plan changed: ${causesOf(change)}\nactions left: ${change.old} → ${change.new}, up to step ${change.horizon}\n` +
  `from step ${change.first} on: ${listed(change.before)} → ${listed(change.after)}\n` +
  `step ${change.step}, at ${clock(change.seconds)}`;
const tellAnswer = (answer) =>
  `why ${answer.question}: ${answer.text}\nstep ${answer.step}, at ${clock(answer.seconds)}`;
const tellRestart = (restart) =>
  `${restart.node} goes on after it had died or was ended${restart.reason && `: ${restart.reason}`}\n` +
  `step ${restart.step}, at ${clock(restart.seconds)}, after ${lasted(restart.duration)}; ` +
  `the last event before was at ${clock(restart.last)}`;
const tellSearch = (search) =>
  `search: ${search.result === "unknown" ? "interrupted" : search.result} after ${lasted(search.duration)}\n` +
  `step ${search.step}, horizon ${search.horizon}, ended at ${clock(search.ended)}`;
const tellStep = (row, i) =>
  `step ${row.number}${row.number === i ? "" : ` (number ${i} since the start)`}, from ${clock(row.began)}\n` +
  `horizon ${row.horizon}\n` +
  `${counted(row.searches, "search")}, ${row.interrupted} interrupted: ${lasted(row.solving)}\n` +
  `other commands: ${lasted(row.other)}`;
