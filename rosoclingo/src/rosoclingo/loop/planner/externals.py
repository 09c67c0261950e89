"""The planner's external events: which its encoding declares, and which are true."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Dict, Iterable, List, Sequence, Set, Tuple, Union

from rosclingo.errors import OutOfMemoryError
from rosclingo.wire.commands import AssignExternal, ReleaseExternal, Truth
from rosclingo.wire.term_text import last_number, split_term
from rosoclingo.loop.planner.demand import Pair
from rosoclingo.loop.planner.planner import Planner
from rosoclingo.loop.planner.vocabulary import ToldVocabulary, Vocabulary
from rosoclingo.loop.values.atoms import EVENT, QUERY, SAVE, event, query
from rosoclingo.loop.values.snapshot import take_over


@dataclass
class ExternalsState:
    """Saved state of :class:`PlannerExternals`.

    Attributes:
        grounded: The steps that are grounded; none before the planner is initialised.
        told: The events that were made true since the last plan was found, in order; each with
            whether it came from outside.
        lost: Whether the planner has lost what it was told, see :meth:`PlannerExternals.retell`.
    """

    grounded: Set[int] = field(default_factory=set)
    told: Dict[str, bool] = field(default_factory=dict)
    lost: bool = False
    _true: Set[str] = field(default_factory=set)  # events
    _kept: Set[str] = field(default_factory=set)  # other externals that the mode has made true
    _to_release: List[int] = field(default_factory=list)  # steps
    _seen_events: Vocabulary = field(default_factory=Vocabulary)


class PlannerExternals(ExternalsState):
    """Sets the planner's externals, and tracks which are grounded, true, or to be released.

    Used by the loop's thread, and by the callback that polls whether its search is to stop.

    Attributes:
        vocabulary: The events that the encoding declares.
    """

    def __init__(self, planner: Planner) -> None:
        super().__init__()
        self._planner = planner
        self.vocabulary: Union[Vocabulary, ToldVocabulary] = self._seen_events
        self._by_step: Dict[int, List[str]] = {}  # externals that can be released, when last seen
        self._seen = 0  # how many steps were grounded then

    def begin(self, slots: Sequence[str]) -> None:
        """Resets the externals when the planner is initialised with these slots."""
        self.restore(ExternalsState({0}), slots)

    def restore(self, saved: ExternalsState, slots: Sequence[str]) -> None:
        """Restores the externals of a run that was interrupted.

        Args:
            saved: What was known; of the same planner, which is restored already.
            slots: The ids that the planner has for goals.
        """
        take_over(self, saved)
        demand = self._planner.demand
        self.vocabulary = ToldVocabulary(demand, slots) if demand.tells else self._seen_events
        self._seen = 0

    # What the encoding knows.

    def read(self) -> Dict[str, Truth]:
        """Returns the planner's externals with their values."""
        externals = self._planner.externals()
        self.vocabulary.learn(externals, len(self.grounded))
        self._by_step = {}
        for atom, value in externals.items():
            step = last_number(atom)
            if step is not None and value is not Truth.TRUE and not atom.startswith(SAVE):
                self._by_step.setdefault(step, []).append(atom)
        self._seen = len(self.grounded)
        return externals

    def ask(self, pairs: Sequence[Pair]) -> None:
        """Asks the planner whether it knows events, in any step."""
        if self._planner.demand.tells:
            self._planner.declare(pairs)
        else:
            self.read()

    def knows(self, pairs: Sequence[Pair]) -> bool:
        """Returns whether the encoding is known to declare one of some events."""
        return self.vocabulary.knows(pairs, len(self.grounded))

    def is_sure(self, pairs: Sequence[Pair]) -> bool:
        """Returns whether :meth:`knows` is certain of some events; else ask the planner first."""
        return self.vocabulary.is_sure(pairs, len(self.grounded))

    def was_asked(self, source: str, content: str) -> bool:
        """Returns whether :meth:`is_declared` is certain of an event."""
        return self.vocabulary.declares((source, content)) is not None

    def declares(self, source: str, content: str) -> bool:
        """Returns whether the encoding declares an event itself; asks the planner if needed."""
        if not self.was_asked(source, content):
            self.ask([(source, content)])
        return self.is_declared(source, content)

    def is_declared(self, source: str, content: str) -> bool:
        """Returns whether the encoding is known to declare an event itself."""
        return bool(self.vocabulary.declares((source, content)))

    # The true events.

    def is_true(self, atom: str) -> bool:
        """Returns whether an event was made true since the last reset."""
        return atom in self._true

    @property
    def true(self) -> List[str]:
        """The true events, ordered by step."""
        return sorted(self._true, key=lambda atom: (last_number(atom) or 0, atom))

    @property
    def saved(self) -> List[str]:
        """The true events of the initial state."""
        return sorted(atom for atom in self._true if atom.startswith(SAVE))

    @property
    def kept(self) -> List[str]:
        """The true externals of the mode that are no events."""
        return sorted(self._kept)

    def make_true(self, atoms: List[str], *, from_outside: bool = False) -> List[Tuple[str, str]]:
        """Makes externals of the planner true, until the next reset.

        Args:
            atoms: The externals.
            from_outside: Whether a client has requested or announced this, who may be wrong;
                nothing else is ever taken back.

        Returns:
            The atoms that are no externals, each with the reason.
        """
        try:
            missing = self._planner.tell(atoms)
        except OutOfMemoryError:
            self.note_told(atoms, from_outside=from_outside)  # it is told them when it is back
            raise
        unknown = {atom for atom, _ in missing}
        told = [atom for atom in atoms if atom not in unknown]
        self.note_told(told, from_outside=from_outside)
        return missing

    def note_told(self, atoms: Sequence[str], *, from_outside: bool) -> None:
        """Records true events; a lost planner is told them later."""
        self._true.update(atoms)
        self.told.update(dict.fromkeys(atoms, from_outside))

    def note_taken_back(self, atom: str) -> None:
        """Records that an event is false again; a lost planner is never told it."""
        self._true.discard(atom)
        self.told.pop(atom, None)

    def make_true_soon(self, atoms: List[str]) -> List[Tuple[str, str]]:
        """Queues events that the planner surely declares, and tells it all others now.

        So the caller does not wait for the planner.
        """
        if self._planner.demand.tells:
            return self.make_true(atoms)
        known = [atom for atom in atoms if self.is_declared(*split_term(atom)[1][:2])]
        missing = self.make_true([atom for atom in atoms if atom not in known])
        self._planner.make_true_later(known)
        self.note_told(known, from_outside=False)
        return missing

    def from_outside(self) -> List[str]:
        """Returns the events that may be retracted, in the order in which they were told."""
        return [atom for atom, from_outside in self.told.items() if from_outside]

    def take_back(self, atom: str) -> None:
        """Retracts an event: makes its external false."""
        self._planner.assign([atom], Truth.FALSE)
        self.note_taken_back(atom)

    def note_assigned(self, atom: str, true: bool) -> None:
        """Records the value that the mode itself has given to an external."""
        noted = self._true if atom.startswith(EVENT) else self._kept
        if true:
            noted.add(atom)
        else:
            noted.discard(atom)

    def reset(self, fluents: Iterable[str]) -> bool:
        """Resets: makes fluents the initial ones, and forgets all other events.

        Returns:
            Whether the planner knows any of them now.
        """
        self._to_release.clear()  # those steps come again
        true = {event("save", fluent, 0) for fluent in fluents}
        if self._planner.demand.tells:
            self._restart(sorted(true))
        else:
            externals = self.read()
            true &= externals.keys()
            false = sorted(self._true.intersection(externals) - true)
            commands = [AssignExternal(atom, Truth.FALSE) for atom in false]
            commands += [AssignExternal(atom, Truth.TRUE) for atom in sorted(true)]
            self._planner.run(*commands)
        self._true = true
        self.told.clear()
        return bool(true)

    def _restart(self, saved: Sequence[str]) -> None:
        """Re-initialises the planner with saved events, because facts cannot be retracted."""
        self._planner.begin(saved)
        self._planner.ground_steps(sorted(self.grounded - {0}))
        self._planner.assign(self.kept, Truth.TRUE)

    def note_last_step(self, last: int) -> None:
        """Records the last step, and the horizon, for a planner that is lost.

        Args:
            last: The step, from the current one on.
        """
        self.grounded.intersection_update(range(last + 1))
        asks = any(atom.startswith(QUERY) for atom in self._kept)
        self._kept = {atom for atom in self._kept if not atom.startswith(QUERY)}
        if asks:
            self._kept.add(query(last))

    def retell(self) -> None:
        """Restarts a lost planner, and tells it the known steps and events.

        Raises:
            OutOfMemoryError: That needs more memory than it has; it can be tried again.
        """
        self._restart(self.saved)
        is_told_saved = self._planner.demand.tells
        events = [one for one in self.true if not (is_told_saved and one.startswith(SAVE))]
        self._true.difference_update(atom for atom, _ in self._planner.tell(events))
        self._seen = 0
        self.lost = False

    def can_be_saved(self) -> bool:
        """Returns whether the encoding takes initial states, as ``save`` events of fluents."""
        return self._planner.demand.tells or any(atom.startswith(SAVE) for atom in self.read())

    def can_save(self, fluents: Iterable[str]) -> bool:
        """Returns whether the encoding is known to declare the ``save`` event of each fluent."""
        return self._planner.demand.tells or all(
            self.knows([("save", fluent)]) for fluent in fluents
        )

    # Unused externals.

    def release(self, atom: str) -> None:
        """Makes an external false permanently, if there is one."""
        if atom in self.read():
            self._planner.run(ReleaseExternal(atom))
            self._seen = 0  # what was seen is out of date
        self.note_assigned(atom, False)

    def release_later(self, step: int) -> None:
        """Schedules the release of a step's unused externals.

        An encoding that is told its events has none for each step, but that of its query.
        """
        if not self._planner.demand.tells:
            self._to_release.append(step)

    def release_now(self) -> None:
        """Releases the unused externals of the scheduled steps.

        That takes a while, so it is done when the actions of the next step are on their way, and
        before the planner is asked for anything that it could change.
        """
        steps, self._to_release = self._to_release, []
        if steps and self._seen != len(self.grounded):
            self.read()
        release = [
            ReleaseExternal(atom)
            for step in steps
            for atom in self._by_step.pop(step, ())
            if atom not in self._true
            and atom not in self._kept
            and atom not in (query(step), event("info", "passed", step))
        ]
        if release:
            self._planner.run(*release)
