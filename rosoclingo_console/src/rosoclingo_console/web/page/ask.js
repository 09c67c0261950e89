// Requests of the operator.

import { link } from "./connection.js";
import { byId } from "./dom.js";
import { state } from "./store.js";

const SECONDS = 75; // more than the console takes for any of them

/** Says something to the operator, also to one who does not see it. */
export function tell(text, isBad = false) {
  const said = byId("said");
  said.textContent = text;
  said.className = isBad ? "bad" : "";
  clearTimeout(said.timer);
  said.timer = setTimeout(() => (said.textContent = ""), isBad ? 15000 : 6000);
}

/** Has a request carried out, and returns what became of it. */
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

/** Likewise, and says it. */
export async function order(kind, fields, what) {
  tell(`${what} …`);
  const { done, text } = await ask(kind, fields);
  tell(`${what}: ${text}`, !done);
  return done;
}
