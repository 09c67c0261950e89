"""A loop and the world around it, all in one thread.

Nothing happens at the same time, so that what the world does determines the whole run. As long as
a subclass does not say what that is, each action succeeds:

>>> from rosclingo.solver.options import Options
>>> from rosoclingo.in_process.parts import EXAMPLES, make_parts
>>> parts = make_parts("dynamic.incremental.recording", Options((f"{EXAMPLES}/line.lp",)))
>>> system = System(parts.loop)
>>> goal = system.request("visit(2)")
>>> system.run()
>>> goal.words, system.published
(['accepted', 'succeeded'], [('robot', 'go(2)')])
"""

from __future__ import annotations

import math
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple

from rosclingo.errors import RosclingoError
from rosoclingo.errors import ShutdownError
from rosoclingo.loop import journal
from rosoclingo.loop.inputs.inbox import Inbox
from rosoclingo.loop.journal import Entry, MessageArrived
from rosoclingo.loop.loop import Loop
from rosoclingo.loop.values.environment import Environment
from rosoclingo.loop.values.goals import Goal, GoalClient
from rosoclingo.loop.words import ABORT, SOLVER, SUCCESS

_MOST_SECONDS = 40.0  # of work, that a plan may take for further goals; time stands still then


class Request(Goal, GoalClient):
    """A goal that remembers what its client is told.

    Attributes:
        words: The statuses, in order.
        lines: The feedback, in order.
    """

    def __init__(
        self,
        request: str,
        information: Sequence[str] = (),
        identifier: str = "",
        note: Callable[[journal.Event], None] = lambda _: None,
    ) -> None:
        """Makes a goal, without sending it.

        Args:
            request: The request, a ground term as clingo prints it.
            information: What comes with it.
            identifier: What the client calls it.
            note: Adds an event to the journal.
        """
        super().__init__(request, information, identifier, self)
        self.words: List[str] = []
        self.lines: List[str] = []
        self._note = note

    def noted(self, change: journal.StatusSet) -> None:
        """Adds the status to the journal."""
        self._note(change)

    def changed(self, change: journal.StatusSet) -> None:
        """Remembers the status."""
        self.words.append(change.status.value)

    def feedback(self, line: str) -> None:
        """Remembers the line."""
        self.lines.append(line)


class System(Inbox, Environment):
    """A loop, and a simulated world that has its turn whenever the loop waits.

    One thread makes the calls.

    Attributes:
        loop: The loop.
        clock: What time it is, in seconds since the beginning; it moves with the turns of a
            subclass, and where the loop itself has to wait.
        elapsed: How many steps have begun since the beginning, whatever a reset calls them.
        journal: What the loop has learned and done; the times are those of the clock, but how long
            a command took is real time.
        published: All actions published, with their actuators, in order.
        acting: For each actuator that acts, its action.
        warnings: What the loop has warned of.
        goals: What was asked for, in order; the ids are the numbers, from 1.
    """

    def __init__(self, make: Callable[..., Loop], **parameters: Any) -> None:
        """Makes the loop, which runs by :meth:`run`.

        Args:
            make: Makes a loop of its inbox and environment, such as :meth:`.parts.Parts.loop`.
            parameters: Further arguments for it.
        """
        super().__init__()
        self.clock = 0.0
        self.elapsed = 0
        self.journal: List[Entry] = []
        self.published: List[Tuple[str, str]] = []
        self.acting: Dict[str, str] = {}
        self.warnings: List[str] = []
        self.goals: List[Request] = []
        self._step = 0
        self._is_prepared = False
        self.loop = make(self, self, **parameters)
        self.loop.state.planner.most_seconds = _MOST_SECONDS

    # What a subclass says.

    def turn(self) -> bool:
        """The world's turn while the loop waits; here, all actions succeed.

        Returns:
            Whether it did something; if not, the run is over.
        """
        for actuator in sorted(self.acting):
            self.answer(actuator)
        return bool(self._items)

    def stays_quiet(self, seconds: float) -> bool:
        """Nothing comes but in the world's turn."""
        return True

    # What a user calls.

    def request(self, text: str, information: Sequence[str] = ()) -> Request:
        """Sends a goal with a request, a ground term as clingo prints it."""
        goal = self.new_goal(text, information, str(len(self.goals) + 1))
        self.goals.append(goal)
        self.put(goal)
        return goal

    def new_goal(self, text: str, information: Sequence[str], identifier: str) -> Request:
        """Returns a new goal; a subclass may have a class of its own."""
        return Request(text, information, identifier, self.note_event)

    def tell(self, source: str, value: str) -> None:
        """Sends a message."""
        self.put(MessageArrived(source, value))

    def answer(self, actuator: str, value: str = SUCCESS) -> str:
        """Answers the action of an actuator that acts, and returns the action."""
        action = self.acting.pop(actuator)
        self.tell(actuator, value)
        return action

    def run(self) -> Optional[RosclingoError]:
        """Runs until the world has nothing to do while the loop waits; may be called again then.

        Returns:
            Why the loop ended, if it did so by itself.
        """
        self._closed = False
        try:
            if not self._is_prepared:
                self._is_prepared = True
                self.loop.prepare()
            while not self.closed:
                self.step()
        except ShutdownError:
            return None
        except RosclingoError as err:
            self.loop.end(str(err))
            return err
        return None

    def step(self) -> None:
        """Lets the loop make one decision and carry it out."""
        self.loop.step()

    # What the loop calls.

    @property
    def may_hold(self) -> bool:
        """True if the loop may leave inputs in the inbox; not here, where time stands still."""
        return False

    def wait(self, timeout: float) -> bool:
        """Gives the world its turn, unless there is an item; ends if it does nothing.

        Before that, the pauses of retries pass, and the times of alarms for which goals may wait.
        """
        if not (self._has_something() or self.turn()):
            moments = self.own_moments()
            if moments:
                self.clock = max(self.clock, min(moments))
            else:
                self.close()
        return True

    def own_moments(self) -> List[float]:
        """Returns the next times at which the loop acts by itself, whatever the world does."""
        state = self.loop.state
        moments = [one.retry_at for one in state.executions.retrying]
        if state.goals.open or state.goals.queued:
            moments.append(state.alarms.next())
        return [moment for moment in moments if moment < math.inf]

    def now(self) -> float:
        """Returns the time."""
        return self.clock

    def publish(self, actuator: str, action: str) -> None:
        """Records a published action, whose actuator acts until it answers."""
        self.published.append((actuator, action))
        if actuator != SOLVER and action != ABORT:
            self.acting[actuator] = action

    def note(self, record: journal.Record) -> None:
        """Adds an event to the journal."""
        self.elapsed += max(0, record.step - self._step)
        self._step = record.step
        number = len(self.journal) + 1
        self.journal.append(Entry(record.event, record.step, record.horizon, number, self.clock))

    def note_event(self, event: journal.Event) -> None:
        """Adds an event to the journal, in the loop's step."""
        self.loop.state.note(event)

    def warn(self, text: str) -> None:
        """Records a warning of the loop."""
        self.warnings.append(text)
