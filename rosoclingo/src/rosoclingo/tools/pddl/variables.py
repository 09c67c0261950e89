"""Variables of a planning task with readable names and values.

A variable of the translator is a group of atoms of which exactly one holds. Its name says what they
have in common: ``at(truck,a)`` and ``at(truck,b)`` are the values ``a`` and ``b`` of ``at(truck)``;
``at(box,a)`` and ``in(box,truck)`` are the values with these names of ``at_or_in(box)``; and
``open`` alone is a variable with the values ``yes`` and ``no``.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import List, Optional, Sequence, Set, Tuple

from rosoclingo.tools.pddl.names import Identifiers

_ATOM = re.compile(r"(Negated)?Atom ([^(\s]+)\((.*)\)")
_NONE, _YES, _NO = "none", "yes", "no"


@dataclass(frozen=True)
class Atom:
    """A ground atom of PDDL."""

    predicate: str
    objects: Tuple[str, ...]


@dataclass(frozen=True)
class Variable:
    """A variable in terms of clingo.

    Attributes:
        name: Its term.
        values: Those of its values.
        atoms: The atom that each value stands for; None if none of them holds.
    """

    name: str
    values: Tuple[str, ...]
    atoms: Tuple[Optional[Atom], ...]

    @property
    def other(self) -> Optional[str]:
        """The value by which none of the atoms holds, if there is one."""
        return next((x for x, atom in zip(self.values, self.atoms) if atom is None), None)


def read_atom(value: str) -> Optional[Atom]:
    """Returns the atom of a value of the translator; None for one by which none holds."""
    match = _ATOM.fullmatch(value)
    if match is None or match[1]:
        return None
    return Atom(match[2], tuple(match[3].split(", ")) if match[3] else ())


def variables(groups: Sequence[Sequence[str]], names: Identifiers) -> List[Variable]:
    """Returns the variables of a task.

    Args:
        groups: The values of each one, as the translator calls them.
        names: Has terms for all names.
    """
    taken: Set[str] = set()
    result = []
    for number, values in enumerate(groups, 1):
        atoms = tuple(read_atom(value) for value in values)
        variable = _named(atoms, names)
        if variable.name in taken or len(set(variable.values)) < len(atoms):
            terms = (_NONE if a is None else names.term(a.predicate, a.objects) for a in atoms)
            variable = Variable(f"variable({number})", tuple(terms), atoms)
        taken.add(variable.name)
        result.append(variable)
    return result


def _named(atoms: Tuple[Optional[Atom], ...], names: Identifiers) -> Variable:
    there = [atom for atom in atoms if atom is not None]
    first = there[0]
    if len(there) == 1:
        name = names.term(first.predicate, first.objects)
        return Variable(name, tuple(_NO if atom is None else _YES for atom in atoms), atoms)
    place = _only_difference(there)
    if place is not None:
        rest = first.objects[:place] + first.objects[place + 1 :]
        values = (_NONE if atom is None else names.term(atom.objects[place]) for atom in atoms)
        return Variable(names.term(first.predicate, rest), tuple(values), atoms)
    common = [o for o in first.objects if all(o in atom.objects for atom in there)]
    predicates = dict.fromkeys(names.term(atom.predicate) for atom in there)
    objects = ",".join(names.term(each) for each in dict.fromkeys(common))
    name = "_or_".join(predicates) + (f"({objects})" if objects else "")
    terms = (_NONE if atom is None else names.term(atom.predicate, atom.objects) for atom in atoms)
    return Variable(name, tuple(terms), atoms)


def _only_difference(atoms: Sequence[Atom]) -> Optional[int]:
    """Returns at which place alone atoms of the same predicate differ, if there is one."""
    if len({(atom.predicate, len(atom.objects)) for atom in atoms}) > 1:
        return None
    columns = list(zip(*(atom.objects for atom in atoms)))
    places = [place for place, column in enumerate(columns) if len(set(column)) > 1]
    return places[0] if len(places) == 1 else None
