// Times and durations in words.

/** The time since a run began, in digits that tell units of seconds apart. */
export function clock(seconds, unit = 0.001) {
  const digits = unit >= 1 ? 0 : Math.min(3, Math.ceil(-Math.log10(unit)));
  const rounded = Math.abs(seconds).toFixed(digits);
  const sign = seconds < 0 && Number(rounded) ? "−" : "";
  if (rounded < 60) return `${sign}${rounded} s`;
  const whole = Math.floor(rounded),
    parts = [Math.floor(whole / 60) % 60, whole % 60];
  if (whole >= 3600) parts.unshift(Math.floor(whole / 3600));
  const text = parts.map((part, i) => (i ? String(part).padStart(2, "0") : part)).join(":");
  return sign + text + (digits ? (rounded - whole).toFixed(digits).slice(1) : "");
}

/** A duration; with a unit of 1, in whole seconds. */
export function lasted(seconds, unit = 0.001) {
  const whole = Math.max(0, Math.round(seconds));
  if (whole >= 60) return `${clock(whole, 1)} ${whole < 3600 ? "min" : "h"}`;
  if (unit >= 1 || seconds <= 0) return `${whole} s`;
  return seconds < 0.9995 ? `${(seconds * 1000).toPrecision(3)} ms` : `${seconds.toFixed(1)} s`;
}
