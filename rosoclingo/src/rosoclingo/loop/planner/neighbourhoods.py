"""Large neighbourhood search: the choices of a plan that are kept, and those that are free.

A plan says by terms ``keep(A,G,X)`` that its choice A, an atom, puts the group G, such as a task,
beside X; or, by ``choices(F,I)``, that each atom F(...) in the answer set is a choice that puts its
I-th argument beside itself. A neighbourhood is a set of free groups: the choices of all others are
assumed. By ``close(X,G)`` the plan says that G might be beside X instead. Then G is worth being
free if the group is that is beside X now.

>>> plan = Neighbourhood.of(["keep(next(a,b),b,a)", "keep(next(b,c),c,b)", "close(a,c)"])
>>> plan.groups
['b', 'c']
>>> [assumed.name for assumed in plan.assumptions({"b"})]
['next(b,c)']
"""

from __future__ import annotations

import random
from collections import defaultdict
from typing import AbstractSet, Dict, Iterator, List, Optional, Sequence, Set, Tuple

from rosclingo.wire.commands import Assumption
from rosclingo.wire.term_text import number, split_term

_KEEP, _CLOSE, _CHOICES = "keep(", "close(", "choices("
_CRITICAL, _RESTRICTED, _CONSTRUCTED = "critical(", "restricted", "constructed"
_SIZE = 8  # groups that are free at first
_CRITICAL_SIZE = 4  # of the first neighbourhood if only some are critical: searches are harder
_GROWTH = 1.25  # of that when all neighbourhoods have been tried
_SECONDS = 0.006  # for each free group that a search may take
_CRITICAL_SECONDS = 0.003
_CONFLICTS = 40  # for each free group that a search may have
_SHOW_SECONDS = 1.25  # after which the first better plan is shown
_LAST = 0.7  # of the groups are found from the one before


def says_choices(symbols: Sequence[str]) -> bool:
    """Returns whether an answer set shows its choices."""
    shown = next(shown_choices(symbols), None)
    return shown is not None or any(text.startswith(_KEEP) for text in symbols)


def shown_choices(symbols: Sequence[str]) -> Iterator[Tuple[str, str]]:
    """Yields the atoms that are choices by a term ``choices(F,I)``, each with its group.

    >>> list(shown_choices(["choices(pick,2)", "pick(a,5)", "put(a,6)"]))
    [('pick(a,5)', '5')]
    """
    groups: Dict[str, int] = {}
    for said in (split_term(text)[1] for text in symbols if text.startswith(_CHOICES)):
        if len(said) == 2:
            groups[said[0]] = number(said[1]) or 0
    for text in symbols if groups else ():
        name = text.partition("(")[0]
        if name in groups:
            arguments = split_term(text)[1]
            if 1 <= groups[name] <= len(arguments):
                yield text, arguments[groups[name] - 1]


def is_restricted(symbols: Sequence[str]) -> bool:
    """Returns whether the encoding's restrictions may exclude better plans."""
    return _RESTRICTED in symbols


def is_constructed(symbols: Sequence[str]) -> bool:
    """Returns whether a plan was not searched for, so that its cost is unknown."""
    return _CONSTRUCTED in symbols


class Neighbourhood:
    """The choices of one plan and the groups that they belong to. Immutable.

    Attributes:
        groups: The groups, in order.
        critical: Those around which a neighbourhood may have a better plan, in order.
    """

    def __init__(
        self,
        choices: Sequence[Tuple[str, str, str]],
        close: Sequence[Tuple[str, str]],
        critical: AbstractSet[str] = frozenset(),
    ) -> None:
        """Makes the neighbourhoods of a plan.

        Args:
            choices: Choices with their groups, and what those are beside.
            close: What a group might be beside, with the group.
            critical: Groups without which nothing is better; empty if that is not said.
        """
        self._choices: Dict[str, str] = {choice: group for choice, group, _ in choices}
        self._beside: Dict[str, List[str]] = defaultdict(list)
        for _, group, other in choices:
            self._beside[group].append(other)
        self.groups: List[str] = sorted(self._beside)
        self.critical = [group for group in self.groups if group in critical] or self.groups
        self._close: Dict[str, List[str]] = defaultdict(list)
        for other, group in close:
            if group in self._beside:
                self._close[other].append(group)

    @classmethod
    def of(cls, symbols: Sequence[str]) -> Optional[Neighbourhood]:
        """Reads an answer set; None if it shows no choices."""
        names = (_KEEP, _CLOSE, _CRITICAL)
        terms = [split_term(text) for text in symbols if text.startswith(names)]
        choices = [(a[0], a[1], a[2]) for name, a in terms if name == "keep" and len(a) == 3]
        choices += [(atom, group, group) for atom, group in shown_choices(symbols)]
        close = [(a[0], a[1]) for name, a in terms if name == "close" and len(a) == 2]
        critical = {a[0] for name, a in terms if name == "critical" and len(a) == 1}
        return cls(choices, close, critical) if choices else None

    def assumptions(self, free: AbstractSet[str]) -> List[Assumption]:
        """Returns the assumptions that fix all groups but the free ones."""
        return [
            Assumption(choice, True) for choice, group in self._choices.items() if group not in free
        ]

    def around(self, seed: str, size: int, dice: random.Random) -> Set[str]:
        """Returns groups that are worth freeing together.

        Args:
            seed: One of them.
            size: How many there are to be.
            dice: Draws which ones.
        """
        free = {seed}
        open_groups = [seed]
        while open_groups and len(free) < min(size, len(self.groups)):
            is_last = dice.random() < _LAST
            group = open_groups[-1] if is_last else dice.choice(open_groups)
            others = [g for x in self._beside[group] for g in self._close[x] if g not in free]
            if not others:
                open_groups.remove(group)
                continue
            group = dice.choice(others)
            free.add(group)
            open_groups.append(group)
        others = [group for group in self.groups if group not in free]
        free.update(dice.sample(others, max(0, min(len(others), size - len(free)))))
        return free


class Neighbourhoods:
    """Order and limits of the neighbourhoods, from small to large ones. Not thread-safe.

    Attributes:
        size: How many groups are free in the next one.
    """

    def __init__(self) -> None:
        self.size = _SIZE
        self._seconds = _SECONDS
        self.dice = random.Random(1)  # noqa: S311 (a draw, not a secret)
        self._known: Set[str] = set()  # groups of earlier searches
        self._show_seconds = _SHOW_SECONDS

    @property
    def seconds(self) -> float:
        """Time limit of one neighbourhood's search, in seconds."""
        return self.size * self._seconds

    @property
    def conflicts(self) -> int:
        """Conflict limit of one neighbourhood's search."""
        return self.size * _CONFLICTS

    def begin(self, plan: Neighbourhood) -> List[str]:
        """Starts with a plan.

        Returns:
            The groups that no plan before had, unless there was none.
        """
        is_hard = len(plan.critical) < len(plan.groups)
        self.size = _CRITICAL_SIZE if is_hard else _SIZE
        self._seconds = _CRITICAL_SECONDS if is_hard else _SECONDS
        new = [group for group in plan.groups if group not in self._known] if self._known else []
        self._known = set(plan.groups)
        return new

    def note_news(self) -> None:
        """Notes an input, so that the next better plan is shown soon."""
        self._show_seconds = _SHOW_SECONDS

    def until_shown(self) -> float:
        """Returns how long a better plan may be held back; doubles each time."""
        seconds, self._show_seconds = self._show_seconds, 2 * self._show_seconds
        return seconds

    def seeds(self, plan: Neighbourhood) -> List[str]:
        """Returns the groups around which neighbourhoods are tried, in order."""
        rounds = -(-len(plan.groups) // len(plan.critical))
        return [
            seed
            for _ in range(rounds)
            for seed in self.dice.sample(plan.critical, len(plan.critical))
        ]

    def grow(self) -> None:
        """Grows the neighbourhoods, after all of a size were tried in vain."""
        self.size = int(self.size * _GROWTH)
