// What the time line shows.

const answerColour = (action) =>
  action.ended === null || !action.answer
    ? "none"
    : ["success", "failure"].includes(action.answer)
      ? action.answer
      : "answer";

// Each row's items are in order and do not overlap, so that those in sight are found by bisection.
function goalRows() {
  const rows = [],
    ends = [],
    least = Math.min(1, (END - DATA.began) / 250); // so that short ones are not hidden
  for (const goal of goals) {
    const end = goal.ended ?? END;
    let i = ends.findIndex((last) => last < goal.came);
    if (i < 0) i = rows.push([]) - 1;
    ends[i] = Math.max(end, goal.came + least);
    rows[i].push({
      from: goal.came,
      to: end,
      goal,
      colour: goal.outcome,
      text: goal.name,
      tell: () => tellGoal(goal),
    });
  }
  return rows;
}

const mark = (seconds, name, tell) => ({ from: seconds, to: seconds, colour: name, tell });
const lanes = [];
goalRows().forEach((items, i) => lanes.push({ name: i ? "" : "goals", items, strong: true }));
for (const actuator of new Set(actions.map((action) => action.actuator))) {
  const own = actions.filter((action) => action.actuator === actuator);
  const items = own.map((action, i) => ({
    from: action.began,
    to: action.ended ?? own[i + 1]?.began ?? END,
    colour: answerColour(action),
    text: action.name,
    tell: () => tellAction(action),
  }));
  lanes.push({ name: actuator, items });
}
lanes.push({
  name: "messages",
  items: messages.map((m) => mark(m.seconds, m.dropped ? "dropped" : "message", () => tellMessage(m))),
});
lanes.push({ name: "plan changes", items: changes.map((c) => mark(c.seconds, c.causes[0][0], () => tellChange(c))) });
lanes.push({
  name: "searches",
  items: searches.map((s) => ({
    from: s.ended - s.duration,
    to: s.ended,
    colour: s.result,
    tell: () => tellSearch(s),
  })),
});
if (restarts.length) {
  lanes.push({ name: "restarts", items: restarts.map((r) => mark(r.seconds, "restart", () => tellRestart(r))) });
}
let top = AXIS;
for (const lane of lanes) {
  if (lane.name && lane !== lanes[0]) top += GAP;
  lane.top = top;
  top += ROW;
}
const HEIGHT = top + 6;

const LEGEND = [
  ["goal", "open", "succeeded", "aborted", "rejected", "canceled", "recalled"],
  ["action", "success", "failure", "answer", "none"],
  ["message", "message", "dropped"],
  ["plan changed by", "goal", "cancel", "failure", "message"],
  ["search", "sat", "unsat", "unknown"],
];
if (restarts.length) LEGEND.push(["node that goes on", "restart"]);
const WORDS = { answer: "other answer", none: "no answer", message: "no answer to an action", unknown: "interrupted" };
for (const [kind, ...names] of LEGEND) {
  const group = element("span", `${kind}: `, byId("legend"));
  for (const name of names) {
    dot(name, group);
    group.append(`${((kind === "message" || name !== "message") && WORDS[name]) || name}  `);
  }
}

// The time line.

const scroller = byId("scroller"),
  timeline = byId("timeline");
const size = () => ({ width: scroller.clientWidth, height: Math.min(HEIGHT, Math.round(window.innerHeight * 0.62)) });
const xOf = (seconds) => LABELS + ((seconds - from) / (to - from)) * (size().width - LABELS);
const secondsAt = (x) => from + ((x - LABELS) / (size().width - LABELS)) * (to - from);

function drawTimeline() {
  const { width, height } = size();
  byId("sizer").style.height = `${HEIGHT}px`;
  scroller.style.height = `${height + 2}px`;
  timeline.style.width = `${width}px`;
  timeline.style.height = `${height}px`;
  const pen = prepare(timeline, width, height),
    scrolled = scroller.scrollTop;
  const scale = (width - LABELS) / (to - from),
    x = (seconds) => LABELS + (seconds - from) * scale;
  const unit = timeTicks(from, to, (width - LABELS) / 90);
  pen.strokeStyle = colour("line");
  for (let t = Math.ceil(from / unit) * unit; t <= to; t += unit) {
    pen.strokeRect(Math.round(x(t)) + 0.5, AXIS - 4, 0, height);
  }
  pen.strokeStyle = colour("restart");
  for (const { seconds } of restarts) {
    if (seconds >= from && seconds <= to) pen.strokeRect(Math.round(x(seconds)) + 0.5, AXIS - 4, 0, height);
  }
  for (const lane of lanes) {
    const y = lane.top - scrolled;
    if (y + ROW < AXIS || y > height) continue;
    pen.save();
    pen.beginPath();
    pen.rect(LABELS, AXIS, width - LABELS, height);
    pen.clip();
    drawLane(pen, lane, y, x, width);
    pen.restore();
    if (lane.name) {
      pen.fillStyle = colour("text");
      pen.textAlign = "right";
      pen.fillText(fit(pen, lane.name, LABELS - 14), LABELS - 8, y + ROW / 2);
    }
  }
  pen.fillStyle = colour("paper");
  pen.fillRect(0, 0, width, AXIS - 4);
  pen.fillStyle = colour("quiet");
  pen.textAlign = "center";
  for (let t = Math.ceil(from / unit) * unit; t <= to; t += unit) {
    if (x(t) < width - 24) pen.fillText(clock(t, unit), x(t), 10);
  }
}

function drawLane(pen, lane, y, x, width) {
  let reached = -1,
    drawn = "";
  for (let i = first(lane.items, (item) => item.to >= from); i < lane.items.length; i++) {
    const item = lane.items[i];
    if (item.from > to) break;
    const a = Math.max(x(item.from), LABELS - 2),
      isMark = item.from === item.to;
    const b = Math.max(Math.min(x(item.to), width + 2), a + (isMark || item.goal ? 3 : 1.5));
    // What is on the same pixel is seen once, but each colour is seen.
    if (b <= reached && item.colour === drawn) continue;
    reached = Math.ceil(b);
    drawn = item.colour;
    if (item.goal) drawGoal(pen, item, a, b, y, x);
    else {
      pen.fillStyle = colour(item.colour);
      pen.fillRect(a - (isMark ? 1.5 : 0), y + 2, isMark ? b - a : Math.max(b - a - 0.5, 1.5), ROW - 4);
      if (item.text) label(pen, item.text, a, b, y, "#fff");
    }
  }
}

function label(pen, text, a, b, y, ink) {
  if (b - a < 26) return;
  pen.fillStyle = ink;
  pen.textAlign = "left";
  pen.fillText(fit(pen, text, b - a - 10), a + 5, y + ROW / 2 + 0.5);
}

function drawGoal(pen, item, a, b, y, x) {
  const { accepted, cancels, came } = item.goal;
  const middle = accepted === null ? b : Math.min(Math.max(x(accepted), a), b);
  pen.fillStyle = colour(item.colour);
  pen.globalAlpha = b - a > 4 ? 0.25 : 1; // pale while it waits
  pen.fillRect(a, y + 2, middle - a, ROW - 4);
  pen.globalAlpha = 1;
  pen.fillRect(middle, y + 2, b - middle, ROW - 4);
  if (b - a > 4) {
    pen.fillRect(x(came), y + 1, 2, ROW - 2);
    pen.fillRect(b - 1, y + 2, 1, ROW - 4);
  }
  if (middle - a > b - middle) label(pen, item.text, a, middle, y, colour("text"));
  else label(pen, item.text, middle, b, y, "#fff");
  if (b - a < 14) return;
  if (accepted !== null) {
    pen.fillStyle = colour("text");
    pen.beginPath();
    pen.moveTo(middle - 4, y);
    pen.lineTo(middle + 4, y);
    pen.lineTo(middle, y + 5);
    pen.fill();
  }
  if (cancels !== null) {
    pen.strokeStyle = colour("text");
    pen.beginPath();
    for (const slope of [-4, 4]) {
      pen.moveTo(x(cancels) - 4, y + ROW / 2 - slope);
      pen.lineTo(x(cancels) + 4, y + ROW / 2 + slope);
    }
    pen.stroke();
  }
}

function itemAt(x, y) {
  const lane = lanes.find((other) => y + scroller.scrollTop >= other.top && y + scroller.scrollTop < other.top + ROW);
  if (!lane || x < LABELS || y < AXIS) return null;
  const seconds = secondsAt(x),
    near = (4 * (to - from)) / (size().width - LABELS);
  const distance = (item) => Math.max(item.from - seconds, seconds - item.to, 0);
  const i = first(lane.items, (item) => item.to >= seconds);
  const found = [lane.items[i], lane.items[i - 1]].filter((item) => item && distance(item) <= near);
  return found.sort((one, other) => distance(one) - distance(other))[0] ?? null;
}

function tip(text, event) {
  const box = byId("tip");
  box.hidden = !text;
  if (!text) return;
  box.textContent = text;
  box.style.left = `${Math.max(4, Math.min(event.clientX + 14, window.innerWidth - box.offsetWidth - 8))}px`;
  const below = event.clientY + 18;
  box.style.top = `${below + box.offsetHeight > window.innerHeight ? event.clientY - box.offsetHeight - 10 : below}px`;
}

let drag = null;
timeline.addEventListener("pointerdown", (event) => {
  drag = { x: event.clientX, from, to, moved: false };
  timeline.setPointerCapture(event.pointerId);
});
timeline.addEventListener("pointermove", (event) => {
  if (drag) {
    drag.moved ||= Math.abs(event.clientX - drag.x) > 3;
    const shift = ((drag.x - event.clientX) * (drag.to - drag.from)) / (size().width - LABELS);
    if (drag.moved) show(drag.from + shift, drag.to + shift);
    return;
  }
  const item = itemAt(event.offsetX, event.offsetY);
  timeline.className = item ? "over" : "";
  tip(item && item.tell(), event);
});
timeline.addEventListener("pointerup", (event) => {
  const item = drag && !drag.moved && itemAt(event.offsetX, event.offsetY);
  if (item) byId("details").textContent = item.tell();
  drag = null;
});
timeline.addEventListener("pointercancel", () => (drag = null));
timeline.addEventListener("pointerleave", () => tip(""));
timeline.addEventListener(
  "wheel",
  (event) => {
    if (event.ctrlKey || event.metaKey) zoom(1.0018 ** event.deltaY, secondsAt(event.offsetX));
    else if (event.deltaX) move(event.deltaX / size().width);
    else return;
    event.preventDefault();
  },
  { passive: false },
);
scroller.addEventListener("scroll", redraw);
scroller.addEventListener("keydown", (event) => {
  const keys = {
    "+": () => zoom(0.5),
    "=": () => zoom(0.5),
    "-": () => zoom(2),
    0: () => show(DATA.began, END),
    ArrowLeft: () => move(-0.25),
    ArrowRight: () => move(0.25),
  };
  if (event.ctrlKey || event.metaKey || !keys[event.key]) return;
  keys[event.key]();
  event.preventDefault();
});
byId("in").onclick = () => zoom(0.5);
byId("out").onclick = () => zoom(2);
byId("all").onclick = () => show(DATA.began, END);
byId("left").onclick = () => move(-0.5);
byId("right").onclick = () => move(0.5);
