// What is believed to be the causes of what was observed, if the encoding looks for them.

import { badge, byId, change, fillSection, make } from "./dom.js";
import { chosen, now, rowsOf, watch } from "./store.js";
import { lasted } from "./words.js";

/** Returns the badge of an explanation, or of a cause that is part of none. */
function sign({ weight, since, is_certain: isCertain, speaks_against: against }) {
  if (since !== null) return isCertain ? badge("good", "≈", "probably") : badge("warn", "≈", "perhaps");
  if (weight !== null) return badge("quiet", "?", "or else");
  return against.length ? badge("quiet", "✕", "speaks against it") : badge("quiet", "–", "less likely");
}

/** Details of a belief, in short parts. */
function facts(row) {
  const parts = [row.since !== null && `for ${lasted(now() - row.since)}`];
  parts.push(row.likelihood);
  parts.push(row.speaks_for.length && `for it: ${row.speaks_for.join(", ")}`);
  parts.push(row.speaks_against.length && `against it: ${row.speaks_against.join(", ")}`);
  return parts.filter(Boolean).join(" · ");
}

function makeBelief() {
  const causes = make("b", { class: "term" }),
    how = make("span"),
    more = make("small");
  const made = make("li", {}, make("div", { class: "head" }, causes, how), more);
  made.update = (row) => {
    change(causes, { text: row.causes.join(", ") });
    how.replaceChildren(sign(row));
  };
  made.draw = () => change(more, { text: facts(made.row) });
  return made;
}

watch(() => {
  const rows = [...rowsOf(chosen(), "beliefs")].sort(([a], [b]) => a - b);
  byId("beliefs").hidden = !rows.length;
  fillSection("beliefs", rows, makeBelief);
});
