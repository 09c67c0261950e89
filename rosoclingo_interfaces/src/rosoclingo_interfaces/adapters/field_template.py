"""Templates of messages: fields with the arguments of actions in them. Needs no ROS.

A template is checked against the message's type when it is read, and makes plain fields later:

>>> convert("float64", "1.5"), convert("bool", "on"), convert("string", "on")
(1.5, True, 'on')
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from typing import Any, Callable, Dict, List, Mapping, Set, Union

import yaml

from rosclingo.errors import shorten
from rosclingo.solver.terms import quote
from rosoclingo_interfaces.adapters.place_table import COMPUTED, PlaceTable
from rosoclingo_interfaces.errors import ActionError
from rosoclingo_interfaces.observation.fields import Slots
from rosoclingo_interfaces.observation.yaml_entry import YamlEntry

_NOW = "now"
"""The reference that stands for the current time, in fields of times only."""

GOAL_WORDS = ("request", "goal_id", "information")
"""The references that stand for a part of the served goal."""

OTHER_WORDS = ("actuator", "action")
"""The references that stand for who acts, and for the whole action."""

_HOLE = re.compile(r"\{\{|\}\}|\{([^{}]*)\}|[{}]")
_REFERENCE = re.compile(r"(_*[A-Za-z]\w*)(?:\.([A-Za-z]\w*))?")
_ARRAY = re.compile(r"(.+)\[(\d*)\]")
_INTEGER_BITS = {
    "int8": 8, "int16": 16, "int32": 32, "int64": 64, "byte": 8,
    "uint8": 8, "uint16": 16, "uint32": 32, "uint64": 64, "char": 8,
}  # fmt: skip
_UNSIGNED = ("uint", "char")
_FLOATS = {"float32": 3.4e38, "float64": math.inf}
_TIMES = ("time", "duration")
_PRIMITIVE = {*_INTEGER_BITS, *_FLOATS, *_TIMES, "bool", "string"}
_TRUTH_VALUES = {"true": True, "yes": True, "on": True, "false": False, "no": False, "off": False}
_MOST_SECONDS = 2**31 - 1

Value = Union[bool, int, float, str]


class Now:
    """Stands for the current time in the fields that a template makes."""


@dataclass(frozen=True)
class ActionValues:
    """Values of a template's references, as an action begins.

    Attributes:
        texts: The texts of variables and words.
        places: The table of places.
    """

    texts: Mapping[str, str]
    places: PlaceTable


Filler = Callable[[ActionValues], Any]
"""Makes a value of a field: plain, or a mapping, a list or :class:`Now`.

It raises an :class:`.ActionError` if an argument does not fit.
"""


def convert(kind: str, text: str) -> Value:
    """Returns the value of a primitive field.

    Args:
        kind: The field's type; seconds of ``time`` and ``duration`` are a float.
        text: The value as it is written.

    Raises:
        ValueError: It does not fit; the text says what is expected.
    """
    if kind == "string":
        return text
    if kind == "bool":
        if text.lower() not in _TRUTH_VALUES:
            raise ValueError(f"expected true or false ({kind}), not {quote(text)}")
        return _TRUTH_VALUES[text.lower()]
    if kind in _INTEGER_BITS:
        bits, is_unsigned = _INTEGER_BITS[kind], kind.startswith(_UNSIGNED)
        low, high = (0, 2**bits) if is_unsigned else (-(2 ** (bits - 1)), 2 ** (bits - 1))
        if not re.fullmatch(r"[+-]?[0-9]{1,20}", text, re.ASCII) or not low <= int(text) < high:
            raise ValueError(
                f"expected an integer from {low} to {high - 1} ({kind}), not {quote(text)}"
            )
        return int(text)
    try:
        number = float(text.replace(".inf", "inf").replace(".nan", "nan"))
    except ValueError:
        raise ValueError(f"expected a number ({kind}), not {quote(text)}") from None
    least = 0 if kind == "time" else -_MOST_SECONDS
    if kind in _TIMES and not least <= number <= _MOST_SECONDS:
        raise ValueError(f"expected seconds ({kind}), not {quote(text)}")
    if math.isfinite(number) and abs(number) > _FLOATS.get(kind, math.inf):
        raise ValueError(f"expected a number of 32 bits ({kind}), not {quote(text)}")
    return number


@dataclass
class TemplateReader:
    """Reads the templates of an entry.

    Attributes:
        entry: The entry, for errors.
        variables: The variables that there are.
        places: The table of places.
        slots: Looks types up.
        has_goal: Whether the served goal is known, so that its parts may be referred to.
        used: The references that have been read.
    """

    entry: YamlEntry
    variables: Set[str]
    places: PlaceTable
    slots: Slots
    has_goal: bool
    used: Set[str] = field(default_factory=set)

    def message(self, key: str, kind: str) -> Filler:
        """Reads the template of a message.

        Args:
            key: The key of the template; without it, all fields have their defaults.
            kind: The message's type.

        Raises:
            EntryError: It does not fit to the type; the message names the line.
        """
        if key not in self.entry:
            return lambda _: {}
        return self._read(self.entry.value(key), kind, key)

    def text(self, key: str) -> Callable[[ActionValues], str]:
        """Reads the template of a text.

        Raises:
            EntryError: It is wrong; the message names the line.
        """
        self.entry.text(key)
        fill = self._scalar(self.entry.value(key), "string", key)
        return lambda values: str(fill(values))

    def _read(self, node: yaml.Node, kind: str, path: str) -> Filler:
        array = _ARRAY.fullmatch(kind)
        if array is not None:
            return self._list(node, array[1], array[2], path)
        if isinstance(node, yaml.ScalarNode):
            return self._scalar(node, kind, path)
        fields = None if kind in _PRIMITIVE else self.slots(kind)
        if fields is None or not isinstance(node, yaml.MappingNode):
            raise self.entry.wrong_at(node, f"{path}: expected {kind}{_hint(node)}")
        inner = YamlEntry(self.entry.file, node, path)
        fillers: Dict[str, Filler] = {}
        for name in inner.keys:
            if name not in fields:
                known = ", ".join(fields) or "none"
                raise inner.wrong(f"{path}: {kind} has no field {quote(name)}; there are: {known}",
                                  name)  # fmt: skip
            fillers[name] = self._read(inner.value(name), fields[name], f"{path}.{name}")
        return lambda values: {name: fill(values) for name, fill in fillers.items()}

    def _list(self, node: yaml.Node, kind: str, length: str, path: str) -> Filler:
        if not isinstance(node, yaml.SequenceNode):
            raise self.entry.wrong_at(node, f"{path}: expected a list of {kind}{_hint(node)}")
        if length and len(node.value) != int(length):
            raise self.entry.wrong_at(
                node, f"{path}: expected {length} entries, not {len(node.value)}"
            )
        fillers = [
            self._read(one, kind, f"{path}[{place}]") for place, one in enumerate(node.value)
        ]
        return lambda values: [fill(values) for fill in fillers]

    def _scalar(self, node: yaml.Node, kind: str, path: str) -> Filler:
        def wrong(reason: object) -> Exception:
            return self.entry.wrong_at(node, f"{path}: {reason}")

        text = str(node.value)
        parts: List[Union[str, Filler]] = []
        end = 0
        for match in _HOLE.finditer(text):
            parts.append(text[end : match.start()])
            end = match.end()
            if match[0] in ("{{", "}}"):
                parts.append(match[0][0])
                continue
            reference = None if match[1] is None else _REFERENCE.fullmatch(match[1].strip())
            if reference is None:
                raise wrong(
                    f"{quote(match[0])}: expected a name in braces, such as {{W}} or {{W.x}}; "
                    "write {{ for a brace"
                )
            whole = match[0] == text
            if not whole and kind in (*COMPUTED.values(), *_TIMES):
                raise wrong(f"expected {kind}, and {quote(text)} is a text")
            parts.append(self._hole(reference, kind if whole else "string", wrong))
        parts.append(text[end:])
        parts = [part for part in parts if part != ""]
        if len(parts) == 1 and callable(parts[0]):
            return self._converted(parts[0], kind, path, node)
        if any(map(callable, parts)):

            def fill(values: ActionValues) -> str:
                return "".join(one if isinstance(one, str) else str(one(values)) for one in parts)

            if kind not in _PRIMITIVE:
                raise wrong(f"expected {kind}, and {quote(text)} is a text")
            return self._converted(fill, kind, path, node)
        if kind not in _PRIMITIVE:
            raise wrong(f"expected the fields of {kind}, such as {{name: value}}")
        if node.tag.endswith(":null"):
            raise wrong(f"expected {kind}; write a value, or '' for an empty text")
        try:
            value = convert(kind, "".join(map(str, parts)))
        except ValueError as err:
            raise wrong(err) from err
        return lambda _: value

    def _converted(self, fill: Filler, kind: str, path: str, node: yaml.Node) -> Filler:
        """Returns a filler of the field's type, which may fail when an action begins."""

        def converted(values: ActionValues) -> Any:
            value = fill(values)
            if not isinstance(value, str):
                return value
            try:
                return convert(kind, value)
            except ValueError as err:
                raise ActionError(str(self.entry.wrong_at(node, f"{path}: {err}"))) from err

        return converted

    def _hole(
        self, reference: re.Match[str], kind: str, wrong: Callable[[object], Exception]
    ) -> Filler:
        """Returns what a reference stands for: a text, but for computed columns and the time."""
        name, column = reference[1], reference[2]
        if name == _NOW and column is None:
            if kind != "time":
                raise wrong(f"{{{_NOW}}} is a time, and {kind} is needed")
            return lambda _: Now()
        words = (*(GOAL_WORDS if self.has_goal else ()), *OTHER_WORDS)
        if name in GOAL_WORDS and not self.has_goal:
            raise wrong(
                f"{{{name}}} is known of actions with a slot only: name the argument that is the "
                "slot, such as slot: ID"
            )
        if name not in self.variables and (name not in words or column is not None):
            known = ", ".join([*sorted(self.variables), *words])
            raise wrong(f"there is no {quote(name)}; there are {known}, and {_NOW} for times")
        self.used.add(name)
        if column is None:
            if kind not in _PRIMITIVE:
                raise wrong(f"{{{name}}} is a text or a number, and {kind} is needed")
            return lambda values: values.texts[name]
        self._check_column(column, kind, wrong)
        return lambda values: values.places.find(values.texts[name], column)

    def _check_column(self, column: str, kind: str, wrong: Callable[[object], Exception]) -> None:
        found = self.places.values_of(column)
        if not found:
            known = ", ".join(self.places.columns) if self.places.rows else "no places"
            raise wrong(f"no place has {quote(column)}; there are {shorten(known)}")
        if column in COMPUTED or kind not in _PRIMITIVE:
            if kind != COMPUTED.get(column):
                raise wrong(f"{column} is {COMPUTED.get(column, 'a text')}, and {kind} is needed")
            return
        for place, value in found.items():
            try:
                convert(kind, value)
            except ValueError as err:
                raise wrong(f"the {column} of the place {shorten(place)}: {err}") from err


def _hint(node: yaml.Node) -> str:
    """Returns what may be meant by a mapping that stands for a name in braces without quotes."""
    if isinstance(node, yaml.MappingNode) and len(node.value) == 1:
        key, value = node.value[0]
        if isinstance(key, yaml.ScalarNode) and str(value.tag).endswith(":null"):
            return f"; YAML needs quotes around braces: '{{{key.value}}}'"
    what = {yaml.MappingNode: "a mapping", yaml.SequenceNode: "a list"}.get(type(node), "a text")
    return f", not {what}"
