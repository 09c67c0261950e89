"""Formulates the answers as sentences."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType
from typing import List, Mapping, Optional

from rosclingo.wire.term_text import split_term
from rosoclingo.loop.situation import Situation
from rosoclingo.why.answers import Contrast, WhatIf, WhyGoal, WhyNoPlan
from rosoclingo.why.facts import FactKind
from rosoclingo.why.phrases import Phrases, join
from rosoclingo.why.planner_copy import Possible
from rosoclingo.why.reason import MinimalReason

_THAT = ("that", "any one of these")
_THESE = ("that", "these")
_ALL_NEEDED = " There was no time to look whether all of {} needed."


def no_plan(answer: WhyNoPlan, last: int, phrases: Phrases, goal: str = "") -> WhyNoPlan:
    """Adds the sentences about a missing plan.

    Args:
        answer: What was found.
        last: The last step that may be planned for.
        phrases: What facts are called.
        goal: The request of the goal that alone matters, if there is one.
    """
    of_goal = f" for {goal}" if goal else ""
    if answer.is_contradictory:
        lead = "The program has no answer set, even if no plan is asked for"
    else:
        lead = f"There is no plan{of_goal}"
    if answer.reason is not None:
        text = f"{lead}{because(answer.reason, phrases, is_of_goal=bool(goal))}"
    elif answer.horizon is not None:
        text = (
            f"{lead} up to step {last}, the last one that may be planned for. That is the only "
            f"reason: there is one up to step {answer.horizon}, with -c steps={answer.horizon}."
        )
    else:
        text = f"There is a plan{of_goal} of {steps(answer.plan)}."
    return replace(answer, text=text)


def because(reason: MinimalReason, phrases: Phrases, *, is_of_goal: bool = False) -> str:
    """Returns the rest of a sentence whose cause is a reason, and the sentences after it.

    Goals are what there is no plan for, and all else is why. If it was said already for which goal
    there is no plan, the others are why, too.
    """
    goals = [m for m in reason.members if m.fact.kind is FactKind.REQUEST and not is_of_goal]
    causes = [m for m in reason.members if m not in goals]
    text = f" for {join(m.fact.content for m in goals)}" if goals else ""
    text += " together" if len(goals) > 1 else ""
    if reason.has_only_goals and reason.is_complete and not (is_of_goal and causes):
        text += _by_the_encoding(reason, phrases)
        each = [f"without {m.fact.content}, {a_plan(m.without)}" for m in goals]
        return f"{text} Each goal is needed: {join(each)}." if len(goals) > 1 else text
    if reason.enabling:
        text += f", although {phrases.join(reason.enabling)},"
    text += f" because {phrases.join(m.fact for m in causes)}" if causes else ""
    text += _given(reason)
    if not reason.is_complete:
        return f"{text}.{_ALL_NEEDED.format('that is')}"
    without = [f"without {m.fact.content}, {a_plan(m.without)}" for m in goals]
    if len(goals) == 1:
        without = []
    numbered = [(_ordinal(number), m) for number, m in enumerate(causes, 1)]
    if len(causes) == 1:
        numbered = [("that", causes[0])]
    without += [f"without {name}, {a_plan(m.without)}" for name, m in numbered]
    if len(without) == 1:
        return f"{text}. W{without[0][1:].replace(', ', ', there would be ', 1)}."
    return f"{text}. Each is needed: {join(without)}."


def _by_the_encoding(reason: MinimalReason, phrases: Phrases) -> str:
    """Returns the rest of a sentence whose reason is the encoding."""
    rules = phrases.join(reason.rules)
    if reason.relaxed is not None:
        that = _THESE[len(reason.rules) > 1]
        plan = a_plan(reason.relaxed)
        text = f" because {rules}{_given(reason)}. Without {that}, there would be {plan}."
        return text if reason.is_examined else f"{text}{_ALL_NEEDED.format('these are')}"
    else_ = " else" if reason.members or not reason.is_absolute else ""
    told = (
        f"whatever{else_} was told" if reason.is_absolute else "even if nothing else had been told"
    )
    text = f", {told}{_given(reason)}"
    if not reason.is_examined and not rules:
        return f"{text}. There was no time to look which constraints prevent it."
    if reason.obstacles or reason.doubts:
        cause = "; ".join(reason.obstacles) or "the encoding excludes it"
        wrong = f" Look at {'; '.join(reason.doubts)}." if reason.doubts else ""
        return f"{text}: {cause}.{wrong}"
    by = f" by {rules}" if rules else ""
    if reason.examined_up_to is not None:
        by = f"{by} up to step {reason.examined_up_to}; there was no time to look farther"
    return f"{text}: the encoding excludes it{by}."


def _given(reason: MinimalReason) -> str:
    if not reason.given:
        return ""
    return f", given what had happened up to step {max(f.step for f in reason.given)}"


def goal(answer: WhyGoal, situation: Situation, phrases: Phrases) -> WhyGoal:
    """Adds the sentences about a goal."""
    sentences = []
    if answer.no_plan is not None and answer.no_plan.text:
        sentences.append(answer.no_plan.text)
    elif answer.ends is not None:
        now = situation.step + situation.offset
        ends = f"{answer.request} ends in step {answer.ends}, and it is step {now} now"
        if answer.after:
            ends = f"{ends}: its turn comes after {join(answer.after)}"
        sentences.append(f"{ends}.")
        if answer.late:
            sentences.append(f"It will be late by {answer.late} s.")
    sentences += _silence(situation, phrases)
    return replace(answer, text=" ".join(sentences))


def with_queue(answer: WhyNoPlan, situation: Situation) -> WhyNoPlan:
    """Adds the goals without a slot to an answer about all goals."""
    if not situation.queued:
        return answer
    waits = "waits for a slot" if len(situation.queued) == 1 else "wait for slots"
    return replace(answer, text=f"{answer.text} {join(situation.queued)} {waits}.")


def queued(request: str, situation: Situation, phrases: Phrases, slots: int) -> WhyGoal:
    """Returns the answer for a goal that has no slot.

    Args:
        request: The goal's request.
        situation: The situation.
        phrases: What facts are called.
        slots: How many slots the planner has.
    """
    place = situation.queued.index(request)
    busy = [f"{other} (slot {slot})" for slot, other in situation.goals]
    before = list(situation.queued[:place])
    if len(busy) < slots:
        text = f"{request} has no slot yet, and gets one in this step or in a later one"
    else:
        has = "has" if len(busy) == 1 else "have"
        text = f"{request} waits for a slot, which {join(busy)} {has}"
    if before:
        text += f"; before it comes {join(before)}"
    after = tuple([other for _, other in situation.goals] + before)
    answer = WhyGoal("", "", request, after=after, silent=situation.silent)
    return replace(answer, text=" ".join([f"{text}.", *_silence(situation, phrases)]))


def contrast(
    answer: Contrast, phrases: Phrases, requests: Mapping[str, str] = MappingProxyType({})
) -> Contrast:
    """Adds the sentences of a contrastive explanation.

    Args:
        answer: What was found.
        phrases: What facts are called.
        requests: The requests of open goals, by slots.
    """
    actuator, action, step = split_term(answer.action)[1]
    deed = phrases.deed(action)
    lead = f"If {actuator} were {'' if answer.is_demanded else 'not '}to {deed} in step {step}"
    if not answer.is_possible and answer.reason is not None:
        text = f"{actuator} cannot {deed} in step {step}"
        if not answer.reason.members:
            text += ", after what is done until then."
        else:
            facts = [member.fact for member in answer.reason.members]
            text += f" because {phrases.join(facts)}. Without {_THAT[len(facts) > 1]}, it could."
    elif answer.other is not None and answer.longer is not None:
        text = f"{lead}, the best plan would take {steps(answer.other)}, {_more(answer.longer)}."
        if answer.is_planned is answer.is_demanded:
            others = planned_like(answer.plan, action)
            has = "it" if answer.is_planned else f"no such action in step {step}, but {others}"
            text = f"The plan has {has}. {text}"
        text += _lateness(answer, requests)
    elif answer.other is not None:
        text = f"{lead}, there would be {a_plan(answer.other)}."
    elif answer.reason is not None and answer.plan is None:
        text = f"There is no plan in any case{because(answer.reason, phrases)}"
    elif answer.reason is not None:
        text = f"{lead}, there would be no plan{because(answer.reason, phrases)}"
    else:
        text = f"{lead}, there would be no plan in which the same goals end."
    return replace(answer, text=text)


def _lateness(answer: Contrast, requests: Mapping[str, str]) -> str:
    """Returns a sentence about the goals that would be late, or nothing."""
    late = [
        f"{requests.get(slot, slot)} by {then} s" + (f" instead of {now} s" if now else "")
        for slot, then, now in answer.later
    ]
    return f" It would be late: {join(late)}." if late else ""


def planned_like(plan: Optional[Possible], action: str) -> str:
    """Returns the actions to name: an action in other steps, else those of its name, else all.

    Args:
        plan: The plan, if there is one.
        action: The action that it does not have in some step, such as ``go(c3)``.
    """
    planned = [split_term(text)[1] for text in plan.actions] if plan is not None else []
    deeds = [(name, step) for _, name, step in planned]
    same = [deed for deed in deeds if deed[0] == action]
    alike = [deed for deed in deeds if split_term(deed[0])[0] == split_term(action)[0]]
    return join(f"{name} in step {step}" for name, step in same or alike or deeds) or "no action"


def what_if(answer: WhatIf) -> WhatIf:
    """Adds the sentences of a counterfactual."""
    if answer.plan is None:
        text = answer.no_plan.text if answer.no_plan else "There would be no plan."
        return replace(answer, text=text.replace("There is no", "There would be no", 1))
    text = f"There would be {a_plan(answer.plan)}"
    if answer.before is not None:
        text += f", {_more(answer.plan.horizon - answer.before.horizon)}"
    return replace(answer, text=f"{text}.")


def a_plan(plan: Optional[Possible]) -> str:
    """Returns words for a plan."""
    return "a plan" if plan is None else f"a plan of {steps(plan)}"


def steps(plan: Optional[Possible]) -> str:
    """Returns the length of a plan in words."""
    number = plan.steps if plan is not None else 0
    return f"{number} step{'' if number == 1 else 's'}"


def _more(number: int) -> str:
    if number == 0:
        return "as many as now"
    return f"{abs(number)} {'more' if number > 0 else 'fewer'} than now"


def _ordinal(number: int) -> str:
    words = ("the first", "the second", "the third", "the fourth", "the fifth")
    return words[number - 1] if number <= len(words) else f"number {number}"


def _silence(situation: Situation, phrases: Phrases) -> List[str]:
    """Returns a sentence for each actuator that has not answered."""
    doing = {}
    for atom in situation.told:
        source, content, _ = split_term(atom)[1]
        if source == "commit":
            actuator, action = split_term(content)[1]
            doing[actuator] = action
    return [
        f"{actuator} has not answered for {seconds:.0f} s"
        + (f"; it was told to {phrases.deed(doing[actuator])}." if actuator in doing else ".")
        for actuator, seconds in situation.silent
    ]
