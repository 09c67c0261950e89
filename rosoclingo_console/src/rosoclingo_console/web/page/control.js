// The state of the run, and what an operator may do with it.

import { order } from "./ask.js";
import { mayAct, mayControl } from "./connection.js";
import { allow, byId, change, make } from "./dom.js";
import { chosen, rowsOf, state, watch } from "./store.js";

const STATES = {
  unknown: "nothing is known yet",
  works: "decides or plans",
  acts: "waits for answers",
  asks: "waits for an operator",
  waits: "idle",
  ended: "has ended",
};
const BUTTONS = [
  ["pause", "❚❚", "Pause", "No action begins any more; those under way go on"],
  ["step", "▶❚", "Step", "The next actions begin, and no others"],
  ["resume", "▶", "Resume", "Actions begin again"],
  ["halt", "■", "Halt", "Pause, and stop what is under way"],
];

const buttons = new Map(
  BUTTONS.map(([control, sign, text, title]) => [
    control,
    make(
      "button",
      { type: "button", title, class: control, click: () => order("control", { control }, text) },
      make("span", { "aria-hidden": "true", text: sign }),
      ` ${text}`,
    ),
  ]),
);
const record = make("button", {
  type: "button",
  class: "record",
  click: () => {
    const isOn = Boolean(rowsOf(chosen(), "run").get("run")?.recording);
    order("record", { on: !isOn }, isOn ? "Stop recording" : "Record");
  },
});
byId("buttons").append(...buttons.values(), record);

const facts = new Map(
  ["State", "Step", "Goals", "Cost of the plan", "Recording"].map((name) => [name, make("span")]),
);
byId("run").append(
  make("ul", {}, ...[...facts].map(([name, value]) => make("li", {}, make("small", { text: name }), value))),
);

/** What a loop waits for. */
function reason(actuators) {
  if (actuators.some((row) => row.action)) return "acts";
  return actuators.some((row) => row.held && row.state !== "retry") ? "asks" : "waits";
}

watch(() => {
  const run = rowsOf(chosen(), "run").get("run");
  for (const [control, button] of buttons) {
    const isUseful = control === "resume" ? run?.paused : control !== "pause" || !run?.paused;
    allow(button, mayControl() && isUseful);
  }
  const hint = state.hello?.read_only ? " (this console is read-only)" : "";
  const actuators = [...rowsOf(chosen(), "actuators").values()];
  const how = run?.state === "waits" ? reason(actuators) : run?.state;
  const words = run ? (run.paused ? "paused, " : "") + STATES[how] + (run.reason ? `: ${run.reason}` : "") : "";
  change(facts.get("State"), { text: words + hint });
  change(facts.get("Step"), { text: run ? `${run.step}, planned up to ${run.horizon}` : "" });
  change(facts.get("Goals"), { text: run ? `${run.open} open, ${run.waiting} of them wait for a slot` : "" });
  const cost = facts.get("Cost of the plan");
  change(cost, { text: run?.quality ?? "" });
  cost.parentElement.hidden = !run?.quality;
  allow(record, mayAct());
  change(record, { text: run?.recording ? "■ Stop recording" : "● Record" });
  change(record, { title: run?.recording ? "End the bag" : "Record the run from now on in a bag" });
  change(facts.get("Recording"), { text: run?.recording ?? "" });
  facts.get("Recording").parentElement.hidden = !run?.recording;
});
