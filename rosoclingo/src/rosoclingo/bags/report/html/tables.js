// The head and the tables.

const PAGE = 25; // rows of a table that are shown at once

/** Fills a section with a table of rows of a kind; its rows have a dot beside one field. */
function tabulate(id, title, kind, rows, dotted) {
  const section = byId(id),
    bar = element("div", undefined, section, "bar");
  element("h2", `${title}: ${rows.length}`, bar);
  if (!rows.length) return;
  const filter = element("input", undefined, bar);
  Object.assign(filter, { type: "search", placeholder: "filter", ariaLabel: `filter ${title}` });
  const where = element("span", "", bar),
    back = element("button", "◀", bar),
    on = element("button", "▶", bar);
  const columns = FIELDS[kind].filter(([, text, look]) => look !== "told" && rows.some((row) => text(row) !== ""));
  const table = element("table", undefined, element("div", undefined, section, "scroll"));
  const head = element("tr", undefined, element("thead", undefined, table));
  for (const [name, , look] of columns) element("th", name, head, look);
  const body = element("tbody", undefined, table);
  let shown = rows,
    start = 0;
  function fill() {
    body.replaceChildren();
    for (const row of shown.slice(start, start + PAGE)) {
      const line = element("tr", undefined, body, "go");
      for (const [name, text, look] of columns) {
        const cell = element("td", undefined, line, look);
        if (name === dotted) dot(row.colour, cell);
        cell.append(text(row));
      }
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
  back.onclick = () => fill((start -= PAGE));
  on.onclick = () => fill((start += PAGE));
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
if (rowsOf.restarts.length) tabulate("restarts", "Restarts", "restarts", rowsOf.restarts);
const dropped = rowsOf.messages.filter((message) => message.dropped);
tabulate("dropped", "Messages dropped", "messages", dropped);

// The head.

document.title = `${DATA.title} – rosoclingo report`;
byId("title").textContent = DATA.title;
byId("subtitle").textContent = DATA.subtitle;
for (const remark of DATA.remarks) element("p", remark, byId("remarks"));
for (const [name, value, more] of DATA.figures) {
  const box = element("div", undefined, byId("figures"));
  element("b", value, box);
  element("span", name, box);
  element("small", more, box);
}
for (const program of DATA.programs) {
  const box = element("p", undefined, byId("programs"));
  element("b", `${program.node}${program.role && ` (${program.role})`} `, box);
  element("span", program.versions, box);
  element("br", undefined, box);
  element("code", program.command, box);
  for (const [path, hash] of program.files) {
    element("br", undefined, box);
    element("code", `${hash} ${path}`, box);
  }
}
if (!DATA.programs.length) byId("programs").textContent = "The bag does not say with what the nodes were started.";
