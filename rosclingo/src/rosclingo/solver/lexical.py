"""Checks untrusted text before clingo parses it: its nesting, and the files that it includes.

clingo recurses over syntax trees without a bound: some ten thousand levels overflow the stack and
end the process. And it opens what a text includes as soon as it parses it. So both are looked for
here first, in texts which are not trusted.
"""

from __future__ import annotations

import re
from typing import Callable, Iterator, List, Optional, Tuple

from rosclingo.errors import ProgramError

MAX_NESTING = 5000
"""Levels of the syntax tree; clingo 5.8 crashes between 10,000 and 100,000 on an 8 MiB stack."""

# No text holds a NUL, so one that blank_comments() puts in place of a comment cannot make a string
# of what was none.
_BODY = r'"(?:\\["\\n]|[^"\\\n\0])*'
STRING = _BODY + '"'
"""What clingo takes for a string; any other quote is an error."""

_MARK = re.compile(rf'(?P<string>{_BODY})(?P<end>"?)|%\*|%[^\n]*|#script')
_COMMENT_END = re.compile(r"%\*|\*%|%[^\n]*")
_NESTING = re.compile(
    STRING + r"|[(\[{]|[)\]}]|,"
    r"|[-!<=>+*/\\?&@|:;~^.]+"  # operators; a theory may combine any of these
)
_ANY_NESTING = re.compile(r"[(\[{]|[-!<=>+*/\\?&@|:;~^.]+")
_INCLUDE = re.compile(STRING + r"|(#include)")
_ANY_INCLUDE = re.compile(r"(#include)")
_INCLUDED = re.compile(r'[\s\0]*(?:(<)|"((?:\\["\\n]|[^"\\\n])*)")')


def blank_comments(text: str) -> str:
    """Returns the text with NUL characters in place of comments; block comments nest.

    Raises:
        ProgramError: A quote begins no string.
    """
    if "%" not in text and '"' not in text:
        return text
    parts: List[str] = []
    position = 0
    for start, end in _marks(text):
        if text[start] == "%":
            parts += [text[position:start], re.sub(r"[^\n]", "\0", text[start:end])]
            position = end
    return "".join([*parts, text[position:]])


def script(text: str) -> Optional[int]:
    """Returns where the first ``#script`` begins that is in no string or comment.

    Raises:
        ProgramError: A quote before it begins no string.
    """
    if "#script" not in text:
        return None
    return next((start for start, _ in _marks(text) if text[start] == "#"), None)


def place(text: str, position: int) -> Tuple[int, int]:
    """Returns the line and the column of a position, both counted from 1."""
    return text.count("\n", 0, position) + 1, position - text.rfind("\n", 0, position)


def depth(text: str) -> int:
    """Returns an upper bound of the depth of a text's syntax tree.

    Each bracket and each operator may add a level. A comma, and a semicolon that stands alone,
    begin a sibling; a single full stop outside of brackets ends a statement. In a program with
    scripts, where strings and comments have other rules, everything counts.
    """
    if "#script" in text:
        return sum(len(found) for found in _ANY_NESTING.findall(text))
    # Only inside of a theory atom can these be one operator.
    signs = () if "&" in text else (";-", ";@", ";|", ";~")
    deepest = 0
    # For each open bracket: levels since the last separator, and the most of any sibling before.
    levels: List[List[int]] = [[0, 0]]
    for match in _NESTING.finditer(blank_comments(text)):
        found = match.group()
        if found[0] == '"':
            continue
        if found in "([{":
            levels.append([0, 0])
        elif found in ")]}":
            if len(levels) > 1:
                chain, siblings = levels.pop()
                levels[-1][0] += max(chain, siblings) + 1
        elif found in (",", ";") or found in signs:
            levels[-1] = [len(found) - 1, max(levels[-1])]
        elif found[0] == "." and found[1:2] != "." and len(levels) == 1:
            deepest = max(deepest, *levels[0])
            levels[0] = [len(found) - 1, 0]
        else:
            levels[-1][0] += len(found)
    below = -1
    for chain, siblings in reversed(levels):
        below = max(chain + below + 1, siblings)
    return max(deepest, below)


def too_deep(text: str) -> bool:
    """Whether a text may nest deeper than :data:`MAX_NESTING`; quick for short texts."""
    return len(text) > MAX_NESTING and depth(text) > MAX_NESTING


def with_includes(text: str, change: Callable[[str], Optional[str]]) -> str:
    """Returns a program whose ``#include`` statements name other files.

    Args:
        text: The program.
        change: Returns the new name for a name; None for one that stays.

    Raises:
        ProgramError: As :func:`includes` does.
    """
    parts: List[str] = []
    position = 0
    for match in _includes(text, trusted=True):
        name = None if match[1] else change(_name(match))
        if name is not None:
            parts += [text[position : match.start(2)], re.sub(r'(["\\])', r"\\\1", name)]
            position = match.end(2)
    return "".join([*parts, text[position:]])


def includes(text: str, trusted: bool = False) -> Iterator[Optional[str]]:
    """Yields the file names in the ``#include`` statements of a program.

    None stands for a file that is built into clingo, which only a trusted text may include.

    In a program with scripts, where strings and comments have other rules, those in strings and
    comments count too.

    Raises:
        ProgramError: A statement is not of the form ``#include "FILE"``, or a quote begins no
            string.
    """
    for match in _includes(text, trusted):
        yield None if match[1] else _name(match)


def _name(match: re.Match[str]) -> str:
    return re.sub(r"\\(.)", lambda m: "\n" if m[1] == "n" else m[1], match[2])


def _includes(text: str, trusted: bool) -> Iterator[re.Match[str]]:
    """Yields the text after each ``#include``, with its place in the whole text."""
    if "#include" not in text:
        return
    scripts = "#script" in text
    if not scripts:
        text = blank_comments(text)
    for match in (_ANY_INCLUDE if scripts else _INCLUDE).finditer(text):
        if not match[1]:
            continue
        included = _INCLUDED.match(text, match.end())
        if trusted and included is not None and included[1]:
            yield included
            continue
        if included is None or included[1]:
            line, column = place(text, match.start())
            # clingo's parser silently leaves out the one file that clingo has built in.
            hint = "; there is no <incmode> here: clients ground and solve" if included else ""
            raise ProgramError(
                f'line {line}, column {column}: #include needs a file name in quotes: "FILE".{hint}'
            )
        yield included


def _marks(text: str) -> Iterator[Tuple[int, int]]:
    """Yields where each comment and each ``#script`` outside of strings begins and ends.

    Raises:
        ProgramError: A quote begins no string. clingo would find that too, but looks for the
            string's end behind every quote, which takes hours when there are many.
    """
    position = 0
    while True:
        match = _MARK.search(text, position)
        if match is None:
            return
        start, position = match.span()
        if match["string"]:
            if not match["end"]:
                line, column = place(text, start)
                raise ProgramError(
                    f"line {line}, column {column}: the string does not end in its line, or has a "
                    'backslash before something else than \\, n or "'
                )
            continue
        if match.group() == "%*":
            position = _block_comment_end(text, position)
        yield start, position


def _block_comment_end(text: str, position: int) -> int:
    """Returns where the block comment ends that began before the position."""
    levels = 1
    for match in _COMMENT_END.finditer(text, position):
        if match.group() == "%*":
            levels += 1
        elif match.group() == "*%":
            levels -= 1
            if levels == 0:
                return match.end()
    return len(text)
