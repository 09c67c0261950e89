// Answers to why, in a dialog.

import { ask } from "./ask.js";
import { byId } from "./dom.js";

let number = 0;

/** Asks, and shows question and answer; until that comes, what is known already. */
export async function why(question, args, words, known = "") {
  const mine = ++number;
  byId("why-question").textContent = words;
  byId("why-answer").textContent = `${known && `${known}\n\n`}The planner's copy is asked …`;
  const dialog = byId("why");
  if (!dialog.open) dialog.showModal();
  const { text } = await ask("why", { question, arguments: args });
  if (mine === number) byId("why-answer").textContent = text;
}
