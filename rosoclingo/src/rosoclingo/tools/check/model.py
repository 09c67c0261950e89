"""Modelling mistakes that the library for actions reports: docs/check.md, check ``model``.

The library finds them itself, by its part ``doubts(k)``, after it has been told some requests. Here
each of them gets its place in a file.
"""

from __future__ import annotations

import time
from typing import Dict, Iterator, List, Sequence, Tuple

from clingo import ast

from rosclingo.errors import RosclingoError
from rosclingo.solver.options import Options
from rosclingo.solver.programs import parse_files
from rosclingo.wire.term_text import split_term
from rosoclingo.encodings.alphabet import Alphabet
from rosoclingo.in_process.parts import SINGLE, make_parts
from rosoclingo.loop.planner.planner import Planner
from rosoclingo.loop.values.atoms import event
from rosoclingo.tools.check.findings import Finding
from rosoclingo.tools.check.static import place
from rosoclingo.why.doubts import DOUBTS, doubts, one_of_each, parse, sentence
from rosoclingo.why.rules import atom_terms

_SECONDS = 2.0  # after which no further requests are told
_MOST = 12  # requests of each kind that are told
_ALONE = ("never", "unknown")  # doubts that count only if one request is told


def look(options: Options, alphabet: Alphabet) -> Iterator[Finding]:
    """Yields the modelling mistakes that the library for actions reports, if it is used.

    Args:
        options: The command line.
        alphabet: What it declares.
    """
    program = parse_files(options.files)
    if (DOUBTS, 1) not in program.parts or not alphabet.slots:
        return
    heads = [
        atom
        for statement in program.statements
        if statement.ast_type is ast.ASTType.Rule
        for atom in atom_terms([statement.head])
        if atom.ast_type is ast.ASTType.Function
    ]
    found: Dict[str, None] = {}
    planner = Planner(make_parts(SINGLE, options).planner)
    end = time.monotonic() + _SECONDS
    for requests in _rounds(alphabet):
        try:
            planner.begin()
            planner.tell([event(slot, request, 0) for slot, request in requests])
            said = doubts(planner, 0, DOUBTS)
        except RosclingoError:
            return  # an episode that does the same will say it, with its command
        for doubt in said:
            # Which actions there are may depend on what else is asked for.
            if len(requests) == 1 or parse(doubt)[0] not in _ALONE:
                found[doubt] = None
        if time.monotonic() > end:
            break
    for doubt in one_of_each(doubt for doubt in found if not _depends(doubt, heads)):
        yield Finding("model", sentence(doubt), _place(parse(doubt)[2], heads), is_hint=True)


def _rounds(alphabet: Alphabet) -> List[Sequence[Tuple[str, str]]]:
    """Returns the sets of requests to plan for: each request alone, then one in each slot."""
    kinds: Dict[str, List[str]] = {}
    for request in alphabet.requests:
        kinds.setdefault(split_term(request)[0], []).append(request)
    chosen = [_spread(requests) for requests in kinds.values()]
    in_turn = [one[number] for number in range(_MOST) for one in chosen if number < len(one)]
    slots = len(alphabet.slots)
    parts = [in_turn[begin : begin + slots] for begin in range(0, len(in_turn), slots)]
    parts = [*([one] for one in in_turn), *parts]
    return [list(zip(alphabet.slots, part)) for part in parts] or [[]]


def _spread(requests: Sequence[str]) -> Sequence[str]:
    """Returns a sample of many requests, evenly spread from the first to the last one."""
    if len(requests) <= _MOST:
        return requests
    return [requests[number * (len(requests) - 1) // (_MOST - 1)] for number in range(_MOST)]


def _depends(doubt: str, heads: Sequence[ast.AST]) -> bool:
    """Returns whether some rule can derive an action in other circumstances."""
    kind, _, fact = parse(doubt)
    actuator, action = split_term(fact)[1][:2] if kind == "unsaid" else ("", "")
    return bool(action) and bool(_place(f"action({actuator},{action})", heads))


def _place(fact: str, heads: Sequence[ast.AST]) -> str:
    """Returns where a rule says a fact, as ``FILE:LINE``; empty if it is not known."""
    name, arguments = split_term(fact)
    for head in heads:
        given = [str(argument) for argument in head.arguments]
        if head.name != name or len(given) - len(arguments) not in (0, 1):
            continue
        pairs = list(zip(given, arguments))
        if all(_fits(one, other) for one, other in pairs[name == "wants" :]):
            return place(head)
    return ""


def _fits(pattern: str, term: str) -> bool:
    """Returns whether a term of a rule's head may become a ground term; true if in doubt."""
    name, places = split_term(pattern)
    other, arguments = split_term(term)
    if not name or not name[0].islower() or (not places and not other):  # a variable, a constant
        return True
    same = name == other and len(places) == len(arguments)
    return same and all(map(_fits, places, arguments))
