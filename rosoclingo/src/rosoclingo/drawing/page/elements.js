// Makes elements and shapes. Texts of messages and bags get into a page by textContent and attributes alone.

const SVG = "http://www.w3.org/2000/svg";
const LETTER = 6.6; // width of one, in pixels, on average

export const byId = (id) => document.getElementById(id);

/** Changes an element where it differs: its attributes, its text, and functions for events. */
export function change(element, properties) {
  for (const [name, value] of Object.entries(properties)) {
    if (name === "text") {
      if (element.textContent !== value) element.textContent = value;
    } else if (typeof value === "function") element.addEventListener(name, value);
    else if (typeof value === "boolean") element.toggleAttribute(name, value);
    else if (element.getAttribute(name) !== String(value)) element.setAttribute(name, value);
  }
}

/** Makes an element with properties as those of change. */
export function make(tag, properties = {}, ...children) {
  const made = document.createElement(tag);
  change(made, properties);
  made.append(...children);
  return made;
}

/** Makes an element of SVG. One with a method tell has that as its title, once it is pointed at. */
export function shape(parent, tag, attributes, text) {
  const made = document.createElementNS(SVG, tag);
  for (const name in attributes) made.setAttribute(name, attributes[name]);
  if (text !== undefined) made.textContent = text;
  parent.append(made);
  return made;
}

document.addEventListener("pointerover", ({ target }) => {
  if (target.tell && !target.firstChild) shape(target, "title", {}, target.tell());
});

/** Empties a drawing and sets its size. */
export function clear(drawing, width, height) {
  drawing.replaceChildren();
  drawing.setAttribute("width", width);
  drawing.setAttribute("height", height);
}

/** Cuts a text to a width in pixels. */
export function cut(text, width) {
  const most = Math.max(0, Math.floor(width / LETTER));
  return text.length <= most ? text : `${text.slice(0, most - 1)}…`;
}

/** Cuts a text of a drawing to a width in pixels, by the widths of its own letters. */
export function cutAsDrawn(text, width) {
  const whole = text.textContent;
  for (let most = whole.length; most && text.getComputedTextLength() > width; ) {
    most = Math.min(most - 1, Math.floor((most * width) / text.getComputedTextLength()));
    text.textContent = `${whole.slice(0, most)}…`;
  }
}
