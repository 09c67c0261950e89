// The tables.

/** Fills a section with a table; a column is its name, its text, and "number", "term" or nothing. */
function tabulate(id, title, rows, allColumns, go, tint) {
  const section = byId(id),
    bar = element("div", undefined, section, "bar");
  element("h2", `${title}: ${rows.length}`, bar);
  if (!rows.length) return;
  const filter = element("input", undefined, bar);
  Object.assign(filter, { type: "search", placeholder: "filter", ariaLabel: `filter ${title}` });
  const where = element("span", "", bar);
  const back = element("button", "◀", bar),
    on = element("button", "▶", bar);
  const columns = allColumns.filter(([, text]) => rows.some((row) => text(row) !== ""));
  const table = element("table", undefined, element("div", undefined, section, "scroll"));
  const head = element("tr", undefined, element("thead", undefined, table));
  for (const [name, , kind] of columns) element("th", name, head, kind);
  const body = element("tbody", undefined, table);
  let shown = rows,
    start = 0;
  function fill() {
    body.replaceChildren();
    for (const row of shown.slice(start, start + PAGE)) {
      const line = element("tr", undefined, body, "go");
      columns.forEach(([name, text, kind]) => {
        const cell = element("td", undefined, line, kind);
        if (name === tint?.column) dot(tint.of(row), cell);
        cell.append(text(row));
      });
      line.onclick = () => go(row);
    }
    where.textContent =
      shown.length > PAGE || shown !== rows
        ? `${shown.length && start + 1} to ${Math.min(start + PAGE, shown.length)} of ${shown.length}`
        : "";
    back.hidden = on.hidden = shown.length <= PAGE;
    back.disabled = !start;
    on.disabled = start + PAGE >= shown.length;
  }
  back.onclick = () => {
    start -= PAGE;
    fill();
  };
  on.onclick = () => {
    start += PAGE;
    fill();
  };
  filter.oninput = () => {
    const word = filter.value.toLowerCase();
    shown = word
      ? rows.filter((row) => columns.some(([, text]) => String(text(row)).toLowerCase().includes(word)))
      : rows;
    start = 0;
    fill();
  };
  fill();
}

const dropped = messages.filter((message) => message.dropped);
tabulate(
  "goals",
  "Goals",
  goals,
  [
    ["request", (goal) => goal.name, "term"],
    ["information", (goal) => goal.information.join(", ")],
    ["outcome", (goal) => goal.outcome],
    ["reason", (goal) => goal.reason],
    ["came", (goal) => clock(goal.came), "number"],
    ["waited", (goal) => lasted(waited(goal)), "number"],
    ["ran", (goal) => (goal.accepted === null ? "" : lasted(ran(goal))), "number"],
    ["steps", (goal) => (goal.ended === null || goal.accepted === null ? "" : goal.steps), "number"],
  ],
  (goal) => reveal(goal.came, goal.ended ?? END, tellGoal(goal)),
  { column: "outcome", of: (goal) => goal.outcome },
);
tabulate(
  "changes",
  "Plan changes",
  changes,
  [
    ["at", (change) => clock(change.seconds), "number"],
    ["step", (change) => change.step, "number"],
    ["what came before", causesOf],
    ["actions left", (change) => `${change.old} → ${change.new}`, "number"],
    ["horizon", (change) => change.horizon, "number"],
    ["first changed", (change) => `step ${change.first}`],
    ["was", (change) => change.before.join(", "), "term"],
    ["is", (change) => change.after.join(", "), "term"],
  ],
  (change) => reveal(change.seconds, change.seconds, tellChange(change)),
  { column: "what came before", of: (change) => change.causes[0][0] },
);
tabulate(
  "answers",
  "Answers",
  answers,
  [
    ["at", (answer) => clock(answer.seconds), "number"],
    ["step", (answer) => answer.step, "number"],
    ["question", (answer) => answer.question, "term"],
    ["answer", (answer) => answer.text],
    ["took", (answer) => lasted(answer.duration), "number"],
  ],
  (answer) => reveal(answer.seconds, answer.seconds, tellAnswer(answer)),
);
if (restarts.length) {
  tabulate(
    "restarts",
    "Restarts",
    restarts,
    [
      ["at", (restart) => clock(restart.seconds), "number"],
      ["step", (restart) => restart.step, "number"],
      ["node", (restart) => restart.node, "term"],
      ["lost with", (restart) => restart.reason],
      ["last event before", (restart) => clock(restart.last), "number"],
      ["took", (restart) => lasted(restart.duration), "number"],
    ],
    (restart) => reveal(restart.last, restart.seconds, tellRestart(restart)),
  );
}
tabulate(
  "dropped",
  "Messages dropped",
  dropped,
  [
    ["at", (message) => clock(message.seconds), "number"],
    ["step", (message) => message.step, "number"],
    ["id", (message) => message.id, "term"],
    ["value", (message) => message.value, "term"],
    ["reason", (message) => message.dropped],
  ],
  (message) => reveal(message.seconds, message.seconds, tellMessage(message)),
);

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

window.addEventListener("resize", redraw);
redraw();
