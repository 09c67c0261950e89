// Reads the report's data, and says in words what is in it.

import { byId } from "./elements.js";
import { clock, lasted } from "./times.js";

export const DATA = JSON.parse(byId("data").textContent);
export const LEAST = 0.05; // shortest section, in seconds
export const END = Math.max(DATA.until, DATA.began + LEAST); // with what is planned
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

const maybe = (seconds) => (seconds === null ? "" : clock(seconds));
const isPlanned = (action) => action.answer === "planned";
const took = (began, ended) => (began === null || ended === null ? "" : lasted(Math.max(0, ended - began)));

/** By how much a goal was late, or is expected to be, in words; nothing if it is in time. */
function late({ due, ended, expected }) {
  const by = due === null ? 0 : (ended ?? expected ?? DATA.ended) - due;
  return by > 0 ? lasted(by) : "";
}

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
export const FIELDS = {
  goals: [
    ["request", (goal) => goal.name || goal.id, "term"],
    ["information", (goal) => goal.information.join(", ")],
    ["outcome", (goal) => goal.outcome],
    ["reason", (goal) => goal.reason],
    ["came", (goal) => clock(goal.came), "number"],
    ["queued behind", (goal) => goal.behind, "told"],
    ["waited", (goal) => took(goal.came, goal.accepted ?? goal.ended ?? DATA.ended), "number"],
    ["accepted", (goal) => maybe(goal.accepted), "told"],
    ["slot", (goal) => goal.slot, "told"],
    ["asked to be cancelled", (goal) => maybe(goal.cancels), "told"],
    ["ended", (goal) => maybe(goal.ended), "told"],
    ["expected", (goal) => maybe(goal.expected), "told"],
    ["due", (goal) => maybe(goal.due), "told"],
    ["late by", late, "told"],
    ["ran", (goal) => took(goal.accepted, goal.ended ?? DATA.ended), "number"],
    ["steps", (goal) => (goal.ended === null || goal.accepted === null ? "" : goal.steps), "number"],
  ],
  actions: [
    ["actuator", (action) => action.actuator],
    ["action", (action) => action.name],
    ["answer", (action) => action.answer || (action.ended === null ? "none" : "another action came before it")],
    ["took", (action) => took(action.began, action.ended)],
    STEP,
    ["published", (action) => (isPlanned(action) ? "" : clock(action.began))],
    ["begins", (action) => (isPlanned(action) ? clock(action.began) : "")],
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
  holds: [
    ["held", (hold) => hold.name],
    ["from", (hold) => clock(hold.began)],
    ["to", (hold) => maybe(hold.ended)],
    ["took", (hold) => took(hold.began, hold.ended)],
  ],
  beliefs: [
    ["believed", (belief) => belief.name, "term"],
    ["certain", (belief) => (belief.is_certain ? "as far as is known" : "others are as likely")],
    ["from", (belief) => clock(belief.began), "number"],
    ["to", (belief) => maybe(belief.ended), "number"],
    STEP,
    ["speaks for it", (belief) => belief.speaks_for, "term"],
    ["or else", (belief) => belief.others, "term"],
    ["against others", (belief) => belief.speaks_against, "term"],
  ],
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
export const tell = (kind, row) =>
  FIELDS[kind]
    .map(([name, text]) => `${name}: ${text(row)}`)
    .filter((line) => !line.endsWith(": "))
    .join("\n");

export const rowsOf = {};
for (const kind of Object.keys(FIELDS)) {
  const { names, rows } = DATA[kind];
  rowsOf[kind] = rows.map((row) => Object.fromEntries(names.map((name, i) => [name, row[i]])));
}
// The time line shows the same objects.
const KINDS = Object.keys(DATA.colours);
for (const kind of KINDS) document.documentElement.style.setProperty(`--${kind}`, DATA.colours[kind]);
for (const lane of DATA.lanes) {
  lane.tell = (row) => tell(lane.kind, row);
  lane.bars = lane.bars.map(([i, from, to, number]) => {
    const row = Object.assign(rowsOf[lane.kind][i], { from, to, kind: KINDS[number] });
    row.text = row.name; // which goals, actions, holds and beliefs have
    if (lane.kind !== "goals") return row;
    return Object.assign(row, { begins: row.accepted ?? to, notes: [[row.accepted, "▼"], [row.cancels, "×"], [row.due, "⚑"]] });
  });
}
