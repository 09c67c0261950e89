"""The base class of interfaces: one method for each action. Needs no ROS."""

from __future__ import annotations

from typing import Any, Mapping, Optional, Sequence, Tuple, Union

import clingo

from rosclingo.errors import TermError
from rosclingo.solver.terms import parse_term, quote
from rosoclingo.loop.mode.dispatch import bind, find
from rosoclingo.loop.values.served import ServedGoal
from rosoclingo.loop.words import FAILURE, SUCCESS, UNKNOWN
from rosoclingo_interfaces.errors import ActionError
from rosoclingo_interfaces.execution import ActionExecution, current

ActuatorAnswer = Union[bool, str]

AGAIN = "again"
"""After a crash: the action is done again, because it is idempotent."""

FAIL = "fail"
"""After a crash: the answer is ``failure``, because half an action counts as none."""

AFTER_CRASH = (AGAIN, FAIL, UNKNOWN)
"""Policies for an action in which an interface has crashed; the last one is an answer."""


class ActionInterface:
    """Executes the actions of one or more actuators.

    A subclass has a method for each action, which is called in a thread of its own::

        class Mailbot(ActionInterface):
            actuators = ("mailbot",)

            def go(self, waypoint: str) -> bool:
                while not self._drive_towards(waypoint):
                    self.sleep(0.1)
                return True

        run(Mailbot, "mailbot_interface")

    The action ``go(c3)`` calls ``go("c3")``. An argument that is a number becomes an int, a string
    becomes its text, and any other term becomes the text that clingo prints for it. A method
    returns True for the answer ``success``, False for ``failure``, or another answer as the text of
    a term. Whatever it raises is logged and answers ``failure``.

    A method that takes long looks at :attr:`canceled` now and then, or waits with :meth:`sleep`
    only, and stops what the robot does in a ``finally``. For an action whose name is a Python
    keyword, or a name that this class has, such as ``sleep``, the method is ``sleep_``. Methods
    that are no actions begin with an underscore.

    An action has a token, and is done once by a node. If the node has a ``~store`` and crashes in
    an action, ``after_crash`` says whether it is done again. Without a store, or by a rosoclingo
    that knows no tokens, an action that was not answered comes again, and so does the last one: a
    method should return True at once if there is nothing to do.

    Attributes:
        actuators: Ids of the actuators whose actions are done; none means those of all.
        messages: Ids of the messages that are sent besides answers, such as ``info``.
        leaves_unknown: Whether an action without a method is left to another node of the same
            actuator, and not answered with ``failure``.
        after_crash: For the names of actions: what to do if the node has crashed in one, and its
            outcome is unknown. ``again`` does it again, ``fail`` answers ``failure``, ``unknown``
            answers that. Those that are not named: ``again`` for ``go``, else ``unknown``.
        timeout: Longest time from an action to its answer, in seconds, unless the node's parameter
            ``~timeout`` says otherwise; 0 for no limit.
    """

    actuators: Sequence[str] = ()
    messages: Sequence[str] = ()
    after_crash: Mapping[str, str] = {}
    timeout = 0.0
    leaves_unknown = False

    @property
    def execution(self) -> ActionExecution:
        """The action that runs in this thread; may be handed to others."""
        return current()

    @property
    def actuator(self) -> str:
        """The actuator of the action that runs in this thread."""
        return current().actuator

    @property
    def canceled(self) -> bool:
        """True if the action that runs in this thread was cancelled."""
        return current().canceled.is_set()

    @property
    def served_goals(self) -> Tuple[ServedGoal, ...]:
        """The goals that the action serves which runs in this thread: those whose slots it names.

        Of ``pick(1)``, that is the goal in slot 1, with its ``slot``, ``request``, ``goal_id`` and
        ``information``, as they were when the action was published. None if the action names no
        slot of a goal, or comes without a token. The first access may wait for 2 s.
        """
        return current().served_goals

    @property
    def served_goal(self) -> Optional[ServedGoal]:
        """The first of :attr:`served_goals`; None if there is none."""
        return next(iter(current().served_goals), None)

    def report_progress(self, part: float) -> None:
        """Reports the done part of the running action, of which clients are told.

        Args:
            part: From 0 to 1.
        """
        current().progress = min(max(0.0, part), 1.0)

    def sleep(self, seconds: Optional[float] = None) -> None:
        """Waits some time of the node's clock, or for ever.

        Raises:
            CanceledError: The action is to stop; let it pass.
        """
        current().sleep(seconds)

    def knows(self, action: clingo.Symbol) -> bool:
        """Returns whether this interface has a method for an action, maybe with other arguments."""
        return find(self, action, ActionInterface) is not None

    def outcome_after_crash(self, action: clingo.Symbol) -> str:
        """Returns one of :data:`AFTER_CRASH` for an action, by ``after_crash``."""
        name = action.name if action.type is clingo.SymbolType.Function else ""
        return {"go": AGAIN, **self.after_crash}.get(name, UNKNOWN)

    def perform(self, action: clingo.Symbol) -> ActuatorAnswer:
        """Executes an action, in a thread of its own; calls the action's method.

        Raises:
            DispatchError: There is no such method, or not with these arguments.
        """
        return bind(self, action, "action", base=ActionInterface, value=_value)()


def answer_text(answer: Any) -> str:
    """Converts the return value of an interface's method to an answer.

    Raises:
        ActionError: It is no answer.
    """
    if isinstance(answer, bool):
        return SUCCESS if answer else FAILURE
    if not isinstance(answer, str):
        raise ActionError(
            f"the method returned {answer!r}, where True, False or the text of a term is expected"
        )
    try:
        return str(parse_term(answer))
    except TermError as err:
        raise ActionError(f"the method's answer {quote(answer)} cannot be sent: {err}") from err


def _value(argument: clingo.Symbol) -> Union[int, str]:
    if argument.type is clingo.SymbolType.Number:
        return argument.number
    if argument.type is clingo.SymbolType.String:
        return argument.string
    return str(argument)
