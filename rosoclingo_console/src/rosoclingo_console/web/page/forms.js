// The forms for a new request and for a message, with what the encoding knows as completion.

import { order, tell } from "./ask.js";
import { mayActWhenLive, mayControl } from "./connection.js";
import { allow, byId, change, fill, make } from "./dom.js";
import { chosen, rowsOf, state, watch } from "./store.js";

const undecided = new Map(); // goals that were sent from here, with what was typed

const fieldsOf = (form) => [...form.elements].filter((one) => one.name);

function fillIn(form, typed) {
  fieldsOf(form).forEach((one, i) => (one.value = typed[i]));
}

watch(() => {
  for (const [goal, { text, system, restore }] of undecided) {
    const row = rowsOf(state.systems.get(system), "goals").get(goal);
    if (!row || row.status === "pending") continue;
    undecided.delete(goal);
    if (!["rejected", "aborted"].includes(row.status)) continue;
    tell(`Ask for ${text}: ${row.status}: ${row.reason}`, true);
    restore();
  }
});

const makeOption = (value) => make("option", { value });

/**
 * Makes a form work: send(text) has it carried out and returns what became of it, words() returns the completions, and
 * the example stands in the field if there are none. What was typed stays until it is taken.
 */
function connect(name, example, words, send) {
  const form = byId(name),
    field = byId(`${name}-text`),
    button = byId(`${name}-send`);
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    const text = field.value.trim();
    if (!text) return field.focus();
    const typed = fieldsOf(form).map((one) => one.value);
    const { done, goal } = await send(text);
    if (!done || field.value.trim() !== text) return;
    form.reset();
    field.focus();
    // The planner may refuse it later, and then it is there again, unless something else was typed.
    if (goal) undecided.set(goal, { text, system: state.chosen, restore: () => field.value || fillIn(form, typed) });
  });
  let listed = ""; // the completions
  watch(() => {
    // What is typed is not lost when the link is, for a moment.
    for (const one of fieldsOf(form)) change(one, { disabled: !mayActWhenLive() });
    allow(button, mayControl());
    const { first = example, all } = words(rowsOf(chosen(), "known").get("known") ?? {});
    change(field, { placeholder: first });
    const known = all.join("\n");
    if (known === listed) return;
    listed = known;
    fill(field.list, [...new Set(all)].filter(Boolean).sort().map((text) => [text, text]), makeOption);
  });
}

connect(
  "request",
  "bring(1,3)",
  ({ requests = [] }) => {
    const asked = [...rowsOf(chosen(), "goals").values()].filter((goal) => goal.status !== "rejected");
    return { first: requests[0], all: [...requests, ...asked.map((goal) => goal.request)] };
  },
  (request) => {
    const more = byId("request-more").value.trim();
    return order("goal", { request, information: more ? [more] : [] }, `Ask for ${request}`);
  },
);
connect(
  "message",
  "info:blocked(c3,c4)",
  ({ messages = [] }) => ({ first: messages[0], all: messages }),
  (message) => order("message", { message }, `Send ${message}`),
);
