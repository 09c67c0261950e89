// Lanes of bars over time, with an axis above: the time lines of console.py and report.py. A page has a colour for each
// kind of bars: --success is that of success.

import { clear, cut, cutAsDrawn, shape } from "./elements.js";

const AXIS = 18; // height, in pixels
const TICKS = 70; // pixels between two, at least
const NEAR = 46; // pixels: the text of a mark hides those of ticks
const MARK = 3; // width of a bar that begins and ends at once
const NARROW = 2; // width of any other one
const THIN = 4; // pixels: a narrower bar has no border
const NOTED = 14; // pixels: a narrower bar has no notes
const SIGN = 7; // pixels that one needs
const WORDS = 34; // pixels: a narrower bar has its sign alone

// The sign of each kind of bars, so that they differ without colours; planned ones have dashes.
const SIGNS = {};
for (const [sign, ...kinds] of [
  ["✓", "success", "succeeded", "sat"],
  ["✕", "failure", "aborted", "dropped"],
  ["▶", "open"],
  ["⊘", "canceled", "cancel"],
  ["⊖", "recalled"],
  ["⊗", "rejected"],
  ["∅", "unsat"],
  ["…", "unknown"],
  ["•", "answer", "other"],
  ["?", "none"],
  ["✉", "message"],
  ["+", "goal", "queued"],
  ["◆", "start"],
  ["↻", "restart"],
  ["‖", "hold"],
  ["!", "approval"],
  ["≈", "belief"],
  ["⚑", "late"],
]) {
  for (const kind of kinds) SIGNS[kind] = sign;
}

/** Returns the index of the first item for which a test holds; it holds for all after it too. */
export function first(items, test) {
  let low = 0,
    high = items.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (test(items[middle])) high = middle;
    else low = middle + 1;
  }
  return low;
}

/** Returns a round distance of ticks on an axis. */
export function ticks(low, high, most, isTime) {
  const raw = Math.max((high - low) / most, 1e-9),
    power = 10 ** Math.floor(Math.log10(raw));
  const nice = isTime && raw > 5 ? [10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 21600, 86400] : [];
  return [...nice, power, 2 * power, 5 * power, 10 * power].find((n) => n >= raw * 0.999);
}

/** Returns the function from times to pixels; what is outside of the section is at its edge. */
export const scale = (from, to, left, right) => (seconds) =>
  left + ((Math.min(Math.max(seconds, from), to) - from) / (to - from)) * (right - left);

function drawBar(parent, kind, x, y, width, height, look = "") {
  const isSolid = width < THIN;
  const edge = isSolid ? 0 : 0.75; // half of the border
  return shape(parent, "rect", {
    x: x + edge,
    y,
    width: width - 2 * edge,
    height,
    rx: isSolid ? 0 : 3,
    class: `bar ${kind} ${look} ${isSolid ? "solid" : ""}`,
    color: `var(--${kind})`,
  });
}

/** Makes a small bar of a kind, to stand before a word: with its sign, or solid. */
export function sample(kind, isSolid = false) {
  const made = document.createElement("span");
  made.className = "sample";
  const drawing = shape(made, "svg", { class: "drawn", width: 20, height: 16, "aria-hidden": "true" });
  drawBar(drawing, kind, 0.5, 1.5, 19, 13, isSolid ? "solid" : "");
  if (!isSolid) shape(drawing, "text", { x: 10, y: 8.5, class: "middle" }, SIGNS[kind] ?? "");
  return made;
}

function drawLane(drawing, { bars, tell }, y, height, { from, to }, x) {
  let reached = -1,
    drawn = "";
  for (let i = first(bars, (bar) => bar.to >= from); i < bars.length && bars[i].from <= to; i++) {
    const bar = bars[i],
      isMark = bar.from === bar.to,
      a = x(bar.from) - (isMark ? MARK / 2 : 0),
      b = Math.max(x(bar.to), a + (isMark ? MARK : NARROW));
    // Of those on the same pixel one is drawn, but each kind.
    if (b <= reached && bar.kind === drawn) continue;
    reached = Math.ceil(b);
    drawn = bar.kind;
    const middle = bar.begins > bar.from ? Math.min(x(bar.begins), b) : a;
    if (middle > a) drawBar(drawing, bar.kind, a, y + 2, middle - a, height - 4, "waits").tell = () => tell(bar);
    if (b > middle) drawBar(drawing, bar.kind, middle, y + 2, b - middle, height - 4).tell = () => tell(bar);
    const late = bar.due ?? Infinity;
    if (late < bar.to && bar.to >= from) drawBar(drawing, "late", x(late), y + 2, b - x(late), height - 4).tell = () => tell(bar);
    const notes = b - a < NOTED ? [] : (bar.notes ?? []).filter(([at]) => at !== null && at >= from && at <= to);
    for (const [at, note] of notes) shape(drawing, "text", { x: x(at), y: y + 5, class: "middle note" }, note);
    // The text is in the wider part, behind what is noted at its beginning; without room, the sign stands beside the bar.
    const [start, end] = middle - a > b - middle ? [a, middle] : [middle, b],
      left = notes.reduce((best, [at]) => (Math.abs(x(at) - best) < NOTED ? Math.max(best, x(at) + 3) : best), start),
      sign = SIGNS[bar.kind] ?? "",
      write = (at, text, look = "") => text && shape(drawing, "text", { x: at, y: y + height / 2, class: look }, text);
    if (end - left >= WORDS) write(left + 4, cut([sign, bar.text].filter(Boolean).join(" "), end - left - 8));
    else if (end - left >= SIGN) write((left + end) / 2, sign, "middle note");
    else if (x(bars[i + 1]?.from ?? to) - b >= 2 * SIGN) write(b + 2, sign);
  }
}

/**
 * Draws lanes of bars between two times.
 *
 * A lane is { name, bars, tell }; its bars are in order and do not overlap, and tell(bar) says all that is known of one.
 * A bar is { from, to, kind, text }. One with { begins } waits until then, one with { due } is late from then on, and
 * { notes }, such as [[seconds, "×"]], stand on it.
 * A view is { from, to, width, labels, row, clock, marks }: the section, the pixels of all, of names and of the height of a
 * lane, clock(seconds, unit) that makes a text, and lines such as { at, kind, text }.
 */
export function drawLanes(axis, drawing, lanes, view) {
  const { from, to, width, labels, row, clock, marks } = view,
    height = row * Math.max(1, lanes.length),
    x = scale(from, to, labels, width),
    seen = marks.filter(({ at }) => at >= from && at <= to),
    unit = ticks(from, to, (width - labels) / TICKS, true);
  clear(axis, width, AXIS);
  clear(drawing, width, height);
  for (let i = 1; i < lanes.length; i += 2) {
    shape(drawing, "rect", { x: 0, y: i * row, width, height: row, class: "odd" });
  }
  for (let t = Math.ceil(from / unit) * unit; t <= to; t += unit) {
    shape(drawing, "rect", { x: x(t), y: 0, width: 1, height, class: "tick" });
    if (x(t) > width - NEAR / 2 || seen.some(({ at, text }) => text && Math.abs(x(at) - x(t)) < NEAR)) continue;
    shape(axis, "text", { x: x(t), y: AXIS / 2, class: "middle time" }, clock(t, unit));
  }
  lanes.forEach((lane, i) => {
    cutAsDrawn(shape(drawing, "text", { x: labels - 8, y: (i + 0.5) * row, class: "end" }, lane.name), labels - 8);
    drawLane(drawing, lane, i * row, row, view, x);
  });
  for (const { at, kind, text = "" } of seen) {
    shape(drawing, "rect", { x: x(at), y: 0, width: 1.5, height, class: "mark", color: `var(--${kind})` });
    shape(axis, "text", { x: x(at), y: AXIS / 2, class: "middle time" }, text);
  }
}
