// Who does what, and who waits for what.

import { order } from "./ask.js";
import { mayControl } from "./connection.js";
import { allow, badgePlace, careful, change, fillSection, make } from "./dom.js";
import { chosen, now, rowsOf, watch } from "./store.js";
import { byName, lasted } from "./words.js";

const STATES = {
  acts: ["good", "▶", "acts"],
  stops: ["warn", "■", "stops"],
  approval: ["warn", "?", "wants an approval"],
  hold: ["warn", "❚❚", "on hold"],
  pause: ["warn", "❚❚", "paused"],
  rejected: ["warn", "✕", "rejected"],
  cancel: ["quiet", "…", "waits for a plan"],
  retry: ["warn", "↻", "tries again"],
  others: ["quiet", "…", "waits for others"],
  begins: ["quiet", "…", "begins soon"],
  plan: ["quiet", "↻", "waits for a plan"],
  lost: ["warn", "?", "left out"],
  idle: ["quiet", "○", "has nothing to do"],
};

/** The action of an actuator, or its reason to wait, in a line. */
function does(row) {
  if (row.action) return row.action;
  if (row.held) return `${row.held} ${row.waits}`;
  if (row.next.length) return `${row.next[1]} ${row.waits}`;
  return `waits: ${row.waits}`;
}

function more(row) {
  const parts = [];
  if (row.action && row.since) parts.push(`for ${lasted(now() - row.since)}`);
  if (row.action && typeof row.progress === "number") parts.push(`${Math.round(100 * row.progress)} % done`);
  if (row.action && row.waits) parts.push(row.waits);
  if (row.on_hold && row.state !== "hold") parts.push("is on hold after that");
  if (row.action && row.next.length) parts.push(`then ${row.next[1]} in step ${row.next[0]}`);
  if (row.rejected) parts.push(row.rejected);
  if (row.last) parts.push(`last: ${row.last}, ${row.answer || "no answer"}`);
  return parts.join(" · ");
}

function makeActuator() {
  const name = make("b", { class: "term" }),
    sign = badgePlace(),
    what = make("p", { class: "what" }),
    small = make("small");
  const made = make("li");
  const act = (control, action = "", token = 0) =>
    order("control", { control, actuator: made.key, action, token }, `${control} ${made.key}`);
  const approve = make("button", { type: "button", text: "Approve", click: () => act("approve", made.row.held, made.row.token) });
  const reject = careful("Reject", "Reject it?", () => act("reject", made.row.held, made.row.token));
  const hold = make("button", { type: "button", click: () => act(made.row.on_hold ? "release" : "hold") });
  made.append(
    make("div", { class: "head" }, name, sign, make("span", { class: "buttons" }, approve, reject, hold)),
    what,
    small,
  );
  made.update = (row) => {
    sign.say(...(STATES[row.state] ?? ["quiet", "…", row.state]));
    change(what, { text: does(row) });
    const focused = document.activeElement;
    change(approve, { hidden: !["approval", "rejected"].includes(row.state) });
    change(reject, { hidden: !row.held });
    if ([approve, reject].includes(focused) && focused.hidden) hold.focus();
    change(hold, { text: row.on_hold ? "Release" : "Hold" });
  };
  made.draw = () => {
    change(name, { text: made.key });
    change(small, { text: more(made.row) });
    for (const button of [approve, reject, hold]) allow(button, mayControl());
    change(approve, { "aria-label": `Approve ${made.row.held} of ${made.key}` });
    change(reject, { "aria-label": `Reject ${made.row.held} of ${made.key}` });
    change(hold, { "aria-label": `${made.row.on_hold ? "Release" : "Hold"} ${made.key}` });
  };
  return made;
}

watch(() => {
  const rows = [...rowsOf(chosen(), "actuators")].sort(([a], [b]) => byName(a, b));
  fillSection("actuators", rows, makeActuator);
});
