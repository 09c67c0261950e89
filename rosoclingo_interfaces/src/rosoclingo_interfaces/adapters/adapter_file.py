"""Reads the file of an adapter: actions, and what an existing stack does for them. Needs no ROS.

The package's README has the keys, section "adapter.py".
"""

from __future__ import annotations

import enum
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Callable, Dict, List, Mapping, Optional, Sequence, Set, Tuple

import clingo

from rosclingo.errors import TermError, shorten
from rosclingo.solver.terms import parse_term, quote
from rosoclingo.loop.values.served import ServedGoal
from rosoclingo.loop.words import FAILURE, SUCCESS
from rosoclingo_interfaces.adapters.answer_rules import (
    STATES,
    AnswerRule,
    read_condition,
    read_rules,
)
from rosoclingo_interfaces.adapters.field_template import (
    GOAL_WORDS,
    ActionValues,
    Filler,
    TemplateReader,
)
from rosoclingo_interfaces.adapters.place_table import PlaceTable, read_places
from rosoclingo_interfaces.adapters.term_pattern import TermPattern
from rosoclingo_interfaces.errors import ActionError, EntryError
from rosoclingo_interfaces.interface import AFTER_CRASH
from rosoclingo_interfaces.observation.condition_reader import FIELD_CONDITIONS, read_field
from rosoclingo_interfaces.observation.conditions import EqualsCondition, RangeCondition
from rosoclingo_interfaces.observation.fields import FieldPath, Slots
from rosoclingo_interfaces.observation.observer import Observer
from rosoclingo_interfaces.observation.observers import observers_of
from rosoclingo_interfaces.observation.transforms import TransformTree
from rosoclingo_interfaces.observation.yaml_entry import YamlEntry, read_entry

_FILE_KEYS = ("actuators", "leaves_unknown", "places", "actions", "announce")
_ACTION_KEYS = ("action", "slot", "request", "type", "fields", "answers", "within", "after_crash")
_NAME = re.compile(r"[~/]?[A-Za-z]\w*(/\w+)*", re.ASCII)


class TargetKind(str, enum.Enum):
    """Kind of the target of an action; its value is the key in the file."""

    SERVER = "actionlib"
    SERVICE = "service"
    TOPIC = "publish"

    __str__ = str.__str__


_KEYS_OF: Mapping[TargetKind, Tuple[str, ...]] = {
    TargetKind.SERVER: ("progress",),
    TargetKind.SERVICE: (),
    TargetKind.TOPIC: ("until", "cancel"),
}


@dataclass(frozen=True)
class AwaitedTopic:
    """The topic by whose messages an action ends.

    Attributes:
        name: Its name, by the values of the action.
        type: The type of its messages.
        takes_last: Whether the last message before the action counts, too.
    """

    name: Callable[[ActionValues], str]
    type: str
    takes_last: bool


@dataclass(frozen=True)
class AdaptedAction:
    """An entry of the file: actions of one form, and what does them.

    Attributes:
        entry: Where it is in the file, for errors.
        pattern: The form of the actions.
        slot: The variable for the argument that is the slot of a goal; empty for none.
        request: The form of that goal's request; None for any.
        kind: What does them.
        name: The name of the server, the service, or the topic.
        type: Its type.
        fill: Makes the fields of the goal, of the service's request, or of the message.
        rules: What is answered when.
        within: Longest time until the answer, in seconds; 0 for no limit.
        progress: The field of the feedback that says which part is done; None for none.
        until: The topic by whose messages the action ends; None if it ends when it is published.
        cancel: Makes the message that is published when the action is cancelled; None for none.
        after_crash: One of :data:`.AFTER_CRASH`; empty for the default.
    """

    entry: YamlEntry
    pattern: TermPattern
    slot: str
    request: Optional[TermPattern]
    kind: TargetKind
    name: Callable[[ActionValues], str]
    type: str
    fill: Filler
    rules: Tuple[AnswerRule, ...]
    within: float
    progress: Optional[FieldPath]
    until: Optional[AwaitedTopic]
    cancel: Optional[Filler]
    after_crash: str

    def bind(
        self, action: clingo.Symbol, find_served: Callable[[], Sequence[ServedGoal]]
    ) -> Optional[Dict[str, str]]:
        """Returns what variables and words stand for; None if an action does not fit.

        Args:
            action: The action.
            find_served: Finds the goals that it serves; called only if that matters.
        """
        texts = self.pattern.match(action)
        if texts is None or not self.slot:
            return texts
        slot = texts[self.slot]
        goal = next((one for one in find_served() if one.slot == slot), None)
        if goal is None:
            return None
        if self.request is not None:
            bound = self.request.match(parse_term(goal.request))
            if bound is None or any(texts.get(name, value) != value for name, value in
                                    bound.items()):  # fmt: skip
                return None
            texts.update(bound)
        said = (goal.request, goal.goal_id, " ".join(goal.information))
        return {**texts, **dict(zip(GOAL_WORDS, said))}


@dataclass(frozen=True)
class AdapterFile:
    """The content of a file.

    Attributes:
        path: The file.
        actuators: Whose actions are done; none means those of all.
        leaves_unknown: Whether actions without an entry are left to other nodes.
        places: The table of places.
        actions: The entries of actions.
        observers: What is announced.
    """

    path: Path
    actuators: Tuple[str, ...]
    leaves_unknown: bool
    places: PlaceTable
    actions: Tuple[AdaptedAction, ...]
    observers: Tuple[Observer, ...]

    def knows(self, action: clingo.Symbol) -> bool:
        """Returns whether there is an entry for an action, maybe with other arguments."""
        is_function = action.type is clingo.SymbolType.Function
        return is_function and any(one.pattern.name == action.name for one in self.actions)

    def find(
        self,
        actuator: str,
        action: clingo.Symbol,
        find_served: Callable[[], Sequence[ServedGoal]],
    ) -> Tuple[AdaptedAction, ActionValues]:
        """Returns the first entry that an action fits, and what references stand for.

        Args:
            actuator: Who is to act.
            action: The action.
            find_served: Finds the goals that it serves; called only if that matters.

        Raises:
            ActionError: It fits no entry; the message says why.
        """
        for one in self.actions:
            texts = one.bind(action, find_served)
            if texts is not None:
                texts = {**texts, "actuator": actuator, "action": str(action)}
                return one, ActionValues(texts, self.places)
        if any(one.pattern.match(action) is not None for one in self.actions):
            goals = ", ".join(f"{one.request} in slot {one.slot}" for one in find_served())
            raise ActionError(
                f"no entry of {self.path} fits the goal for which it is done: "
                + shorten(goals or "it names no slot of a goal", 1000)
            )
        known = ", ".join(dict.fromkeys(one.pattern.text for one in self.actions))
        raise ActionError(f"no entry of {self.path} fits; there are {shorten(known, 1000)}")


def read_adapter(path: Path, slots: Slots, transforms: TransformTree) -> AdapterFile:
    """Reads and checks the file of an adapter.

    Args:
        path: The file.
        slots: Looks types up, such as ``move_base_msgs/MoveBaseGoal``.
        transforms: By which what is announced of poses is taken to other frames.

    Raises:
        EntryError: Something in it is wrong; the message names the line.
    """
    whole = read_entry(path, "the adapter's file", "actions")
    whole.check_keys(_FILE_KEYS)
    if "actions" not in whole and "announce" not in whole:
        raise whole.wrong("expected actions, or announce, or both")
    places = read_places(whole, "places")
    entries = whole.entries("actions") if "actions" in whole else []
    return AdapterFile(
        path,
        tuple(_actuators(whole)),
        whole.flag("leaves_unknown"),
        places,
        tuple(_ActionReader(entry, places, slots).action() for entry in entries),
        tuple(observers_of(whole, "announce", transforms) if "announce" in whole else ()),
    )


def _actuators(whole: YamlEntry) -> List[str]:
    if "actuators" not in whole:
        return []
    try:
        return [str(parse_term(one)) for one in whole.texts("actuators")]
    except TermError as err:
        raise whole.wrong(f"actuators: {err}", "actuators") from err


class _ActionReader:
    """Reads one entry of actions."""

    def __init__(self, entry: YamlEntry, places: PlaceTable, slots: Slots) -> None:
        self._entry = entry
        self._slots = slots
        self._places = places

    def action(self) -> AdaptedAction:
        entry = self._entry
        kinds = [kind for kind in TargetKind if kind.value in entry]
        if len(kinds) != 1:
            all_kinds = ", ".join(TargetKind)
            given = " and ".join(kinds) or "none"
            raise entry.wrong(f"expected one of {all_kinds}, not {given}")
        (kind,) = kinds
        entry.check_keys((*_ACTION_KEYS, kind.value, *_KEYS_OF[kind]), ("action", "type"))
        pattern = self._pattern("action")
        slot, request = self._goal(pattern)
        variables = {*pattern.variables, *(request.variables if request else ())}
        reader = TemplateReader(entry, variables, self._places, self._slots, bool(slot))
        sent, received = self._types(kind)
        name = self._name(reader, entry, kind.value)
        fill = reader.message("fields", sent)
        until = self._until(reader) if "until" in entry else None
        cancel = reader.message("cancel", sent) if "cancel" in entry else None
        for variable in variables - reader.used - {slot}:
            raise entry.wrong(
                f"{variable} is not used; write _ for an argument that does not matter, or use it "
                f"in fields, such as '{{{variable}}}'",
                "action" if variable in pattern.variables else "request",
            )
        return AdaptedAction(
            entry, pattern, slot, request, kind, name, entry.text("type"), fill,
            tuple(self._rules(kind, until.type if until else received)),
            self._within(until is not None), self._progress(), until, cancel, self._after_crash(),
        )  # fmt: skip

    def _pattern(self, key: str) -> TermPattern:
        try:
            return TermPattern.parse(self._entry.text(key))
        except EntryError as err:
            raise self._entry.wrong(f"{key}: {err}", key) from err

    def _goal(self, pattern: TermPattern) -> Tuple[str, Optional[TermPattern]]:
        """Returns the variable of the slot, and the form of the goal's request."""
        entry = self._entry
        slot = entry.text("slot")
        if slot and slot not in pattern.variables:
            known = ", ".join(pattern.variables) or "none"
            raise entry.wrong(
                f"slot: expected a variable of the action, not {quote(slot)}; there are {known}",
                "slot",
            )
        if "request" not in entry:
            return slot, None
        if not slot:
            raise entry.wrong(
                "request: name the argument that is the slot of the goal, such as slot: ID",
                "request",
            )
        return slot, self._pattern("request")

    def _types(self, kind: TargetKind) -> Tuple[str, str]:
        """Returns the types of what is sent and of what comes back; the latter may be empty."""
        name = self._entry.text("type")
        ends = {
            TargetKind.SERVER: ("Goal", "Result", "Feedback", "Action"),
            TargetKind.SERVICE: ("Request", "Response"),
            TargetKind.TOPIC: ("", ""),
        }[kind]
        sent, received, *others = (f"{name}{end}" for end in ends)
        if any(self._slots(one) is None for one in (sent, received, *others)):
            what, example = {
                TargetKind.SERVER: ("action", "move_base_msgs/MoveBase"),
                TargetKind.SERVICE: ("service", "std_srvs/Trigger"),
                TargetKind.TOPIC: ("message", "std_msgs/String"),
            }[kind]
            raise self._entry.wrong(
                f"type: there is no type of {what} {quote(name)} here; expected one such as "
                f"{example}, of a package that is installed",
                "type",
            )
        return sent, received

    def _name(
        self, reader: TemplateReader, entry: YamlEntry, key: str
    ) -> Callable[[ActionValues], str]:
        """Returns the name of a server, a service or a topic, which may have arguments in it."""
        fill = TemplateReader(
            entry, reader.variables, reader.places, reader.slots, reader.has_goal, reader.used
        ).text(key)
        if not _NAME.fullmatch(re.sub(r"\{[^{}]*\}", "x", entry.text(key))):
            raise entry.wrong(f"{key}: {quote(entry.text(key))} is no name of ROS", key)

        def name(values: ActionValues) -> str:
            made = fill(values)
            if not _NAME.fullmatch(made):
                raise ActionError(str(entry.wrong(f"{key}: {quote(made)} is no name of ROS", key)))
            return made

        return name

    def _until(self, reader: TemplateReader) -> AwaitedTopic:
        inner = self._entry.inner("until")
        inner.check_keys(
            ("topic", "type", "takes_last", "field", *FIELD_CONDITIONS), ("topic", "type")
        )
        kind = inner.text("type")
        if self._slots(kind) is None:
            raise inner.wrong(
                f"type: there is no type of message {quote(kind)} here; expected one such as "
                "std_msgs/Bool, of a package that is installed",
                "type",
            )
        return AwaitedTopic(self._name(reader, inner, "topic"), kind, inner.flag("takes_last"))

    def _rules(self, kind: TargetKind, received: str) -> List[AnswerRule]:
        """Returns the rules of the file, and those that hold without it, behind them."""
        entry = self._entry
        has_message = kind is not TargetKind.TOPIC or "until" in entry
        if "answers" in entry and not has_message:
            raise entry.wrong("answers: there is no message to decide by; add until", "answers")
        rules = read_rules(
            entry, "answers", received, self._slots, has_state=kind is TargetKind.SERVER
        )
        if kind is TargetKind.SERVER:
            return [
                *rules,
                AnswerRule(0, SUCCESS, state=STATES[0]),
                AnswerRule(0, FAILURE),
            ]
        if kind is TargetKind.SERVICE:
            if (self._slots(received) or {}).get("success") == "bool":  # as std_srvs has it
                said = EqualsCondition(FieldPath.parse("success"), value=False)
                rules.append(AnswerRule(0, FAILURE, condition=said))
            return [*rules, AnswerRule(0, SUCCESS)]
        if "until" not in entry:
            return [AnswerRule(0, SUCCESS)]
        condition = read_condition(entry.inner("until"), received, self._slots)
        if condition is not None:
            rules.append(AnswerRule(0, SUCCESS, condition=condition))
        if not rules:
            raise entry.wrong(
                "until: expected a condition of "
                f"{', '.join(FIELD_CONDITIONS)}, by which the action has succeeded, or answers",
                "until",
            )
        return rules

    def _within(self, is_needed: bool) -> float:
        entry = self._entry
        seconds = entry.number("within", unit="seconds")
        if is_needed and not seconds:
            raise entry.wrong("until needs within: after how many seconds the action fails",
                              "within" if "within" in entry else "until")  # fmt: skip
        return seconds

    def _progress(self) -> Optional[FieldPath]:
        entry = self._entry
        if "progress" not in entry:
            return None
        path = read_field(entry, "", "progress")
        try:
            RangeCondition(path).check(f"{entry.text('type')}Feedback", self._slots)
        except EntryError as err:
            raise entry.wrong(f"progress: {err}", "progress") from err
        return path

    def _after_crash(self) -> str:
        text = self._entry.text("after_crash")
        if text and text not in AFTER_CRASH:
            raise self._entry.wrong(
                f"after_crash: expected one of {', '.join(AFTER_CRASH)}", "after_crash"
            )
        return text


def unknown_answers(adapter: AdapterFile, answers: Mapping[str, Sequence[str]]) -> List[str]:
    """Returns a warning for each answer that an encoding does not know.

    Args:
        adapter: The file.
        answers: For each actuator of the encoding, what it may answer.
    """
    ours: Set[str] = set(adapter.actuators or answers) & set(answers)
    return [
        f"{adapter.path}, line {rule.line}: the planner's encoding does not know the answer "
        f"{rule.answer} of {actuator}, and is not told; it knows "
        f"{shorten(', '.join(answers[actuator]) or 'none')}"
        for actuator in sorted(ours)
        for one in adapter.actions
        for rule in one.rules
        if rule.line and rule.answer not in answers[actuator]
    ]
