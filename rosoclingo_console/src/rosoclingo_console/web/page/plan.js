// The plan ahead, step by step.

import { mayAsk } from "./connection.js";
import { allow, byId, change, fill, make } from "./dom.js";
import { chosen, rowsOf, state, watch } from "./store.js";
import { why } from "./why.js";
import { byName, plural } from "./words.js";

const SIGNS = { done: ["✓", "done"], acts: ["▶", "under way"], held: ["❚❚", "held"], planned: ["", ""] };

function makeAction([, actuator, action, how]) {
  const [sign, word] = SIGNS[how];
  return make(
    "span",
    { class: `action ${how}` },
    make("span", { class: "sign", role: "img", "aria-label": word || "planned", text: sign || "·" }),
    make("span", { class: "who", text: actuator }),
    make("span", { class: "term", text: action }),
  );
}

function makeStep() {
  const head = make("b"),
    actions = make("span", { class: "actions" });
  const made = make("li", {}, head, actions);
  let before = "";
  made.update = ({ step, actions: all, isNow }) => {
    change(head, { text: String(step) });
    change(made, { class: isNow ? "now" : "", "aria-current": isNow ? "step" : "false" });
    const text = JSON.stringify(all);
    if (text === before) return;
    before = text;
    actions.replaceChildren(
      ...all.map((one) => {
        const [number, actuator, action] = one;
        const shown = makeAction(one);
        const ask = make("button", {
          type: "button",
          text: "Why?",
          "aria-label": `Why ${actuator}: ${action} in step ${number}?`,
          click: () =>
            why("action", [`do(${actuator},${action},${number})`], `Why does ${actuator} do ${action} in step ${number}?`),
        });
        shown.append(ask);
        return shown;
      }),
    );
  };
  return made;
}

let drawn = null;

function draw(plan) {
  const steps = new Map();
  for (const one of plan?.actions ?? []) {
    if (!steps.has(one[0])) steps.set(one[0], []);
    steps.get(one[0]).push(one);
  }
  const rows = [...steps].map(([step, actions]) => [
    `${state.chosen} ${step}`,
    { step, actions: actions.sort((a, b) => byName(a[1], b[1])), isNow: step === plan.step },
  ]);
  fill(byId("plan").querySelector(".rows"), rows, makeStep);
  const more = plan?.more ? `, of which ${plan.more} are not shown` : "";
  const count = plan ? plan.actions.length + plan.more : 0;
  byId("plan-head").textContent = count
    ? `${plural(count, "action")} from step ${plan.step} on, up to step ${plan.horizon}${more}`
    : "Nothing is planned.";
}

watch(() => {
  const plan = rowsOf(chosen(), "plan").get("plan");
  if (plan !== drawn) draw(plan);
  drawn = plan;
  for (const button of byId("plan").querySelectorAll("button")) allow(button, mayAsk());
});
