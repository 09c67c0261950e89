// The head of the page: the connection, the systems, and what needs attention.

import { isOver, isStale, link, use } from "./connection.js";
import { badge, badgePlace, byId, change, fill, make } from "./dom.js";
import { reason } from "./goals.js";
import { changed, rowsOf, state, stopped, watch, chosen, now } from "./store.js";
import { clock, lasted, plural } from "./words.js";

const NEWS = 60; // seconds that a dropped message needs attention

const LINKS = {
  connecting: ["quiet", "…", () => "connecting"],
  live: ["good", "●", () => (state.hello?.recording ? "recorded" : "live")],
  stale: ["bad", "!", () => `stale: nothing heard for ${silence()}; connecting again`],
  lost: ["bad", "✕", () => `no connection to the console for ${silence()}; what is shown is old; connecting again`],
  refused: ["bad", "✕", () => "the console wants its token"],
  gone: ["bad", "✕", () => `no contact to ${state.chosen} since ${clock(stopped())}; what is shown is how it was`],
  ended: ["bad", "■", () => `${state.chosen} has ended at ${clock(stopped())}; what is shown is how it was`],
};

const silence = () => lasted((performance.now() - (link.heard || link.since)) / 1000);

let shown = "";

/** The state of the link: that to the console, and if that is there, the console's to the chosen run. */
function wordOfLink() {
  if (isStale() || !isOver()) return link.word;
  return rowsOf(chosen(), "run").get("run").state === "ended" ? "ended" : "gone";
}

function drawLink() {
  const word = wordOfLink();
  const [kind, sign, text] = LINKS[word];
  const words = text();
  const what = `${word} ${word === "gone" || word === "ended" ? state.chosen : ""}`;
  if (shown !== what) {
    shown = what; // a reader of the screen is told of changes alone, and not each second
    byId("link").replaceChildren(badge(kind, sign, words));
  } else byId("link").firstChild.lastChild.textContent = ` ${words}`;
  document.body.classList.toggle("stale", isStale());
  byId("content").classList.toggle("over", isOver());
  const form = byId("key");
  const needed = link.word === "refused" || (state.hello && !state.hello.may_ask);
  form.hidden = !needed;
  byId("key-text").textContent =
    link.word === "refused"
      ? "Open the link that console.py has printed, or type the token at its end."
      : "You may look. To act, open the link that console.py has printed, or type the token at its end.";
}

byId("key").addEventListener("submit", (event) => {
  event.preventDefault();
  const field = event.target.elements.token;
  use(field.value.trim());
  field.value = "";
});

/** How a system is, at a glance: a kind of badge, a sign and words. */
function glance(system) {
  const run = rowsOf(system, "run").get("run");
  if (!run?.connected) return ["bad", "✕", run?.since ? `no contact since ${clock(run.since)}` : "no contact yet"];
  if (run.state === "ended") return ["bad", "■", "has ended"];
  const held = [...rowsOf(system, "actuators").values()].filter((row) => row.held);
  if (held.some((row) => row.state === "approval")) return ["warn", "?", "waits for an approval"];
  if (run.paused) return ["warn", "❚❚", "paused"];
  if (held.some((row) => row.state === "hold")) return ["warn", "❚❚", "on hold"];
  if (run.state === "works") return ["good", "↻", "plans"];
  const acts = [...rowsOf(system, "actuators").values()].some((row) => row.state === "acts");
  return acts ? ["good", "▶", "acts"] : ["good", "✓", "waits"];
}

function makeSystem(name) {
  const sign = badgePlace({ class: "glance" });
  const counts = make("small");
  const button = make(
    "button",
    {
      type: "button",
      click: () => {
        state.chosen = name;
        changed();
      },
    },
    make("b", { text: name }),
    sign,
    counts,
  );
  button.draw = () => {
    const system = state.systems.get(name);
    sign.say(...glance(system));
    const run = rowsOf(system, "run").get("run");
    change(counts, { text: run ? `${plural(run.open, "goal")}, step ${run.step} of ${run.horizon}` : "" });
    change(button, { "aria-pressed": String(name === state.chosen) });
  };
  return button;
}

function drawSystems() {
  const nav = byId("systems");
  fill(nav, [...state.systems.keys()].map((name) => [name, name]), makeSystem);
  for (const button of nav.children) button.draw();
}

/** Says that it is unknown whether an action was done, and what follows. */
function doubt(name, { state: how, answer, doubt: action, waits }) {
  const text = `${name} has answered ${answer} to ${action}: it is not known whether that was done.`;
  return how === "lost" ? `${text} It is left out ${waits}.` : text;
}

/** Messages that need the operator's attention, the worst first. */
function warnings() {
  const system = chosen(),
    run = rowsOf(system, "run").get("run"),
    found = [];
  if (!run) return found;
  if (!run.connected) found.push(["bad", "✕", `No contact to ${state.chosen}. What is below is how it was.`]);
  if (run.state === "ended") found.push(["bad", "■", `The planning loop has ended: ${run.reason}`]);
  for (const [name, row] of rowsOf(system, "actuators")) {
    if (row.state === "approval") found.push(["warn", "?", `${name} wants to do ${row.held}: approve or reject it.`]);
    const mean = rowsOf(system, "means").get(name)?.seconds ?? rowsOf(system, "means").get("")?.seconds;
    const since = row.since ? now() - row.since : 0;
    if (row.action && mean && since > Math.max(10, 3 * mean)) {
      found.push(["warn", "!", `${name} has not answered ${row.action} for ${lasted(since)}; the mean is ${lasted(mean)}.`]);
    }
    if (row.answer === "failure" && !row.action) found.push(["warn", "!", `${name} has failed to do ${row.last}.`]);
    if (row.doubt) found.push(["warn", "?", doubt(name, row)]);
  }
  const held = [...rowsOf(system, "actuators")].filter(([, row]) => row.on_hold).map(([name]) => name);
  if (held.length) found.push(["warn", "❚❚", `On hold: ${held.join(", ")}.`]);
  if (run.paused) found.push(["warn", "❚❚", "The run is paused: no action begins."]);
  for (const goal of rowsOf(system, "goals").values()) {
    const because = goal.ended === null && reason(goal);
    if (because) found.push(["warn", "?", `${goal.request}: ${because}`]);
  }
  if (run.dropped && now() - run.dropped.time < NEWS) {
    found.push(["warn", "!", `A message was dropped at ${clock(run.dropped.time)}: ${run.dropped.text}`]);
  }
  if (run.missed) found.push(["warn", "!", `${plural(run.missed, "event")} of the journal did not get here.`]);
  return found;
}

function makeWarning([kind, sign, text]) {
  return make("p", { class: kind }, badge(kind, sign, ""), make("span", { text }));
}

function drawWarnings() {
  const all = warnings();
  if (!all.length && rowsOf(chosen(), "run").size) all.push(["good", "✓", "Nothing needs attention."]);
  // Their words are their keys, without the times in them: they stay, and are not read out again. What two goals with
  // the same request wait for is said once.
  const found = new Map(all.map((one) => [one[2].replace(/\d+(:\d+)* (s|min|h)/g, ""), one]));
  fill(byId("attention"), [...found], makeWarning);
  [...found.values()].forEach((one, i) => change(byId("attention").children[i].lastChild, { text: one[2] }));
}

watch(drawLink);
watch(drawSystems);
watch(drawWarnings);
