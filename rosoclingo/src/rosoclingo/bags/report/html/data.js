// Reads the report's data. Texts of the bag get into the page by textContent alone.

const DATA = JSON.parse(document.getElementById("data").textContent);
const LEAST = 0.05; // shortest section, in seconds
const END = Math.max(DATA.ended, DATA.began + LEAST);
const MOST_CAUSES = 4; // that are named of one plan change
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

const byId = (id) => document.getElementById(id);
const colour = (name) => DATA.colours[name];

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

const maybe = (seconds) => (seconds === null ? "" : clock(seconds));
const took = (began, ended) => (began === null || ended === null ? "" : lasted(Math.max(0, ended - began)));

function causesOf(change) {
  const texts = change.causes.map(([kind, text]) => (text ? `${CAUSES[kind]} ${text}` : CAUSES[kind]));
  const more = texts.length > MOST_CAUSES ? `; and ${texts.length - MOST_CAUSES} more` : "";
  return texts.slice(0, MOST_CAUSES).join("; ") + more;
}

// The fields of each kind: name, text, and the class of a table's cells; "told" ones are in no table.
const AT = ["at", (row) => clock(row.seconds), "number"],
  STEP = ["step", (row) => row.step, "number"],
  HORIZON = ["horizon", (row) => row.horizon, "number"],
  TOOK = ["took", (row) => lasted(row.duration), "number"];
const FIELDS = {
  goals: [
    ["request", (goal) => goal.name || goal.id, "term"],
    ["information", (goal) => goal.information.join(", ")],
    ["outcome", (goal) => goal.outcome],
    ["reason", (goal) => goal.reason],
    ["came", (goal) => clock(goal.came), "number"],
    ["queued behind", (goal) => goal.behind, "told"],
    ["waited", (goal) => took(goal.came, goal.accepted ?? goal.ended ?? END), "number"],
    ["accepted", (goal) => maybe(goal.accepted), "told"],
    ["slot", (goal) => goal.slot, "told"],
    ["asked to be cancelled", (goal) => maybe(goal.cancels), "told"],
    ["ended", (goal) => maybe(goal.ended), "told"],
    ["ran", (goal) => took(goal.accepted, goal.ended ?? END), "number"],
    ["steps", (goal) => (goal.ended === null || goal.accepted === null ? "" : goal.steps), "number"],
  ],
  actions: [
    ["actuator", (action) => action.actuator],
    ["action", (action) => action.name],
    ["answer", (action) => action.answer || (action.ended === null ? "none" : "another action came before it")],
    ["took", (action) => took(action.began, action.ended)],
    STEP,
    ["published", (action) => clock(action.began)],
  ],
  messages: [
    AT,
    STEP,
    ["id", (message) => message.id, "term"],
    ["value", (message) => message.value, "term"],
    ["dropped", (message) => message.dropped],
  ],
  changes: [
    AT,
    STEP,
    ["what came before", causesOf],
    ["actions left", (change) => `${change.old} → ${change.new}`, "number"],
    HORIZON,
    ["first changed", (change) => `step ${change.first}`],
    ["was", (change) => change.before.join(", "), "term"],
    ["is", (change) => change.after.join(", "), "term"],
  ],
  searches: [["result", (search) => (search.result === "unknown" ? "interrupted" : search.result)], TOOK, STEP, HORIZON],
  answers: [AT, STEP, ["question", (answer) => answer.question, "term"], ["answer", (answer) => answer.text], TOOK],
  restarts: [
    AT,
    STEP,
    ["node", (restart) => restart.node, "term"],
    ["lost with", (restart) => restart.reason],
    ["last event before", (restart) => clock(restart.last), "number"],
    TOOK,
  ],
};

/** Says all that is known of a row of a kind. */
const tell = (kind, row) =>
  FIELDS[kind]
    .map(([name, text]) => `${name}: ${text(row)}`)
    .filter((line) => !line.endsWith(": "))
    .join("\n");

const rowsOf = {};
for (const kind of Object.keys(FIELDS)) {
  const { names, rows } = DATA[kind];
  rowsOf[kind] = rows.map((row) => Object.fromEntries(names.map((name, i) => [name, row[i]])));
}
// The time line shows the same objects; of those on one lane, none overlap.
const NAMES = Object.keys(DATA.colours);
for (const lane of DATA.lanes) {
  lane.bars = lane.bars.map(([i, from, to, number]) =>
    Object.assign(rowsOf[lane.kind][i], { from, to, colour: NAMES[number] }),
  );
}
