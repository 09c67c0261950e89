"""The words that may stand in a line of a client, from the requests that an encoding knows.

>>> words = LineWords(with_object=True)
>>> words.learn(["bring(o1,o2)", "bring(o1,o3,urgent)", "bring(o2,o1)", "wave"])
>>> words.offered([]), words.offered(["o1"]), words.offered(["o1", "o2", "box"])
(['o1', 'o2'], ['o2', 'o3'], ['urgent', 'by'])
"""

from __future__ import annotations

import contextlib
from typing import Dict, Iterable, List, Mapping, Sequence

from rosclingo.errors import TermError
from rosclingo.solver.terms import parse_term
from rosclingo.wire.term_text import split_term

_WHEN = ["urgent", "by"]


class LineWords:
    """Words of lines ``FROM TO``, or ``FROM TO OBJECT`` and then ``urgent`` or ``by SECONDS``.

    One thread may call :meth:`learn` while others ask.
    """

    def __init__(self, with_object: bool) -> None:
        """Begins without any.

        Args:
            with_object: Whether a request names an object.
        """
        self._with_object = with_object
        self._destinations: Mapping[str, List[str]] = {}
        self._says_when = False

    def learn(self, requests: Iterable[str]) -> None:
        """Takes the requests that the encoding knows in the place of those before."""
        destinations: Dict[str, Dict[str, None]] = {}
        says_when = False
        for request in requests:
            name, places = split_term(request)
            if name == "bring" and len(places) in (2, 3) and all(map(_is_word, places[:2])):
                destinations.setdefault(places[0], {})[places[1]] = None
                says_when = says_when or len(places) == 3
        self._destinations = {origin: list(ends) for origin, ends in destinations.items()}
        self._says_when = says_when

    def offered(self, before: Sequence[str], numbers: Iterable[int] = ()) -> List[str]:
        """Returns the words that may come next.

        Args:
            before: The words of the line before.
            numbers: The requests that can be cancelled, which a line may name by its only word.
        """
        if not before:
            return list(dict.fromkeys((*self._destinations, *map(str, numbers))))
        if len(before) == 1:
            with contextlib.suppress(TermError):
                return self._destinations.get(str(parse_term(before[0])), [])
        if len(before) == 3 and self._with_object and self._says_when:
            return _WHEN
        return []


def _is_word(place: str) -> bool:
    """Returns whether a place can be typed as a word, and shown as it is."""
    return place.isprintable() and " " not in place
