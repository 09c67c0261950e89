// The charts over the steps.

const LEFT = 48,
  BOTTOM = 20,
  CHART = 190;
const CHARTS = [
  {
    id: "horizon",
    title: "steps",
    parts: [
      ["horizon", "accent"],
      ["number", "canceled"],
    ],
    lines: true,
    unit: "",
    names: ["horizon", "current step"],
  },
  {
    id: "solving",
    title: "ms in a step",
    parts: [
      ["solving", "accent"],
      ["other", "recalled"],
    ],
    factor: 1000,
    names: ["searching", "other commands"],
  },
  {
    id: "searches",
    title: "searches in a step",
    parts: [
      ["searches", "accent"],
      ["interrupted", "unknown"],
    ],
    whole: true,
    names: ["ended", "interrupted"],
  },
];

/** Returns the steps in sight: their first and last number. */
function stepsInSight() {
  const low = Math.max(0, first(steps, (row) => row.began > from) - 1);
  const high = Math.max(low, first(steps, (row) => row.began > to) - 1);
  return [low, high];
}

/** Returns the heights of a chart's two parts, one on the other if they are no lines. */
function heights(chart, row) {
  const [a, b] = chart.parts.map(([name]) => row[name] * (chart.factor ?? 1));
  if (chart.lines) return [a, b];
  return chart.whole ? [a - b, a] : [a, a + b];
}

function drawCharts() {
  const [low, high] = stepsInSight();
  for (const chart of CHARTS) {
    const canvas = byId(chart.id),
      width = canvas.clientWidth,
      pen = prepare(canvas, width, CHART);
    const wide = (width - LEFT) / (high - low + 1),
      tall = CHART - BOTTOM - 8;
    // A column for each step, or for each pixel the largest and smallest of its steps.
    const count = Math.min(high - low + 1, Math.max(1, Math.floor(width - LEFT)));
    const columns = Array.from({ length: steps.length ? count : 0 }, (_, i) => {
      const a = low + Math.floor((i * (high - low + 1)) / count);
      const b = Math.max(a + 1, low + Math.floor(((i + 1) * (high - low + 1)) / count));
      return steps
        .slice(a, b)
        .map((row) => heights(chart, row))
        .reduce((best, next) => (Math.max(...next) > Math.max(...best) ? next : best));
    });
    const largest = columns.reduce((best, pair) => Math.max(best, ...pair), 0);
    const smallest = chart.lines ? columns.reduce((best, pair) => Math.min(best, ...pair), largest) : 0;
    const unit = Math.max(ticks(smallest, largest || 1, 4), chart.factor ? 0 : 1);
    const bottom = Math.floor(smallest / unit) * unit;
    const top = Math.max(Math.ceil(largest / unit) * unit, bottom + unit);
    const y = (value) => 8 + tall * (1 - (value - bottom) / (top - bottom));
    pen.textAlign = "right";
    for (let value = bottom; value <= top + unit / 2; value += unit) {
      pen.fillStyle = colour("line");
      pen.fillRect(LEFT, Math.round(y(value)), width - LEFT, 1);
      pen.fillStyle = colour("quiet");
      pen.fillText(Number(value.toPrecision(6)), LEFT - 6, y(value));
    }
    const step = Math.max(1, Math.ceil(ticks(low, high + 1, width / 70)));
    pen.textAlign = "center";
    for (let i = Math.ceil(low / step) * step; i <= high; i += step) {
      pen.fillText(i, Math.min(LEFT + (i - low + 0.5) * wide, width - pen.measureText(i).width / 2), CHART - 9);
    }
    const column = (width - LEFT) / Math.max(1, columns.length);
    if (chart.lines) drawLines(pen, chart, columns, column, y);
    else {
      const slim = column > 4 ? Math.min(column * 0.2, 6) : 0;
      columns.forEach(([one, both], i) => {
        const x = LEFT + i * column + slim / 2;
        pen.fillStyle = colour(chart.parts[1][1]);
        pen.fillRect(x, y(both), column - slim, y(one) - y(both));
        pen.fillStyle = colour(chart.parts[0][1]);
        pen.fillRect(x, y(one), column - slim, y(0) - y(one));
      });
    }
  }
}

function drawLines(pen, chart, columns, column, y) {
  chart.parts.forEach(([, name], part) => {
    pen.strokeStyle = colour(name);
    pen.lineWidth = part ? 1.2 : 2;
    pen.beginPath();
    columns.forEach((pair, i) => {
      pen.lineTo(LEFT + i * column, y(pair[part]));
      pen.lineTo(LEFT + (i + 1) * column, y(pair[part]));
    });
    pen.stroke();
  });
  pen.lineWidth = 1;
}

for (const chart of CHARTS) {
  const caption = byId(`caption-${chart.id}`),
    canvas = byId(chart.id);
  caption.textContent = `${chart.title}: `;
  chart.names.forEach((name, i) => {
    dot(chart.parts[i][1], caption);
    caption.append(name);
  });
  const rowAt = (event) => {
    const [low, high] = stepsInSight();
    const i = low + Math.floor(((event.offsetX - LEFT) / (canvas.clientWidth - LEFT)) * (high - low + 1));
    return event.offsetX < LEFT || !steps[i] ? -1 : i;
  };
  canvas.addEventListener("pointermove", (event) => {
    const i = rowAt(event);
    tip(i < 0 ? "" : tellStep(steps[i], i), event);
  });
  canvas.addEventListener("pointerleave", () => tip(""));
  canvas.addEventListener("click", (event) => {
    const i = rowAt(event);
    if (i >= 0) reveal(steps[i].began, steps[i + 1]?.began ?? END, tellStep(steps[i], i));
  });
}
