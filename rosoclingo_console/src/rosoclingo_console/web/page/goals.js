// The goals.

import { order } from "./ask.js";
import { mayAsk, mayControl } from "./connection.js";
import { allow, badgePlace, careful, change, fillSection, make } from "./dom.js";
import { chosen, now, rowsOf, state, watch } from "./store.js";
import { why } from "./why.js";
import { clock, lasted } from "./words.js";

const STATUSES = {
  pending: ["quiet", "…", "waits"],
  accepted: ["good", "▶", "accepted"],
  succeeded: ["good", "✓", "succeeded"],
  canceled: ["quiet", "⊘", "cancelled"],
  rejected: ["bad", "✕", "rejected"],
  aborted: ["bad", "✕", "aborted"],
};

/** What an actuator does whose action an operator is to let go. */
const HELD = { hold: "on hold", approval: "asks for an approval" };

/** Says of a duration if a simulator's clock measures it; all others are of wall time. */
const ofClock = () => (state.beat && state.beat.ros !== state.beat.now ? " of simulated time" : "");

function expected(goal) {
  if (goal.expected === null || !state.beat) return "";
  const left = goal.expected - state.beat.ros;
  return left > 0 ? `expected in ${lasted(left)}${ofClock()}` : "expected now";
}

/** Says whose planned actions wait until an operator releases or approves them. */
function onHold() {
  const held = [...rowsOf(chosen(), "actuators")].filter(([, row]) => row.held && row.state in HELD);
  const names = held.map(([name, row]) => `${name} ${HELD[row.state]}`).sort().join(", ");
  return names && `waits for an operator: ${names}`;
}

/** Details of a goal, in short parts. */
function facts(goal) {
  const parts = [goal.information.join(", ")];
  if (goal.ended === null) {
    parts.push(goal.slot && `slot ${goal.slot}`);
    parts.push(!goal.slot && goal.place && `place ${goal.place} in the queue`);
    parts.push(goal.canceling && "is to be cancelled");
    parts.push(expected(goal), goal.late && goal.late !== "0 s" && `late by ${goal.late}${ofClock()}`);
    parts.push(goal.slot && onHold(), goal.line, goal.came && `for ${lasted(now() - goal.came)}`);
  } else {
    parts.push(goal.came && `took ${lasted(goal.ended - goal.came)}`, `ended at ${clock(goal.ended)}`);
    parts.push(["rejected", "aborted"].includes(goal.status) && goal.reason);
  }
  return parts.filter(Boolean).join(" · ");
}

/** Why a goal waits or has no plan; without a reason, what can be done. */
export function reason({ why, unexplained }) {
  const fact = unexplained ? why.replace(/: looking for the reason$/, "") : why;
  return [fact, unexplained && `No reason found yet: ${unexplained}. Why? looks for it again.`].filter(Boolean).join(". ");
}

/** What is known of the reason why a goal waits, without asking. */
const known = (goal) => reason(goal) || onHold() || goal.line || "";

function makeGoal() {
  const name = make("b", { class: "term" }),
    sign = badgePlace(),
    more = make("small"),
    shown = make("p", { class: "reason" });
  const made = make("li");
  const ask = make("button", {
    type: "button",
    text: "Why?",
    click: () => {
      const words = `Why does ${made.row.request} wait or fail?`;
      why("goal", [made.row.slot || made.row.request], words, known(made.row));
    },
  });
  const cancel = careful("Cancel", "Cancel it?", () => order("cancel", { goal: made.key }, `Cancel ${made.row.request}`));
  made.append(make("div", { class: "head" }, name, sign, make("span", { class: "buttons" }, ask, cancel)), more, shown);
  made.update = (goal) => {
    change(name, { text: goal.request || "(a goal from before)" });
    sign.say(...STATUSES[goal.status]);
    const because = goal.ended === null ? reason(goal) : "";
    change(shown, { text: because, hidden: !because });
    change(made, { class: goal.ended === null ? "open" : "over" });
    change(ask, { "aria-label": `Why ${goal.request}?`, hidden: goal.ended !== null });
    change(cancel, { "aria-label": `Cancel ${goal.request}`, hidden: goal.ended !== null });
  };
  made.draw = () => {
    change(more, { text: facts(made.row) });
    allow(ask, mayAsk());
    allow(cancel, mayControl() && !made.row.canceling);
  };
  return made;
}

/** Open goals first, in their order; then those that have ended, the last one first. */
function byTime(a, b) {
  const over = (goal) => goal.ended !== null;
  if (over(a) !== over(b)) return over(a) ? 1 : -1;
  return over(a) ? b.ended - a.ended || b.number - a.number : a.number - b.number;
}

watch(() => {
  const goals = [...rowsOf(chosen(), "goals")].sort(([, a], [, b]) => byTime(a, b));
  fillSection("goals", goals, makeGoal);
});
