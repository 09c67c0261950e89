// The tail of the journal, with a filter.

import { byId, empty, fill, make } from "./dom.js";
import { chosen, state, watch } from "./store.js";
import { clock } from "./words.js";

const KINDS = [
  ["goal", true],
  ["action", true],
  ["message", true],
  ["plan", true],
  ["belief", true],
  ["operator", true],
  ["why", true],
  ["node", true],
  ["command", false],
  ["other", true],
];
const LEAST = 8; // pixels from the end at which it still follows

const boxes = new Map();
for (const [kind, isOn] of KINDS) {
  const box = make("input", { type: "checkbox" });
  box.checked = isOn;
  box.addEventListener("change", () => (drawn = ""));
  boxes.set(kind, box);
  byId("kinds").append(make("label", {}, box, ` ${kind}`));
}
byId("filter").addEventListener("input", () => (drawn = ""));

const list = byId("lines");
const follow = byId("follow");
let follows = true;
let drawn = "";
let shown = null; // the system whose lines these are

function setFollows(value) {
  follows = value;
  follow.setAttribute("aria-pressed", String(value));
  if (value) list.scrollTop = list.scrollHeight;
}
follow.addEventListener("click", () => setFollows(!follows));
list.addEventListener("scroll", () => {
  const isAtEnd = list.scrollHeight - list.scrollTop - list.clientHeight < LEAST;
  if (follows !== isAtEnd) {
    follows = isAtEnd;
    follow.setAttribute("aria-pressed", String(isAtEnd));
  }
});

const offset = (row) => row.getBoundingClientRect().top - list.getBoundingClientRect().top;

/** Where a reader is: the first line that is seen, and how far it is below the list's edge. */
function readingAt() {
  const row = [...list.children].find((one) => offset(one) + one.offsetHeight > 0);
  return row && { number: row.row.number, below: offset(row) };
}

/** Goes back there, or to the line after it if that one is gone. */
function readOn({ number, below }) {
  const row = [...list.children].find((one) => one.row.number >= number);
  if (row) list.scrollTop += offset(row) - below;
}

function makeLine(line) {
  return make(
    "li",
    { class: line.kind },
    make("time", { text: clock(line.time) }),
    make("span", { class: "kind", text: line.kind }),
    make("span", { class: "text", text: line.text }),
  );
}

watch(() => {
  const system = chosen();
  const last = system?.lines[system.lines.length - 1]?.number ?? 0;
  const which = `${state.chosen} ${system?.count}`;
  const what = `${which} ${last}`;
  if (drawn === what) return;
  const reading = !follows && shown === state.chosen ? readingAt() : null;
  if (!drawn.startsWith(`${which} `)) empty(list);
  drawn = what;
  shown = state.chosen;
  const word = byId("filter").value.toLowerCase();
  const rows = (system?.lines ?? [])
    .filter((line) => boxes.get(line.kind)?.checked && (!word || line.text.toLowerCase().includes(word)))
    .map((line) => [line.number, line]);
  fill(list, rows, makeLine);
  list.classList.toggle("none", !rows.length);
  if (follows) list.scrollTop = list.scrollHeight;
  else if (reading) readOn(reading);
});
