"""Finds the least surprising causes of what was observed, for the rules of a program.

A case G is said by facts, with G as their last argument:

* ``observed(O,X,G)``: X was observed of O, such as ``failure`` of a drive
* ``usual(O,X,G)``: X is what would be observed of O if no cause has a say in that
* ``cause(C,W,G)``: C may be so; that is surprising by W, a whole number from 1 to 1,000,000
* ``makes(C,O,X,G)``: if C is so, X may be observed of O, and what is usual may not
* ``may_make(C,O,X,G)``: if C is so, X may be observed of O, as well as what is usual
* ``ended(C,O,G)``: C had ended before O was observed, and makes nothing of it
* ``excludes(C,D,G)``: C and D are not both so

An *explanation* is a set of causes with which all may be observed that was, and that can spare none
of its causes. The fewer observations it leaves unexplained, and then the less its causes' sum of
surprises, the better it is:

>>> from rosclingo.solver.engine import Engine
>>> from rosclingo.solver.options import Options
>>> from rosclingo.wire import commands as wire
>>> program = '''
... observed(lamp,dark,1). usual(lamp,lit,1).
... cause(bulb,2,1). cause(fuse,3,1). makes((bulb;fuse),lamp,dark,1).
... #program ask(g).
... found(X,g) :- X = @explanations(g,3,5).
... '''
>>> engine = Engine(Options())
>>> parts = wire.Ground((wire.Part("base"),)), wire.Ground((wire.Part("ask", ("1",)),))
>>> engine.run([wire.Add("base", (), program), *parts]).failure
>>> for text in engine.solve().symbols:
...     if text.startswith("found"):
...         print(text)
found(weighs(1,2),1)
found(because(1,bulb),1)
found(weighs(2,3),1)
found(because(2,fuse),1)
found(certain(bulb),1)
found(possible(bulb),1)

The fuse explains it, too, but is more surprising. So the bulb is certain: it is in all of the best
explanations, of which there is one.
"""

from __future__ import annotations

from collections import OrderedDict
from typing import Callable, Dict, List, Set, Tuple

from clingo import Function, Number, Symbol, SymbolType
from clingo.symbolic_atoms import SymbolicAtoms

from rosclingo.errors import shorten
from rosclingo.solver.arithmetic import LARGEST
from rosclingo.solver.diagnosis import CaseFact, Diagnosis, diagnose
from rosclingo.solver.new_facts import NewFacts

EXPLANATIONS = "explanations"
"""The function, with a case, how many explanations at most, and how much worse than the best."""

_ARITIES = {
    "cause": 3, "usual": 3, "observed": 3, "excludes": 3, "ended": 3, "makes": 4, "may_make": 4,
}  # fmt: skip

MOST_SURPRISING = 1_000_000
"""The largest surprise of a cause: clingo does not end where a sum of them leaves its 32 bits."""

_LARGEST_SUM = LARGEST - 1  # the solver adds 1 to each sum
_MOST_CASES = 4  # of which the explanations are kept


class CauseFinder:
    """Finds the explanations of the cases of one solver. One thread makes the calls.

    The facts of a case have to be grounded before it is asked for, and are not added to later.
    """

    def __init__(self, atoms: Callable[[], SymbolicAtoms]) -> None:
        """Knows no case yet.

        Args:
            atoms: Returns the solver's atoms.
        """
        self._new_facts = NewFacts(atoms)
        self._cases: Dict[Symbol, List[CaseFact]] = {}
        # By the cases, the last one on the right, and by what was asked of them.
        self._found: OrderedDict[Symbol, Dict[Tuple[Symbol, Symbol], List[Symbol]]] = OrderedDict()
        self._old: Set[Symbol] = set()  # cases whose facts are forgotten

    @property
    def functions(self) -> Dict[str, Callable[..., List[Symbol]]]:
        """The functions that programs can call, by name."""
        return {EXPLANATIONS: self.explanations}

    def forget(self) -> None:
        """Forgets all cases, which are read anew: after a cleanup of the solver's atoms."""
        self._new_facts.forget()
        self._cases.clear()
        self._found.clear()
        self._old.clear()

    def explanations(self, case: Symbol, most: Symbol, margin: Symbol) -> List[Symbol]:
        """Returns the best explanations of a case as terms.

        They are ``weighs(I,W)`` for the I-th explanation, ``because(I,C)`` for each of its causes,
        ``unexplained(I,O)`` for each observation that it leaves open, and, of those that weigh as
        much as the best one, ``certain(C)`` if C is in all and ``possible(C)`` if C is in some.

        Args:
            case: The last argument of its facts.
            most: How many explanations at most, a number from 1 on.
            margin: How much more than the best one they weigh at most, a number from 0 on.

        Raises:
            ValueError: An atom of the case is no fact, a surprise is no whole number from 1 to
                :data:`MOST_SURPRISING`, or is said twice, or all of them are too large together;
                the numbers are wrong; or others were asked for since.
        """
        asked = most, margin
        if asked not in self._found.get(case, {}):
            limits = _whole(most, 1, "explanations"), _whole(margin, 0, "explanations")
            try:
                self._read()
            except ValueError:
                self.forget()  # so that it is refused again
                raise
            if case in self._old:
                raise ValueError(f"the case {shorten(str(case))} was asked for too long ago")
            terms = _terms(diagnose(self._cases.get(case, []), *limits))
            self._found.setdefault(case, {})[asked] = terms
            self._found.move_to_end(case)
            if len(self._found) > _MOST_CASES:
                old, _ = self._found.popitem(last=False)
                self._cases.pop(old, None)
                self._old.add(old)
        return self._found[case][asked]

    def _read(self) -> None:
        """Reads the facts that have come since the last time."""
        weights: Dict[Tuple[Symbol, Symbol], int] = {}
        for name, arity in _ARITIES.items():
            for arguments in self._new_facts.read(name, arity):
                *rest, case = arguments
                if name == "cause":
                    cause, weight = rest
                    number = _whole(weight, 1, Function(name, arguments), MOST_SURPRISING)
                    if weights.setdefault((case, cause), number) != number:
                        raise ValueError(f"{shorten(str(cause))} has two surprises in a case")
                self._cases.setdefault(case, []).append((name, tuple(rest)))
        totals: Dict[Symbol, int] = {}
        for (case, _), number in weights.items():
            totals[case] = totals.get(case, 0) + number
            if totals[case] > _LARGEST_SUM:
                raise ValueError(
                    f"the causes of the case {shorten(str(case))} have surprises of more than "
                    f"{_LARGEST_SUM} together; say smaller ones"
                )


def _whole(symbol: Symbol, least: int, where: object, most: int = LARGEST) -> int:
    """Reads a whole number from ``least`` to ``most``.

    Raises:
        ValueError: It is none.
    """
    if symbol.type is not SymbolType.Number or not least <= symbol.number <= most:
        raise ValueError(
            f"{shorten(str(where))} has {shorten(str(symbol))} where a whole number from {least} "
            f"to {most} belongs"
        )
    return symbol.number


def _terms(diagnosis: Diagnosis[Symbol]) -> List[Symbol]:
    terms = []
    for number, one in enumerate(diagnosis.kept, 1):
        place = Number(number)
        terms.append(Function("weighs", [place, Number(one.weight)]))
        terms += [Function("because", [place, cause]) for cause in one.causes]
        terms += [Function("unexplained", [place, left]) for left in one.unexplained]
    terms += [Function("certain", [cause]) for cause in sorted(diagnosis.certain)]
    terms += [Function("possible", [cause]) for cause in sorted(diagnosis.possible)]
    return terms
