// Times and durations in words.

import { state } from "./store.js";

export function lasted(seconds) {
  const whole = Math.max(0, Math.round(seconds));
  if (whole < 60) return `${whole} s`;
  const minutes = Math.floor(whole / 60);
  if (minutes < 60) return `${minutes}:${String(whole % 60).padStart(2, "0")} min`;
  return `${Math.floor(minutes / 60)}:${String(minutes % 60).padStart(2, "0")} h`;
}

/** The time of day; of a recorded run, that since its beginning. */
export function clock(seconds) {
  if (state.hello?.recording) return new Date(Math.max(0, seconds) * 1000).toISOString().slice(11, 21);
  return new Date(seconds * 1000).toLocaleTimeString([], { hour12: false });
}

export const plural = (count, word) => `${count} ${word}${count === 1 ? "" : "s"}`;

/** Sorts names, with the numbers in them in order of size. */
export const byName = (a, b) => a.localeCompare(b, undefined, { numeric: true });
