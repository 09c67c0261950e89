// Plays a recorded run: starts, stops, from any time on, faster or slower.

import { ask } from "./ask.js";
import { mayPlay } from "./connection.js";
import { byId, change, make } from "./dom.js";
import { now, state, watch } from "./store.js";
import { clock } from "./words.js";

const field = byId("position");
let marked = null; // the recording whose holds are marked on the slider
let isHeld = false; // while somebody moves it

const plays = () => Boolean(state.beat?.rate);

function play(isOn, position) {
  ask("play", { plays: isOn, position, speed: Number(byId("speed").value) });
}

byId("player").addEventListener("submit", (event) => event.preventDefault());
byId("play").addEventListener("click", () => {
  const end = state.hello.recording.seconds;
  play(!plays(), !plays() && now() >= end ? 0 : now()); // at the end, it begins again
});
field.addEventListener("input", () => {
  isHeld = true;
  play(plays(), Number(field.value));
});
field.addEventListener("change", () => (isHeld = false));
byId("speed").addEventListener("change", () => play(plays(), now()));

watch(() => {
  const recording = state.hello?.recording;
  byId("player").hidden = !recording;
  if (!recording) return;
  if (marked !== recording) {
    marked = recording;
    field.list.replaceChildren(...recording.holds.map(([value, label]) => make("option", { value, label })));
  }
  const at = Math.min(recording.seconds, now());
  change(byId("play"), { text: plays() ? "❚❚ Stop" : "▶ Play", disabled: !mayPlay() });
  change(field, { max: recording.seconds, disabled: !mayPlay(), "aria-valuetext": clock(at) });
  if (!isHeld) field.value = at;
  const text = `${clock(at)} of ${clock(recording.seconds)}`;
  if (byId("time").textContent !== text) byId("time").textContent = text;
});
