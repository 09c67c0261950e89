// The forms for a new request and for a message, with what the encoding knows as completion.

import { order } from "./ask.js";
import { mayActWhenLive, mayControl } from "./connection.js";
import { byId, change, fill, make } from "./dom.js";
import { chosen, rowsOf, watch } from "./store.js";

const makeOption = (value) => make("option", { value });

/**
 * Makes a form work: send(text) has it carried out and returns whether it was taken, words() returns the completions, and
 * the example stands in the field if there are none.
 */
function connect(name, example, words, send) {
  const form = byId(name),
    field = byId(`${name}-text`),
    button = byId(`${name}-send`);
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    const text = field.value.trim();
    if (!text) return field.focus();
    if ((await send(text)) && field.value.trim() === text) {
      form.reset();
      field.focus();
    }
  });
  watch(() => {
    // What is typed is not lost when the link is, for a moment.
    for (const one of form.elements) change(one, { disabled: !mayActWhenLive() });
    change(button, { disabled: !mayControl() });
    const { first = example, all } = words(rowsOf(chosen(), "known").get("known") ?? {});
    change(field, { placeholder: first });
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
