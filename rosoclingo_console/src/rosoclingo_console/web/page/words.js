// Times and durations in words.

import { state } from "./store.js";
import { clock as sinceBegin, lasted as exactly } from "./times.js";

export const lasted = (seconds) => exactly(seconds, 1);

/** The time of day; of a recorded run, that since its beginning. */
export function clock(seconds, unit = 0.1) {
  if (state.hello?.recording) return sinceBegin(seconds, unit);
  return new Date(seconds * 1000).toLocaleTimeString([], { hour12: false });
}

export const plural = (count, word) => `${count} ${word}${count === 1 ? "" : "s"}`;

/** Sorts names, with the numbers in them in order of size. */
export const byName = (a, b) => a.localeCompare(b, undefined, { numeric: true });
