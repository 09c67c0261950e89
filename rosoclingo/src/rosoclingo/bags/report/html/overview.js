// The strip with the whole recording.

const overview = byId("overview");
const strip = () => overview.clientWidth - LABELS;

function drawOverview() {
  const width = overview.clientWidth,
    height = 38,
    pen = prepare(overview, width, height);
  const scale = strip() / (END - DATA.began),
    x = (seconds) => LABELS + (seconds - DATA.began) * scale;
  pen.fillStyle = colour("back");
  pen.fillRect(LABELS, 0, width, height);
  const bins = new Uint32Array(Math.max(1, Math.ceil(strip()))),
    failed = new Set();
  for (const action of actions) {
    const bin = Math.min(bins.length - 1, Math.floor(x(action.began) - LABELS));
    bins[bin]++;
    if (action.answer === "failure") failed.add(bin);
  }
  const most = bins.reduce((a, b) => Math.max(a, b), 1);
  bins.forEach((count, i) => {
    if (!count) return;
    pen.fillStyle = colour("success");
    const tall = 6 + ((height - 14) * count) / most;
    pen.fillRect(LABELS + i, height - tall, 1, tall);
  });
  pen.fillStyle = colour("failure");
  failed.forEach((bin) => pen.fillRect(LABELS + bin, 0, 1.5, 7));
  pen.fillStyle = "rgba(255, 255, 255, 0.65)";
  pen.fillRect(LABELS, 0, x(from) - LABELS, height);
  pen.fillRect(x(to), 0, width - x(to), height);
  pen.strokeStyle = colour("accent");
  pen.strokeRect(Math.max(x(from), LABELS) + 0.5, 0.5, Math.max(x(to) - x(from) - 1, 3), height - 1);
  pen.fillStyle = colour("quiet");
  pen.textAlign = "right";
  pen.fillText("all actions", LABELS - 8, height / 2);
}

let chosen = null;
const overviewSeconds = (event) => {
  const part = (event.offsetX - LABELS) / strip();
  return DATA.began + Math.min(Math.max(part, 0), 1) * (END - DATA.began);
};
overview.addEventListener("pointerdown", (event) => {
  chosen = { x: event.offsetX, seconds: overviewSeconds(event) };
  overview.setPointerCapture(event.pointerId);
});
overview.addEventListener("pointermove", (event) => {
  if (!chosen || Math.abs(event.offsetX - chosen.x) < 4) return;
  const other = overviewSeconds(event);
  show(Math.min(chosen.seconds, other), Math.max(chosen.seconds, other));
});
overview.addEventListener("pointerup", (event) => {
  if (chosen && Math.abs(event.offsetX - chosen.x) < 4) {
    const half = (to - from) / 2;
    show(chosen.seconds - half, chosen.seconds + half);
  }
  chosen = null;
});
