"""Terms for PDDL's names, which may have characters that clingo's have not.

>>> names = Identifiers(["pick-up", "room-1", "7"])
>>> names.term("pick-up", ["room-1", "7"])
'pick_up(room_1,7)'
"""

from __future__ import annotations

import re
from typing import Dict, Iterable, List, Sequence, Tuple

from rosclingo.wire.term_text import split_term
from rosoclingo.tools.pddl.expressions import ListForm, Word

_OTHER = re.compile(r"[^a-z0-9_]")
_NUMBER = re.compile(r"0|[1-9][0-9]{0,8}", re.ASCII)
_NO_LETTER_FIRST = re.compile(r"_*(?![_a-z])")


_RESERVED = (
    "not", "goal", "value", "variable",  # of the encoding
    "any", "cancel", "commit", "controller", "event", "info", "planner", "save", "solver",
)  # fmt: skip


class Identifiers:
    """Gives each name an identifier of its own, as close to it as possible."""

    def __init__(self, words: Iterable[str]) -> None:
        """Takes all names of a task, in lower case; those that are identifiers stay as they are."""
        self._terms: Dict[str, str] = {}
        taken = {*_RESERVED}
        unique = dict.fromkeys(words)
        for word in sorted(unique, key=lambda each: _identifier(each) != each):
            term = _identifier(word)
            while term in taken:
                term += "_"
            taken.add(term)
            self._terms[word] = term

    @classmethod
    def of(cls, *forms: ListForm) -> Identifiers:
        """Takes all names of files."""
        parts = [part for form in forms for each in form.forms() for part in each.parts]
        return cls([p.text for p in parts if isinstance(p, Word) and p.text[0] not in "?:"])

    def words(self, term: str) -> Tuple[str, List[str]]:
        """Returns the name and the objects of a term; those without a name stay as they are."""
        words = {each: word for word, each in self._terms.items()}
        name, objects = split_term(term)
        return words.get(name, name), [words.get(each, each) for each in objects]

    def term(self, name: str, objects: Sequence[str] = ()) -> str:
        """Returns the term of an action, a predicate or an object."""
        arguments = ",".join(self._terms[each] for each in objects)
        return f"{self._terms[name]}({arguments})" if objects else self._terms[name]


def _identifier(word: str) -> str:
    if _NUMBER.fullmatch(word):
        return word
    term = _OTHER.sub("_", word)
    return f"x{term}" if _NO_LETTER_FIRST.match(term) else term
