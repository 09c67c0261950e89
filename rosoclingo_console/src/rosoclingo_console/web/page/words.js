// Times and durations in words.

export function lasted(seconds) {
  const whole = Math.max(0, Math.round(seconds));
  if (whole < 60) return `${whole} s`;
  const minutes = Math.floor(whole / 60);
  if (minutes < 60) return `${minutes}:${String(whole % 60).padStart(2, "0")} min`;
  return `${Math.floor(minutes / 60)}:${String(minutes % 60).padStart(2, "0")} h`;
}

export const clock = (seconds) => new Date(seconds * 1000).toLocaleTimeString([], { hour12: false });

export const plural = (count, word) => `${count} ${word}${count === 1 ? "" : "s"}`;

/** Sorts names, with the numbers in them in order of size. */
export const byName = (a, b) => a.localeCompare(b, undefined, { numeric: true });
