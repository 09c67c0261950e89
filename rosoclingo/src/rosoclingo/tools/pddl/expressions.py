"""A parser for PDDL's s-expressions, which keeps the line of each word for messages."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Iterator, List, Tuple, Union

from rosclingo.errors import RosclingoError, shorten

# A variable may follow a name without a blank, and a type a minus: no name begins with one.
_TOKEN = re.compile(r"\s+|;[^\n]*|[()]|-(?!inf\b)(?=[a-zA-Z(])|\??[^\s();?]+|\?")
_LONGEST_WORD = 500  # letters; messages may quote some words as a whole
_DEEPEST = 100  # lists in each other, which are read recursively


class PddlError(RosclingoError):
    """A planning task cannot be imported; the message names the input, its file and its line."""


@dataclass(frozen=True)
class Word:
    """A word of a PDDL file in lower case, as PDDL's names have no case."""

    text: str
    place: str


@dataclass(frozen=True)
class ListForm:
    """A list in parentheses, with the place of its opening one."""

    parts: Tuple[Union[Word, ListForm], ...]
    place: str

    @property
    def head(self) -> str:
        """The first word, or an empty text if the list does not begin with one."""
        return self.parts[0].text if self.parts and isinstance(self.parts[0], Word) else ""

    @property
    def text(self) -> str:
        """The list as it stands in a file, on one line."""
        return f"({' '.join(part.text for part in self.parts)})"

    def lists(self, *heads: str) -> Iterator[ListForm]:
        """Yields its parts that are lists: those that begin with some words, or all."""
        for part in self.parts:
            if isinstance(part, ListForm) and (not heads or part.head in heads):
                yield part

    def words(self) -> Iterator[str]:
        """Yields its words and those of all lists in it, in the order of the file."""
        for part in self.parts:
            if isinstance(part, ListForm):
                yield from part.words()
            else:
                yield part.text

    def forms(self) -> Iterator[ListForm]:
        """Yields this list and all those in it, in the order of the file."""
        open_forms = [self]
        while open_forms:
            form = open_forms.pop()
            yield form
            open_forms.extend(reversed([*form.lists()]))


def list_form(place: str, *parts: Union[str, Word, ListForm]) -> ListForm:
    """Builds a list form that is in no file.

    Args:
        place: Its place, and that of words that are given as texts.
        parts: Its parts.
    """
    return ListForm(tuple(Word(p, place) if isinstance(p, str) else p for p in parts), place)


def read_file(file: Path) -> ListForm:
    """Returns the only list of a file.

    Raises:
        PddlError: The file cannot be read, or is not one list in parentheses.
    """
    try:
        text = file.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as err:
        raise PddlError(f"cannot read {file}: {err}") from err
    return parse(text, str(file))


def parse(text: str, name: str) -> ListForm:
    """Returns the only list of a text.

    Args:
        text: A domain or a problem.
        name: The file's name, for messages.

    Raises:
        PddlError: The text is not one list in parentheses, is nested too deeply, or has a word
            that is too long.
    """
    levels: List[Tuple[str, List[Union[Word, ListForm]]]] = [(f"{name}:1", [])]
    line = 1
    for piece in _TOKEN.findall(text):
        place = f"{name}:{line}"
        line += piece.count("\n")
        if piece == "(":
            levels.append((place, []))
            if len(levels) > _DEEPEST:
                raise PddlError(f"{place}: there are more than {_DEEPEST} parentheses open: say "
                                "it with fewer lists in each other")  # fmt: skip
        elif piece == ")":
            if len(levels) == 1:
                raise PddlError(f"{place}: a parenthesis is closed that was not opened")
            begin, parts = levels.pop()
            levels[-1][1].append(ListForm(tuple(parts), begin))
        elif not piece.isspace() and not piece.startswith(";"):
            if len(piece) > _LONGEST_WORD:
                raise PddlError(
                    f"{place}: the word {shorten(piece)} has more than {_LONGEST_WORD} letters"
                )
            levels[-1][1].append(Word(piece.lower(), place))
    if len(levels) > 1:
        raise PddlError(f"{levels[-1][0]}: this parenthesis is not closed")
    parts = levels[0][1]
    if not parts:
        raise PddlError(f"{name}:1: the file is empty: it has to begin with (define")
    first = parts[0]
    if isinstance(first, Word):
        raise PddlError(f"{first.place}: {shorten(first.text)} is not in parentheses")
    if len(parts) > 1:
        raise PddlError(f"{parts[1].place}: there is more after the end of (define ...)")
    return first
