r"""Words for terms, from an encoding's facts ``phrase(Pattern,Words)``. Needs no ROS.

They stand in a part of the encoding that is never grounded, so that they cost no planner anything:

>>> phrases = TermPhrases.read(['''
... #program phrases.  % phrase("a","b").
... phrase("blocked(V,W)", "the way between V and W is blocked").
... '''])
>>> phrases.of("blocked(c5,o9)")
'the way between c5 and o9 is blocked'
>>> phrases.of("unblocked(c5,o9)")
'unblocked(c5,o9)'
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Dict, Iterable, Optional, Tuple, Type, TypeVar

from rosclingo.errors import ProgramError
from rosclingo.solver.lexical import STRING, blank_comments
from rosclingo.wire.term_text import split_term

_VARIABLE = re.compile(r"[A-Z]\w*")
_NAME = re.compile(r"\b[a-z0-9]\w*")
_PREDICATE = "phrase"
_FACT = re.compile(
    rf"(?:\A|(?<=\.))\s*{_PREDICATE}\s*\(\s*({STRING})\s*,\s*({STRING})\s*\)\s*(?=\.)"
)

_PhrasesT = TypeVar("_PhrasesT", bound="TermPhrases")


@dataclass(frozen=True)
class TermPhrases:
    """Maps terms to words, by patterns with variables; the first pattern that matches counts.

    Attributes:
        table: Pairs of pattern and words. Where the words have a variable of the pattern, they get
            what it stands for.
    """

    table: Tuple[Tuple[str, str], ...] = ()

    @classmethod
    def read(cls: Type[_PhrasesT], texts: Iterable[str]) -> _PhrasesT:
        """Reads the phrases in the files of an encoding; more specific patterns come first.

        Args:
            texts: What is in the files, those that are included, too.
        """
        found = []
        for text in texts:
            if _PREDICATE in text:
                found += [
                    (_text(pattern).replace(" ", ""), _text(words))
                    for pattern, words in _FACT.findall(_code(text))
                ]
        return cls(tuple(sorted(found, key=lambda pair: -len(_NAME.findall(pair[0])))))

    def of(self, term: str) -> str:
        """Returns the words for a term, or the term itself."""
        return self.find(term) or term

    def find(self, term: str) -> Optional[str]:
        """Returns the words for a term, if there are some."""
        for pattern, words in self.table:
            values = _match(pattern, term)
            if values is not None:
                parts = re.split(r"\b([A-Z]\w*)", words)
                return "".join(values.get(part, part) for part in parts)
        return None

    def deed(self, action: str) -> str:
        """Returns words for an action, such as ``go to c3``."""
        return self.find(action) or f"do {action}"


NO_PHRASES = TermPhrases()


def _code(text: str) -> str:
    """Returns a text without comments; as it is if a script in it has other strings."""
    try:
        return blank_comments(text).replace("\0", " ")
    except ProgramError:
        return text


def _text(string: str) -> str:
    return string[1:-1].replace("\\n", "\n").replace('\\"', '"').replace("\\\\", "\\")


def _match(pattern: str, term: str) -> Optional[Dict[str, str]]:
    """Returns the variables' values of a pattern that matches, or None."""
    if _VARIABLE.fullmatch(pattern):
        return {pattern: term}
    name, places = split_term(pattern)
    other, arguments = split_term(term)
    if (not places and pattern != term) or name != other or len(places) != len(arguments):
        return None
    values: Dict[str, str] = {}
    for place, argument in zip(places, arguments):
        found = _match(place, argument)
        if found is None or any(values.get(key, value) != value for key, value in found.items()):
            return None
        values.update(found)
    return values
