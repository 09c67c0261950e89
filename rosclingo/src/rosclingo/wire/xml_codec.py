"""Encodes and decodes values as XML: docs/protocol.md, section "Control service".

Every function here is pure and thread-safe. Decoding raises :class:`rosclingo.errors.XmlError`
and nothing else, whatever it is given; what one function encodes, its counterpart decodes to the
same value.

>>> decode_commands('<commands><cleanup_domains/></commands>')
(CleanupDomains(),)
"""

from __future__ import annotations

import json
import re
from typing import Callable, Dict, List, Mapping, Sequence, Tuple, Union
from xml.sax.saxutils import escape, quoteattr

from rosclingo.errors import XmlError, shorten
from rosclingo.wire import commands as wire
from rosclingo.wire.characters import carried, check_text
from rosclingo.wire.xml_tree import MAX_ELEMENTS, Element, parse

_ELEMENTS, _TEXT = "elements", "text"  # what may be inside of an element, if not nothing
_COSTS = re.compile(r"-?[0-9]{1,18}(?: -?[0-9]{1,18})*")
_WHOLE = re.compile(r"[0-9]{1,9}")
_STRATEGY = re.compile(r"[A-Za-z](?:,[0-9]{1,9}(?:\.[0-9]{1,6})?){1,4}")
_TRUTHS = {**{truth.value: truth for truth in wire.Truth}, "none": wire.Truth.FREE}


def decode_commands(text: Union[str, bytes]) -> Tuple[wire.Command, ...]:
    """Decodes a control request.

    Raises:
        XmlError: The text is not a ``<commands>`` element of the manual's form; the error's
            ``command`` and ``index`` say which command is wrong.
    """
    try:
        root = parse(text, MAX_ELEMENTS)
        _expect(root, "commands", inside=_ELEMENTS)
    except XmlError as err:
        err.command = "commands"
        raise
    commands: List[wire.Command] = []
    for index, element in enumerate(root.children):
        try:
            if element.name not in _COMMANDS:
                known = ", ".join(sorted(_COMMANDS))
                name = shorten(element.name)
                raise element.error(f"<{name}> is not a command; known are {known}")
            commands.append(_COMMANDS[element.name](element))
        except XmlError as err:
            err.command, err.index = shorten(element.name), index
            raise
    return tuple(commands)


def encode_commands(commands: Sequence[wire.Command]) -> str:
    """Encodes a control request.

    Raises:
        XmlError: A text holds a character that XML cannot carry, such as NUL.
    """
    return f"<commands>{''.join(_encode_command(command) for command in commands)}</commands>"


def decode_assumptions(text: Union[str, bytes]) -> Tuple[wire.Assumed, ...]:
    """Decodes a goal's assumptions; an empty text means none.

    Raises:
        XmlError: The text is not an ``<assumptions>`` element of the manual's form.
    """
    if not text.strip():
        return ()
    root = parse(text, MAX_ELEMENTS)
    _expect(root, "assumptions", inside=_ELEMENTS)
    return tuple(_ASSUMED.get(each.name, _assumption)(each) for each in root.children)


def encode_assumptions(assumptions: Sequence[wire.Assumed]) -> str:
    """Encodes a goal's assumptions.

    Raises:
        XmlError: An atom holds a character that XML cannot carry.
    """
    return f"<assumptions>{''.join(map(_encode_assumed, assumptions))}</assumptions>"


def _encode_assumed(assumed: wire.Assumed) -> str:
    if isinstance(assumed, wire.CostBound):
        return f'<cost_bound value="{" ".join(map(str, assumed.cost))}"/>'
    if isinstance(assumed, wire.ConflictLimit):
        return f'<conflict_limit value="{assumed.conflicts}"/>'
    if isinstance(assumed, wire.Restarts):
        return f"<restarts value={_attribute(assumed.strategy)}/>"
    value = "true" if assumed.value else "false"
    return f'<assumption name={_attribute(assumed.name)} value="{value}"/>'


def _assumption(element: Element) -> wire.Assumption:
    name, value = _valued(element, "assumption")
    if value is wire.Truth.FREE:
        raise element.error("an assumption's value is true or false")
    return wire.Assumption(name, value is wire.Truth.TRUE)


def _cost_bound(element: Element) -> wire.CostBound:
    """Reads an upper bound of costs."""
    text = _expect(element, "cost_bound", "value")["value"]
    if not _COSTS.fullmatch(text):
        raise element.error('a cost bound has whole numbers, such as value="3 17"')
    return wire.CostBound(tuple(map(int, text.split())))


def _conflict_limit(element: Element) -> wire.ConflictLimit:
    """Reads a limit of conflicts."""
    text = _expect(element, "conflict_limit", "value")["value"]
    if not _WHOLE.fullmatch(text):
        raise element.error('a conflict limit is a whole number, such as value="100"')
    return wire.ConflictLimit(int(text))


def _restarts(element: Element) -> wire.Restarts:
    """Reads a restart strategy."""
    strategy = _expect(element, "restarts", "value")["value"]
    if not _STRATEGY.fullmatch(strategy):
        raise element.error('a restart strategy is as for clingo, such as value="D,100,0.7"')
    return wire.Restarts(strategy)


_ASSUMED: Dict[str, Callable[[Element], wire.Assumed]] = {
    "cost_bound": _cost_bound,
    "conflict_limit": _conflict_limit,
    "restarts": _restarts,
}


def decode_reply(text: Union[str, bytes]) -> wire.Reply:
    """Decodes a control reply.

    Raises:
        XmlError: The text is not a ``<return>`` element of the manual's form.
    """
    root = parse(text)
    _expect(root, "return", inside=_ELEMENTS)
    success = None
    failure = None
    answers: List[wire.Answer] = []
    for element in root.children:
        if element.name == "success":
            _expect(element, "success", inside=_TEXT)
            success = {"True": True, "False": False}.get(element.text.strip())
        elif element.name == "error":
            failure = _decode_failure(element)
        elif element.name in _ANSWERS:
            answers.append(_ANSWERS[element.name](element))
        else:
            raise element.error(f"<{shorten(element.name)}> does not belong into <return>")
    if success is None or success is not (failure is None):
        raise root.error("<return> needs a <success>, and an <error> exactly if that is False")
    return wire.Reply(tuple(answers), failure)


def encode_reply(reply: wire.Reply) -> str:
    """Encodes a control reply, each tag and text in a line of its own, as in the manual.

    Characters that XML cannot carry are replaced by U+FFFD.
    """
    lines = ["<return>", "<success>", str(reply.success), "</success>"]
    failure = reply.failure
    if failure is not None:
        command = _attribute(carried(failure.command))
        message = _text(carried(failure.message))
        lines += [f'<error command={command} index="{failure.index}">', message, "</error>"]
    for answer in reply.answers:
        if isinstance(answer, wire.Externals):
            values = [(name, value.value) for name, value in answer.values]
            lines += _listed("external", "value", values)
        elif isinstance(answer, wire.Programs):
            lines += [
                "<programs>",
                *(_program(*part, answer) for part in answer.parts),
                "</programs>",
            ]
        else:
            lines += ["<stats>", _text(json.dumps(answer.values)), "</stats>"]
    lines.append("</return>")
    return "\n".join(lines)


def _program(name: str, count: int, answer: wire.Programs) -> str:
    extended = ' extended="true"' if (name, count) in answer.extended else ""
    return f'<program name={_attribute(carried(name))} parameters="{count}"{extended}/>'


def _listed(kind: str, key: str, pairs: Sequence[Tuple[str, object]]) -> List[str]:
    rows = (f'<{kind} name={_attribute(carried(name))} {key}="{of}"/>' for name, of in pairs)
    return [f"<{kind}s>", *rows, f"</{kind}s>"]


def _decode_add(element: Element) -> wire.Add:
    name = _expect(element, "add", "name", inside=_ELEMENTS)["name"]
    if not element.children or element.children[-1].name != "program":
        raise element.error("<add> needs a <program> after its <parameter_definition> elements")
    *definitions, program = element.children
    parameters = [_expect(each, "parameter_definition", "name")["name"] for each in definitions]
    _expect(program, "program", inside=_TEXT)
    return wire.Add(name, tuple(parameters), program.text)


def _decode_ground(element: Element) -> wire.Ground:
    attributes = _expect(element, "ground", optional=("asking", "reserved"), inside=_ELEMENTS)
    if not element.children:
        raise element.error('<ground> needs a <program name="..."> for each part to ground')
    parts = tuple(_decode_part(program) for program in element.children)
    asking = attributes.get("asking", "false").strip().lower()
    if asking not in ("true", "false"):
        raise element.error(f"asking of <ground> is true or false, not {asking[:50]!r}")
    return wire.Ground(parts, asking == "true", tuple(attributes.get("reserved", "").split()))


def _decode_part(element: Element) -> wire.Part:
    name = _expect(element, "program", "name", inside=_ELEMENTS)["name"]
    return wire.Part(
        name, tuple(_expect(each, "parameter", "value")["value"] for each in element.children)
    )


def _decode_plain(element: Element) -> wire.Command:
    _expect(element, element.name)
    return wire.PLAIN[element.name]


_COMMANDS: Dict[str, Callable[[Element], wire.Command]] = {
    "add": _decode_add,
    "assign_external": lambda element: wire.AssignExternal(*_valued(element, "assign_external")),
    "ground": _decode_ground,
    "load": lambda element: wire.Load(_expect(element, "load", "file")["file"]),
    "release_external": lambda element: wire.ReleaseExternal(
        _expect(element, "release_external", "name")["name"]
    ),
    **dict.fromkeys(wire.PLAIN, _decode_plain),
}


def _encode_command(command: wire.Command) -> str:
    if isinstance(command, wire.Add):
        definitions = "".join(
            f"<parameter_definition name={_attribute(name)}/>" for name in command.parameters
        )
        program = f"<program>{_text(command.program)}</program>"
        return f"<add name={_attribute(command.name)}>{definitions}{program}</add>"
    if isinstance(command, wire.Ground):
        asking = ' asking="true"' if command.asking else ""
        if command.reserved:
            asking += f" reserved={_attribute(' '.join(command.reserved))}"
        return f"<ground{asking}>{''.join(_encode_part(part) for part in command.parts)}</ground>"
    if isinstance(command, wire.Load):
        return f"<load file={_attribute(command.file)}/>"
    if isinstance(command, wire.AssignExternal):
        name = _attribute(command.name)
        return f'<assign_external name={name} value="{command.value.value}"/>'
    if isinstance(command, wire.ReleaseExternal):
        return f"<release_external name={_attribute(command.name)}/>"
    return f"<{wire.command_name(command)}/>"


def _encode_part(part: wire.Part) -> str:
    parameters = "".join(f"<parameter value={_attribute(value)}/>" for value in part.parameters)
    return f"<program name={_attribute(part.name)}>{parameters}</program>"


def _decode_failure(element: Element) -> wire.Failure:
    attributes = _expect(element, "error", "command", "index", inside=_TEXT)
    try:
        index = int(attributes["index"])
    except ValueError:
        raise element.error("attribute index of <error> is not a number") from None
    return wire.Failure(attributes["command"], index, _line(element.text))


def _decode_externals(element: Element) -> wire.Externals:
    _expect(element, "externals", inside=_ELEMENTS)
    return wire.Externals(tuple(_valued(external, "external") for external in element.children))


def _decode_programs(element: Element) -> wire.Programs:
    _expect(element, "programs", inside=_ELEMENTS)
    parts, extended = [], set()
    for program in element.children:
        attributes = _expect(program, "program", "name", "parameters", optional=("extended",))
        count = attributes["parameters"]
        if not _WHOLE.fullmatch(count):
            raise program.error(
                f"parameters of <program> is a number of at most nine digits, not {count[:50]!r}"
            )
        parts.append((attributes["name"], int(count)))
        if attributes.get("extended") == "true":
            extended.add(parts[-1])
    return wire.Programs(tuple(parts), frozenset(extended))


def _decode_stats(element: Element) -> wire.Stats:
    _expect(element, "stats", inside=_TEXT)
    try:
        values = json.loads(element.text)
    except (ValueError, RecursionError) as err:
        raise element.error(f"<stats> does not hold JSON: {err}") from err
    if not isinstance(values, dict):
        raise element.error("<stats> does not hold a JSON object")
    return wire.Stats(values)


_ANSWERS: Dict[str, Callable[[Element], wire.Answer]] = {
    "externals": _decode_externals,
    "programs": _decode_programs,
    "stats": _decode_stats,
}


def _valued(element: Element, kind: str) -> Tuple[str, wire.Truth]:
    """Returns the name and the value of an element of a kind, as those of atoms have them."""
    attributes = _expect(element, kind, "name", "value")
    word = attributes["value"]
    value = _TRUTHS.get(word.strip().lower())
    if value is None:
        raise element.error(
            f"value of <{kind}> is true, false or free (or None), not {word[:50]!r}"
        )
    return attributes["name"], value


def _expect(
    element: Element,
    name: str,
    *attributes: str,
    optional: Sequence[str] = (),
    inside: str = "nothing",
) -> Mapping[str, str]:
    """Validates an element's name, attributes and content.

    Returns:
        The attributes.
    """
    if element.name != name:
        raise element.error(f"expected <{name}>, found <{shorten(element.name)}>")
    missing = [key for key in attributes if key not in element.attributes]
    if missing:
        raise element.error(f"<{name}> lacks the attribute {missing[0]}")
    allowed = (*attributes, *optional)
    unknown = [key for key in element.attributes if key not in allowed]
    if unknown:
        known = f"; it has {', '.join(allowed)}" if allowed else "; it has none"
        raise element.error(f"<{name}> has no attribute {shorten(unknown[0])}{known}")
    if inside != _TEXT and element.text.strip():
        raise element.error(f"<{name}> holds the stray text {element.text.strip()[:50]!r}")
    if inside != _ELEMENTS and element.children:
        child = element.children[0]
        raise child.error(f"<{shorten(child.name)}> does not belong into <{name}>")
    return element.attributes


def _attribute(text: str) -> str:
    return quoteattr(check_text(text))


def _text(text: str) -> str:
    return escape(check_text(text), {"\r": "&#13;"})


def _line(text: str) -> str:
    """Returns a text without the line breaks around it, which older nodes do not send."""
    return text[1:-1] if len(text) > 1 and text[0] == text[-1] == "\n" else text
