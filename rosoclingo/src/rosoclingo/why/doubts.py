"""Sentences about mistakes in a model, as the library for actions finds them.

The parts ``doubts(k)`` and ``obstacles(k)`` of ``lib/doubts.lp`` have externals ``doubt(D,F)``:
what is said or meant, F, and what is wrong with it, D.

>>> sentence("doubt(unknown,needs(r1,ring(w),bel(w),on))")
'needs(r1,ring(w),bel(w),on): bel(w) has no value; initially(bel(w),X) would say one'
>>> sentence("doubt(missing,is(bell(w),on))")
'nothing makes bell(w) on'
"""

from __future__ import annotations

from typing import Dict, Iterable, List, Tuple

from rosclingo.wire.commands import Part
from rosclingo.wire.term_text import split_term
from rosoclingo.loop.planner.planner import Planner

DOUBTS, OBSTACLES = "doubts", "obstacles"
"""The parts, each with the number of the search."""

_PLACE_OF_NAME: Dict[str, int] = {  # at which place of a fact its variable or number is
    "needs": 2,
    "needs_other": 2,
    "needs_least": 2,
    "needs_most": 2,
    "sets": 2,
    "uses": 2,
    "gives": 2,
    "fills": 2,
    "sets_if": 3,
    "fails": 2,
    "condition": 3,
    "wants": 1,
    "wants_least": 1,
    "wants_most": 1,
    "restores": 1,
    "reserves": 1,
    "own": 1,
    "drains": 1,
    "duration": 1,
    "ready": 1,
    "at_most": 1,
    "initially": 0,
    "number": 0,
}
_OF_ACTUATORS = frozenset(  # their first argument is an actuator
    (
        "needs",
        "needs_other",
        "needs_least",
        "needs_most",
        "sets",
        "sets_if",
        "uses",
        "gives",
        "fills",
        "fails",
        "occupies",
        "costs",
        "duration",
        "speed",
        "condition",
        "drains",
        "reserves",
        "at",
    )
)
_SENTENCES: Dict[str, str] = {
    "never": "{fact}: nothing ever makes {name} {value}",
    "unknown": "{fact}: {name} has no value; initially({name},X) would say one",
    "window": "{fact}: earliest({name},{other}) says that it is not met by then",
    "undeclared": "{fact}: {name} is no number; number({name},N) would say how large it can be",
    "most": "{fact}: {name} is {other} at most",
    "both": "{fact}: {name} is said to be {other}, too, and can have one value only",
    "amount": "{fact}: {value} is no whole number from 0 to 999999999",
    "numeric": "{fact}: {name} is a number, for which there are needs_least, needs_most and sets",
    "mixed": "{fact}: the action changes {name} otherwise, too, so it is never done",
    "unread": "{fact}: nothing else has the variable {name}",
    "effectless": "{fact}: there is no sets_if of this action and number",
    "rival": "{fact}: prefers({other}) is said, too, and one of them only counts",
    "preference": "{fact}: the search for plans prefers waits, makespan or cost",
    "wantless": "{fact}: nothing says wants for it, so it is met at once",
    "nowhere": "{fact}: no way leads from {value}",
    "unplaced": "{fact}: {first} is at no place; initially(at({first}),V) would say one",
    "actorless": "{fact}: its answers are not known; actuator({first}) in base would say so",
    "unsaid": "{fact}: nothing says action({first},{second}), so it is not done",
    "missing": "nothing makes {first} {second}",
    "far": "no way leads {first} to {second}",
}


def doubts(planner: Planner, step: int, *parts: str) -> List[str]:
    """Returns the encoding's doubts about all that was told, as ``doubt(D,F)``.

    Another search begins for that, in which all actions are gathered.

    Args:
        planner: A planner whose encoding has the parts.
        step: The current step.
        parts: One of the two parts, or both.
    """
    planner.run(planner.demand.begin_search(step, "search", "improve"))
    for part in ("gather", *parts):
        planner.run(planner.demand.ground([Part(part, (str(planner.demand.searches),))]))
    return sorted(atom for atom in planner.externals() if split_term(atom)[0] == "doubt")


def parse(doubt: str) -> Tuple[str, str, str]:
    """Returns the kind of a doubt, what else it names, and the fact that it is about."""
    what, fact = split_term(doubt)[1]
    name, arguments = split_term(what)
    return (name, arguments[0], fact) if arguments else (what, "", fact)


def sentence(doubt: str) -> str:
    """Returns the sentence of a doubt ``doubt(D,F)``."""
    kind, other, fact = parse(doubt)
    name, arguments = split_term(fact)
    place = _PLACE_OF_NAME.get(name, 0)
    padded = [*arguments, "", ""]
    return _SENTENCES[kind].format(
        fact=fact,
        other=other,
        name=padded[place],
        value=padded[place + 1],
        first=padded[0],
        second=padded[1],
    )


def prevents(doubt: str) -> bool:
    """Returns whether a doubt may be the reason why there is no plan."""
    return parse(doubt)[0] not in ("never", "wantless")


def one_of_each(found: Iterable[str]) -> List[str]:
    """Returns the first of the doubts that differ in their actuators or in their terms' arguments.

    What is used comes before what is given.
    """
    first: Dict[Tuple[str, ...], str] = {}
    for doubt in sorted(found, key=lambda one: parse(one)[2].startswith("gives(")):
        kind, _, fact = parse(doubt)
        name, arguments = split_term(fact)
        own = arguments[name in _OF_ACTUATORS :]
        key = "uses" if name == "gives" else name
        if kind == "unsaid":
            key, own = "", own[:1]
        first.setdefault((kind, key, *(split_term(one)[0] or one for one in own[:2])), doubt)
    return list(first.values())
