"""Rules by which the end of a goal, a response or a message becomes an answer. Needs no ROS."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, List, Optional, Sequence

from rosclingo.errors import TermError
from rosclingo.solver.terms import parse_term
from rosoclingo_interfaces.errors import EntryError
from rosoclingo_interfaces.observation.condition_reader import (
    FIELD_CONDITIONS,
    FieldCondition,
)
from rosoclingo_interfaces.observation.fields import Slots
from rosoclingo_interfaces.observation.yaml_entry import YamlEntry

STATES = ("succeeded", "aborted", "rejected", "preempted", "recalled")
"""The terminal states of goals, as rules name them; a goal that is lost fails in any case."""


@dataclass(frozen=True)
class AnswerRule:
    """An answer, and when it is given.

    Attributes:
        line: Where it is in the file; 0 if it holds without being there.
        answer: The answer, a term.
        state: In which state a goal has to end; empty for any.
        condition: What has to hold of the message; None for anything.
    """

    line: int
    answer: str
    state: str = ""
    condition: Optional[FieldCondition] = None

    def holds(self, state: str, message: Any) -> bool:
        """Returns whether the answer is given.

        Args:
            state: The state in which a goal has ended; empty if it was none.
            message: The result, the response, or the message; None if there is none.

        Raises:
            ReadingError: The message does not say whether the condition holds.
        """
        if self.state and self.state != state:
            return False
        if self.condition is None:
            return True
        return message is not None and self.condition.read(message, None) is not None


def read_condition(entry: YamlEntry, kind: str, slots: Slots) -> Optional[FieldCondition]:
    """Returns the condition of an entry, checked against a type; None if it has none.

    Raises:
        EntryError: It is wrong, or does not fit; the message names the line.
    """
    given = [key for key in FIELD_CONDITIONS if key in entry]
    if not given:
        if "field" in entry:
            known = ", ".join(FIELD_CONDITIONS)
            raise entry.wrong(f"field: expected one condition of {known} with it", "field")
        return None
    if len(given) > 1:
        raise entry.wrong(f"expected one condition, not {' and '.join(given)}", given[1])
    condition = FIELD_CONDITIONS[given[0]](entry)
    try:
        condition.check(kind, slots)
    except EntryError as err:
        raise entry.wrong(err, "field") from err
    return condition


def read_rules(
    entry: YamlEntry, key: str, kind: str, slots: Slots, *, has_state: bool = False
) -> List[AnswerRule]:
    """Returns the rules of a list, which need not be there.

    Args:
        entry: The entry with the list.
        key: The list's key.
        kind: The type of the message that conditions are about.
        slots: Looks types up.
        has_state: Whether the rules may name the state of a goal.

    Raises:
        EntryError: Something is wrong; the message names the line.
    """
    rules = []
    for one in entry.entries(key) if key in entry else ():
        states = ("state",) if has_state else ()
        one.check_keys((*states, "field", *FIELD_CONDITIONS, "answer"), ("answer",))
        state = one.text("state")
        if state and state not in STATES:
            raise one.wrong(f"state: expected one of {', '.join(STATES)}", "state")
        condition = read_condition(one, kind, slots)
        rules.append(AnswerRule(one.line, read_answer(one), state, condition))
    for rule, following in zip(rules, rules[1:]):
        if not rule.state and rule.condition is None:
            raise entry.wrong(
                f"{key}: the answer of line {rule.line} is always given, and that of line "
                f"{following.line} never; put the former last",
                key,
            )
    return rules


def read_answer(entry: YamlEntry, key: str = "answer") -> str:
    """Returns a ground term.

    Raises:
        EntryError: It is none; the message names the line.
    """
    try:
        return str(parse_term(entry.text(key)))
    except TermError as err:
        raise entry.wrong(f"{key}: {err}", key) from err


def first_answer(rules: Sequence[AnswerRule], state: str, message: Any) -> Optional[str]:
    """Returns the answer of the first rule that holds; None if none does.

    Raises:
        ReadingError: The message does not say whether a condition holds.
    """
    return next((rule.answer for rule in rules if rule.holds(state, message)), None)
