// The section in sight.

let from = DATA.began,
  to = END,
  drawing = false;

function show(a, b) {
  const length = Math.min(Math.max(b - a, LEAST), END - DATA.began);
  from = Math.min(Math.max((a + b - length) / 2, DATA.began), END - length);
  to = from + length;
  redraw();
}

function zoom(factor, around = (from + to) / 2) {
  const length = Math.max((to - from) * factor, LEAST),
    part = (around - from) / (to - from);
  show(around - part * length, around + (1 - part) * length);
}

const move = (part) => show(from + part * (to - from), to + part * (to - from));

function reveal(a, b, text) {
  const length = Math.min(
    to - from,
    Math.max(20 * LEAST, 3 * (b - a), (20 * (END - DATA.began)) / Math.max(20, steps.length)),
  );
  show((a + b - length) / 2, (a + b + length) / 2);
  byId("details").textContent = text;
  byId("overview").scrollIntoView({ block: "nearest" });
}

function redraw() {
  if (drawing) return;
  drawing = true;
  requestAnimationFrame(() => {
    drawing = false;
    drawTimeline();
    drawOverview();
    drawCharts();
    byId("section").textContent = `${clock(from)} to ${clock(to)} of ${clock(END)}`;
  });
}

/** Returns the index of the first item for which a test holds; it holds for all after it too. */
function first(items, test) {
  let low = 0,
    high = items.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (test(items[middle])) high = middle;
    else low = middle + 1;
  }
  return low;
}

function prepare(canvas, width, height) {
  const dots = window.devicePixelRatio || 1;
  const w = Math.round(width * dots),
    h = Math.round(height * dots);
  if (canvas.width !== w || canvas.height !== h) [canvas.width, canvas.height] = [w, h];
  const pen = canvas.getContext("2d");
  pen.setTransform(dots, 0, 0, dots, 0, 0);
  pen.clearRect(0, 0, width, height);
  pen.font = `12px ${getComputedStyle(document.body).fontFamily}`;
  pen.textBaseline = "middle";
  return pen;
}

/** Returns a round distance of ticks on an axis. */
function ticks(low, high, most) {
  const raw = Math.max((high - low) / most, 1e-9),
    power = 10 ** Math.floor(Math.log10(raw));
  return [1, 2, 5, 10].map((n) => n * power).find((n) => n >= raw * 0.999);
}

function timeTicks(low, high, most) {
  const raw = (high - low) / most;
  return (
    (raw > 5 && [10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 21600, 86400].find((s) => s >= raw)) ||
    ticks(low, high, most)
  );
}

/** Shortens a text until it fits. */
function fit(pen, text, width) {
  if (pen.measureText(text).width <= width) return text;
  let count = Math.floor((text.length * width) / pen.measureText(text).width);
  while (count > 1 && pen.measureText(`${text.slice(0, count)}…`).width > width) count--;
  return count > 1 ? `${text.slice(0, count)}…` : "";
}
