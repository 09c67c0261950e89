// Lists that keep their elements, badges, and buttons that ask once more.

import { byId, change, make } from "./elements.js";
import { state } from "./store.js";

export { byId, change, make } from "./elements.js";

/**
 * Makes a list show rows, in their order. Elements of rows that stay are kept, so that the focus does.
 * build(row) makes an element, which may have a method update(row) for what changes in it.
 */
export function fill(parent, rows, build) {
  const known = parent.known ?? (parent.known = new Map());
  const keys = new Set(rows.map(([key]) => key));
  for (const [key, element] of known) {
    if (!keys.has(key)) {
      element.remove();
      known.delete(key);
    }
  }
  let place = parent.firstElementChild;
  for (const [key, row] of rows) {
    let element = known.get(key);
    if (!element) {
      element = build(row);
      known.set(key, element);
    }
    if (element.row !== row) {
      element.row = row;
      element.update?.(row);
    }
    if (element === place) place = place.nextElementSibling;
    else parent.insertBefore(element, place);
  }
}

/**
 * Makes the list of a section show rows of the chosen system. What build makes has a method draw, for what changes with
 * the time and the connection, and gets its row's key.
 */
export function fillSection(id, rows, build) {
  const list = byId(id).querySelector(".rows");
  fill(list, rows.map(([key, row]) => [`${state.chosen} ${key}`, row]), build);
  rows.forEach(([key], i) => {
    list.children[i].key = key;
    list.children[i].draw();
  });
  list.classList.toggle("none", !rows.length);
}

/** Empties a list of fill. */
export function empty(parent) {
  parent.known?.clear();
  parent.replaceChildren();
}

/** A word with a sign before it, so that nothing is said by a colour alone. */
export function badge(kind, sign, text) {
  return make("span", { class: `badge ${kind}` }, make("span", { "aria-hidden": "true", text: sign }), ` ${text}`);
}

/** A place for a badge, which say(kind, sign, text) replaces only by another one. */
export function badgePlace(properties = {}) {
  const made = make("span", properties);
  let before = "";
  made.say = (...said) => {
    if (before === said.join()) return;
    before = said.join();
    made.replaceChildren(badge(...said));
  };
  return made;
}

/**
 * Lets a button be clicked, or not. One that has the focus keeps it: it says that it cannot be used, and is disabled only
 * when the focus has gone elsewhere.
 */
export function allow(button, isAllowed) {
  const isFocused = document.activeElement === button;
  change(button, { disabled: !isAllowed && !isFocused, "aria-disabled": String(!isAllowed) });
}

document.addEventListener(
  "click",
  (event) => {
    if (!event.target.closest?.("[aria-disabled=true]")) return;
    event.preventDefault();
    event.stopImmediatePropagation();
  },
  true,
);

const ASKS_FOR = 10000; // ms

/** A button that asks once more before it does something. */
export function careful(text, question, done) {
  let timer = 0;
  const button = make("button", { type: "button", text });
  const calm = () => {
    clearTimeout(timer);
    timer = 0;
    button.textContent = text;
  };
  button.addEventListener("click", () => {
    if (timer) {
      calm();
      done();
    } else {
      button.textContent = question;
      timer = setTimeout(calm, ASKS_FOR);
    }
  });
  button.addEventListener("blur", calm);
  return button;
}
