// The head and the tables.

import { DATA, FIELDS, rowsOf, tell } from "./data.js";
import { byId, make } from "./elements.js";
import { sample } from "./lanes.js";
import { reveal } from "./timeline.js";

const PAGE = 25; // rows of a table that are shown at once

/** Fills a section with a table of rows of a kind; its rows have a sample beside one field. */
function tabulate(id, title, kind, rows, dotted) {
  const tools = make("div", { class: "tools" }, make("h2", { text: `${title}: ${rows.length}` }));
  byId(id).append(tools);
  if (!rows.length) return;
  const filter = make("input", { type: "search", placeholder: "filter", "aria-label": `filter ${title}` });
  const where = make("span"),
    back = make("button", { text: "◀", click: () => fill((start -= PAGE)) }),
    on = make("button", { text: "▶", click: () => fill((start += PAGE)) });
  tools.append(filter, where, back, on);
  const columns = FIELDS[kind].filter(([, text, look]) => look !== "told" && rows.some((row) => text(row) !== ""));
  const head = make("tr", {}, ...columns.map(([name, , look = ""]) => make("th", { class: look, text: name })));
  const body = make("tbody");
  byId(id).append(make("div", { class: "scroll" }, make("table", {}, make("thead", {}, head), body)));
  let shown = rows,
    start = 0;
  function fill() {
    body.replaceChildren();
    for (const row of shown.slice(start, start + PAGE)) {
      const cells = columns.map(([name, text, look = ""]) =>
        make("td", { class: look }, ...(name === dotted ? [sample(row.kind)] : []), text(row)),
      );
      const line = make("tr", { class: "go" }, ...cells);
      body.append(line);
      line.onclick = () => reveal(row.from ?? row.seconds, row.to ?? row.seconds, tell(kind, row));
    }
    where.textContent =
      shown.length > PAGE || shown !== rows
        ? `${shown.length && start + 1} to ${Math.min(start + PAGE, shown.length)} of ${shown.length}`
        : "";
    back.hidden = on.hidden = shown.length <= PAGE;
    back.disabled = !start;
    on.disabled = start + PAGE >= shown.length;
  }
  filter.oninput = () => {
    const word = filter.value.toLowerCase();
    const has = (row) => columns.some(([, text]) => String(text(row)).toLowerCase().includes(word));
    shown = word ? rows.filter(has) : rows;
    fill((start = 0));
  };
  fill();
}

tabulate("goals", "Goals", "goals", rowsOf.goals, "outcome");
tabulate("changes", "Plan changes", "changes", rowsOf.changes, "what came before");
tabulate("answers", "Answers", "answers", rowsOf.answers);
if (rowsOf.beliefs.length) tabulate("beliefs", "Beliefs", "beliefs", rowsOf.beliefs);
if (rowsOf.restarts.length) tabulate("restarts", "Restarts", "restarts", rowsOf.restarts);
const dropped = rowsOf.messages.filter((message) => message.dropped);
tabulate("dropped", "Messages dropped", "messages", dropped);

// The head.

document.title = `${DATA.title} – rosoclingo report`;
byId("title").textContent = DATA.title;
byId("subtitle").textContent = DATA.subtitle;
byId("remarks").append(...DATA.remarks.map((text) => make("p", { text })));
for (const [name, value, more] of DATA.figures) {
  const texts = [make("b", { text: value }), make("span", { text: name }), make("small", { text: more })];
  byId("figures").append(make("div", {}, ...texts));
}
for (const { node, role, versions, command, files } of DATA.programs) {
  const box = make("p", {}, make("b", { text: node + (role && ` (${role})`) }), ` ${versions}`);
  for (const text of [command, ...files.map(([path, hash]) => `${hash} ${path}`)]) {
    box.append(make("br"), make("code", { text }));
  }
  byId("programs").append(box);
}
if (!DATA.programs.length) byId("programs").textContent = "The bag does not say with what the nodes were started.";
