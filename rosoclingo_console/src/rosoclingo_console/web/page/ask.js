// Requests of the operator.

import { link } from "./connection.js";
import { byId } from "./dom.js";
import { state } from "./store.js";

const SECONDS = 75; // more than the console takes for any of them

/** Says something to the operator, also to one who does not see it; with 0 ms until something else is said. */
export function tell(text, isBad = false, ms = isBad ? 15000 : 6000) {
  const said = byId("said");
  said.textContent = text;
  said.className = isBad ? "bad" : "";
  clearTimeout(said.timer);
  if (ms) said.timer = setTimeout(() => (said.textContent = ""), ms);
}

/** Has a request carried out, and returns what became of it: { done, text }, and { goal } of a goal that was sent. */
export async function ask(kind, fields, system = state.chosen) {
  try {
    const response = await fetch(`/do/${kind}`, {
      method: "POST",
      headers: { "Content-Type": "application/json", Authorization: `Bearer ${link.token}` },
      body: JSON.stringify({ system, ...fields }),
      signal: AbortSignal.timeout(SECONDS * 1000),
    });
    return await response.json();
  } catch {
    return { done: false, text: "no answer from the console; is it still running?" };
  }
}

/** Has a request carried out, says what became of it, and returns that. */
export async function order(kind, fields, what) {
  tell(`${what} …`, false, 0);
  const outcome = await ask(kind, fields);
  tell(`${what}: ${outcome.text}`, !outcome.done);
  return outcome;
}
