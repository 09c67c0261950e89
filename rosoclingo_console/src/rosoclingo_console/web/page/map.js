// The map, if the encoding has one: the shapes that rviz shows, too.

import { byId, shape } from "./elements.js";
import { chosen, rowsOf, watch } from "./store.js";

const MARGIN = [3.5, 1.5]; // metres, for what is written beside places
const LINE = 1.1; // height of a line, in that of letters
const LONGEST = 24; // letters of a text; the lists have all of them
const GAP = 0.15; // metres between two texts
const FAR = 10; // halves of lines that a text may be moved
const GROUPS = ["ways", "blocked ways", "plan", "waypoints", "names", "packages", "robots", "carried packages", "plan's steps"];

const shorten = (text) => (text.length <= LONGEST ? text : `${text.slice(0, LONGEST - 1)}…`);

const paint = {
  lines(parent, { points, size, colour }, group) {
    for (let i = 0; i + 1 < points.length; i += 2) {
      const [[x1, y1], [x2, y2]] = [points[i], points[i + 1]];
      shape(parent, "line", { x1, y1: -y1, x2, y2: -y2, stroke: colour, "stroke-width": size });
      if (group === "blocked ways") {
        const [x, y, d] = [(x1 + x2) / 2, -(y1 + y2) / 2, 0.7];
        const path = `M${x - d} ${y - d}L${x + d} ${y + d}M${x - d} ${y + d}L${x + d} ${y - d}`;
        shape(parent, "path", { d: path, stroke: colour, "stroke-width": 0.3 });
      }
    }
  },
  dots(parent, { points, size, colour }) {
    for (const [x, y] of points) shape(parent, "circle", { cx: x, cy: -y, r: size / 2, fill: colour });
  },
  arrow(parent, { points, size, colour }) {
    const [[x1, y1], [x2, y2]] = points;
    const length = Math.hypot(x2 - x1, y2 - y1) || 1;
    const [ux, uy] = [(x2 - x1) / length, (y2 - y1) / length];
    const [hx, hy] = [x2 - ux * 0.9, y2 - uy * 0.9];
    shape(parent, "line", { x1, y1: -y1, x2: hx, y2: -hy, stroke: colour, "stroke-width": size });
    const head = [[x2, y2], [hx - uy * 0.35, hy + ux * 0.35], [hx + uy * 0.35, hy - ux * 0.35]];
    shape(parent, "polygon", { points: head.map(([x, y]) => `${x},${-y}`).join(" "), fill: colour });
  },
  box(parent, { points, size, colour }) {
    const [[x, y]] = points;
    shape(parent, "rect", { x: x - size / 2, y: -y - size / 2, width: size, height: size, fill: colour });
  },
  cylinder(parent, { points, colour, robot }) {
    const [[x, y]] = points;
    shape(parent, "circle", { cx: x, cy: -y, r: 0.55, fill: colour, stroke: "#fff", "stroke-width": 0.12, class: "robot" });
    const label = { x, y: -y + 1.2, fill: colour, "font-size": 0.8, "font-weight": 700, "text-anchor": "middle" };
    shape(parent, "text", label, shorten(robot));
  },
  text(parent, { points, size, colour, text }, group) {
    const [[x, y]] = points;
    // Names end at their dots, and what is said of a place begins there; the middle of all else is given.
    const [anchor, aside] = /packages/.test(group)
      ? ["start", -1.1]
      : group === "names"
        ? ["end", 0.25]
        : / /.test(text) && /[a-z]/.test(text)
          ? ["start", -1.4]
          : ["middle", 0];
    const label = shape(parent, "text", { fill: colour, "font-size": size, "text-anchor": anchor });
    text
      .split("\n")
      .forEach((line, i) => shape(label, "tspan", { x: x + aside, y: -y + i * size * LINE }, shorten(line)));
  },
};

const meet = (a, b) =>
  a.x < b.x + b.width + GAP && b.x < a.x + a.width + GAP && a.y < b.y + b.height && b.y < a.y + a.height;
const overlap = (a, b) =>
  Math.max(0, Math.min(a.x + a.width, b.x + b.width) - Math.max(a.x, b.x)) *
  Math.max(0, Math.min(a.y + a.height, b.y + b.height) - Math.max(a.y, b.y));

/** Steps to the places around a text, in halves of a line's height; the nearest first, and above or below before aside. */
const AROUND = [...Array((2 * FAR + 1) ** 2).keys()]
  .map((i) => [(i % (2 * FAR + 1)) - FAR, Math.floor(i / (2 * FAR + 1)) - FAR])
  .sort((a, b) => Math.hypot(1.2 * a[0], a[1]) - Math.hypot(1.2 * b[0], b[1]));

/** The box nearest to one that is within a frame and free; where none is, that which hides least. */
function freeBox({ x, y, width, height }, line, taken, frame) {
  let best = null;
  for (const [right, down] of AROUND) {
    const box = {
      x: Math.min(Math.max(x + (right * line) / 2, frame.x), frame.x + frame.width - width),
      y: Math.min(Math.max(y + (down * line) / 2, frame.y), frame.y + frame.height - height),
      width,
      height,
    };
    if (!taken.some((other) => meet(box, other))) return box;
    const hidden = taken.reduce((sum, other) => sum + overlap(box, other), 0);
    if (!best || hidden < best.hidden) best = { box, hidden };
  }
  return best.box;
}

/** Moves texts aside that would hide another, or be hidden by a robot; those of later groups give way. */
function spread(picture) {
  const frame = picture.viewBox.baseVal;
  const taken = [...picture.querySelectorAll(".robot")].map((one) => one.getBBox());
  const texts = [...picture.querySelectorAll("text")].map((text) => [text, text.getBBox()]);
  for (const [text, box] of texts) {
    const line = Number(text.getAttribute("font-size")) * LINE;
    const place = freeBox(box, line, taken, frame);
    text.setAttribute("transform", `translate(${place.x - box.x} ${place.y - box.y})`);
    taken.push(place);
  }
}

let drawn = [];

watch(() => {
  const groups = rowsOf(chosen(), "map");
  const now = GROUPS.map((group) => groups.get(group));
  byId("map").hidden = !groups.size;
  if (now.every((row, i) => row === drawn[i])) return;
  drawn = now;
  const picture = byId("picture");
  picture.replaceChildren();
  const points = [];
  now.forEach((row, i) => {
    const group = shape(picture, "g", {});
    for (const one of row?.shapes ?? []) {
      points.push(...one.points);
      paint[one.kind]?.(group, one, GROUPS[i]);
    }
  });
  if (!points.length) return;
  const [xs, ys] = [points.map(([x]) => x), points.map(([, y]) => -y)];
  const [left, top] = [Math.min(...xs) - MARGIN[0], Math.min(...ys) - MARGIN[1]];
  const [width, height] = [Math.max(...xs) + MARGIN[0] - left, Math.max(...ys) + MARGIN[1] - top];
  picture.setAttribute("viewBox", `${left} ${top} ${width} ${height}`);
  spread(picture); // now that a metre has its size
});
