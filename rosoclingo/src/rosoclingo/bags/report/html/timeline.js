// The time line, the strip with the whole recording above it, and the charts below.

import { byId, clear, make, shape } from "./elements.js";
import { DATA, END, LEAST, rowsOf } from "./data.js";
import { drawLanes, first, sample, scale, ticks } from "./lanes.js";
import { clock } from "./times.js";

const ROW = 20,
  LABELS = 108,
  CHART = 190,
  LEFT = 48; // heights and widths, in pixels
const RESTARTS = rowsOf.restarts.map(({ seconds }) => ({ at: seconds, kind: "restart" }));
const scroller = byId("scroller"),
  timeline = byId("timeline"),
  overview = byId("overview");
let from = DATA.began,
  to = END,
  isWaiting = false;

function show(a, b) {
  const length = Math.min(Math.max(b - a, LEAST), END - DATA.began);
  from = Math.min(Math.max((a + b - length) / 2, DATA.began), END - length);
  to = from + length;
  redraw();
}

function zoom(factor, around = (from + to) / 2) {
  show(around - (around - from) * factor, around + (to - around) * factor);
}

const move = (part) => show(from + part * (to - from), to + part * (to - from));

export function reveal(a, b, text) {
  const least = (20 * (END - DATA.began)) / Math.max(20, DATA.steps.length);
  const half = Math.min(to - from, Math.max(20 * LEAST, 3 * (b - a), least)) / 2;
  show((a + b) / 2 - half, (a + b) / 2 + half);
  byId("details").textContent = text;
  overview.scrollIntoView({ block: "nearest" });
}

function redraw() {
  if (isWaiting) return;
  isWaiting = true;
  requestAnimationFrame(() => {
    isWaiting = false;
    drawTimeline();
    drawOverview();
    drawCharts();
    byId("section").textContent = `${clock(from)} to ${clock(to)} of ${clock(END)}`;
  });
}

const bar = (parent, x, y, width, height, fill, more) =>
  shape(parent, "rect", { x, y, width: Math.max(width, 0), height: Math.max(height, 0), fill, ...more });

function drawTimeline() {
  const view = { from, to, width: scroller.clientWidth, labels: LABELS, row: ROW, clock, marks: RESTARTS };
  drawLanes(byId("axis"), timeline, DATA.lanes, view);
}

function drawOverview() {
  const width = scroller.clientWidth,
    height = 38,
    counts = [],
    x = scale(DATA.began, END, LABELS, width);
  clear(overview, width, height);
  bar(overview, LABELS, 0, width, height, "var(--back)");
  shape(overview, "text", { x: LABELS - 8, y: height / 2, class: "end" }, "all actions");
  for (const { from, kind } of rowsOf.actions) {
    const count = (counts[Math.floor(x(from))] ??= { all: 0, failed: 0 });
    count.all++;
    count.failed += kind === "failure";
  }
  const most = counts.reduce((best, { all }) => Math.max(best, all), 1);
  counts.forEach(({ all, failed }, i) => {
    const tall = 6 + ((height - 14) * all) / most;
    bar(overview, i, height - tall, 1, tall, "var(--success)");
    if (failed) bar(overview, i, 0, 1.5, 7, "var(--failure)");
  });
  bar(overview, LABELS, 0, x(from) - LABELS, height, "#fffa");
  bar(overview, x(to), 0, width - x(to), height, "#fffa");
  bar(overview, x(from), 0.5, Math.max(x(to) - x(from) - 1, 3), height - 1, "none", { stroke: "var(--open)" });
}

// The charts.

const figures = DATA.charts.map(({ title, series }) => {
  const caption = make("figcaption", { text: `${title}: ` });
  for (const [name, tint] of series) caption.append(make("span", {}, sample(tint, true), name));
  const figure = make("figure", {}, caption);
  byId("charts").append(figure);
  return shape(figure, "svg", { class: "drawn" });
});

function tellStep(i) {
  const lines = DATA.charts.map(({ title, is_stacked, series }) => {
    const value = (j) => series[j][2][i] - (is_stacked && j + 1 < series.length ? series[j + 1][2][i] : 0);
    return `${title}: ${series.map(([name], j) => `${name} ${+value(j).toPrecision(3)}`).join(", ")}`;
  });
  return [`number ${i} since the start, from ${clock(DATA.steps[i])}`, ...lines].join("\n");
}

function drawCharts() {
  const low = Math.max(0, first(DATA.steps, (began) => began > from) - 1),
    high = Math.max(low, first(DATA.steps, (began) => began > to) - 1),
    number = high - low + 1;
  DATA.charts.forEach(({ is_stacked, series }, index) => {
    const drawing = figures[index],
      width = byId("charts").firstChild.clientWidth,
      count = DATA.steps.length && Math.max(1, Math.min(number, Math.floor(width - LEFT)));
    clear(drawing, width, CHART);
    // A column for each step, or for each pixel: the largest of its steps.
    const columns = Array.from({ length: count }, (_, i) => {
      const a = low + Math.floor((i * number) / count),
        b = Math.max(a + 1, low + Math.floor(((i + 1) * number) / count));
      const height = (j) => Math.max(...series.map(([, , values]) => values[j]));
      let best = a;
      for (let j = a; j < b; j++) if (height(j) > height(best)) best = j;
      return best;
    });
    const seen = columns.flatMap((i) => series.map(([, , values]) => values[i])),
      largest = seen.reduce((a, b) => Math.max(a, b), 0),
      smallest = is_stacked ? 0 : seen.reduce((a, b) => Math.min(a, b), largest);
    const unit = ticks(smallest, largest || 1, 4),
      bottom = Math.floor(smallest / unit) * unit,
      top = Math.max(Math.ceil(largest / unit) * unit, bottom + unit);
    const y = (value) => 8 + (CHART - 28) * (1 - (value - bottom) / (top - bottom)),
      wide = (width - LEFT) / Math.max(1, count);
    for (let value = bottom; value <= top + unit / 2; value += unit) {
      bar(drawing, LEFT, y(value), width - LEFT, 1, "var(--line)");
      shape(drawing, "text", { x: LEFT - 6, y: y(value), class: "end" }, Number(value.toPrecision(6)));
    }
    const every = Math.max(1, Math.ceil(ticks(low, high + 1, width / 70)));
    for (let i = Math.ceil(low / every) * every; i <= high; i += every) {
      const x = LEFT + ((i - low + 0.5) / number) * (width - LEFT);
      shape(drawing, "text", { x, y: CHART - 9, class: "middle" }, i);
    }
    for (const [, tint, values] of series) {
      columns.forEach((step, i) => {
        if (is_stacked) bar(drawing, LEFT + i * wide, y(values[step]), wide * 0.8, y(0) - y(values[step]), `var(--${tint})`);
      });
      const path = columns.map((step, i) => `${i ? "L" : "M"}${LEFT + i * wide} ${y(values[step])}h${wide}`).join("");
      if (!is_stacked) shape(drawing, "path", { d: path, fill: "none", stroke: `var(--${tint})`, "stroke-width": 2 });
    }
    columns.forEach((step, i) => {
      const column = bar(drawing, LEFT + i * wide, 8, wide, CHART - 28, "transparent");
      column.tell = () => tellStep(step);
      column.onclick = () => reveal(DATA.steps[step], DATA.steps[step + 1] ?? END, tellStep(step));
    });
  });
}

// What the mouse and the keys do.

const RARE = {
  restart: RESTARTS,
  hold: rowsOf.holds,
  approval: rowsOf.holds,
  belief: rowsOf.beliefs,
  late: rowsOf.goals.filter(({ due }) => due !== null),
  planned: rowsOf.actions.filter(({ kind }) => kind === "planned"),
};
for (const [kind, words] of Object.entries(DATA.legend)) {
  const names = Object.keys(words).filter((name) => !RARE[name] || RARE[name].length);
  const samples = names.map((name) => make("span", {}, sample(name), words[name]));
  if (names.length) byId("legend").append(make("span", { class: "legend" }, `${kind}:`, ...samples));
}

const secondsAt = (event, a, b) => {
  const part = (event.clientX - overview.getBoundingClientRect().left - LABELS) / (scroller.clientWidth - LABELS);
  return a + Math.min(Math.max(part, 0), 1) * (b - a);
};

/** Calls back while the mouse is dragged, with how far, and when it was only clicked. */
function onDrag(drawing, dragged, clicked) {
  let start = null;
  drawing.addEventListener("pointerdown", (event) => {
    start = { x: event.clientX, event, target: event.target, from, to, isMoved: false };
    drawing.setPointerCapture(event.pointerId);
  });
  drawing.addEventListener("pointermove", (event) => {
    if (start && (start.isMoved ||= Math.abs(event.clientX - start.x) > 3)) dragged(start, event);
  });
  drawing.addEventListener("pointerup", () => {
    if (start && !start.isMoved) clicked(start);
    start = null;
  });
  drawing.addEventListener("pointercancel", () => (start = null));
}
onDrag(
  timeline,
  (start, event) => {
    const shift = secondsAt(start.event, start.from, start.to) - secondsAt(event, start.from, start.to);
    show(start.from + shift, start.to + shift);
  },
  ({ target }) => target.tell && (byId("details").textContent = target.tell()),
);
onDrag(
  overview,
  (start, event) => {
    const ends = [start.event, event].map((one) => secondsAt(one, DATA.began, END));
    show(Math.min(...ends), Math.max(...ends));
  },
  ({ event }) => {
    const middle = secondsAt(event, DATA.began, END);
    show(middle - (to - from) / 2, middle + (to - from) / 2);
  },
);
timeline.addEventListener(
  "wheel",
  (event) => {
    if (event.ctrlKey || event.metaKey) zoom(1.0018 ** event.deltaY, secondsAt(event, from, to));
    else if (event.deltaX) move(event.deltaX / scroller.clientWidth);
    else return;
    event.preventDefault();
  },
  { passive: false },
);
const DOES = {
  in: () => zoom(0.5),
  out: () => zoom(2),
  all: () => show(DATA.began, END),
  left: () => move(-0.5),
  right: () => move(0.5),
};
const KEYS = { "+": "in", "=": "in", "-": "out", 0: "all", ArrowLeft: "left", ArrowRight: "right" };
for (const id in DOES) byId(id).onclick = DOES[id];
scroller.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || !KEYS[event.key]) return;
  DOES[KEYS[event.key]]();
  event.preventDefault();
});
window.addEventListener("resize", redraw);
redraw();
