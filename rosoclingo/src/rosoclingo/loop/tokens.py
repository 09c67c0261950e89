"""What each actuator was told to do last, and the token of each action. Needs no ROS.

A token is the run's id and the action's number in the run. It stays the same when the action is
published again, so that an interface can do it once. See docs/protocol.md, section "Tokens".

>>> tokens = Tokens()
>>> tokens.begin(Action("robot", "go(3)", 1))
>>> answer = Answer(tokens.run, 1, "success")
>>> tokens.resolve([answer])
([Message(id='robot', value='success', sender='')], [])
>>> tokens.take("robot", "success")
>>> tokens.resolve([answer])
([], [])
>>> tokens.resolve([Answer(tokens.run, 1, "failure")])[1]
['answer failure to action 1: robot has answered success already']
"""

from __future__ import annotations

import uuid
from dataclasses import dataclass, field, replace
from typing import Dict, List, Optional, Sequence, Set, Tuple

from rosclingo.errors import TermError, shorten
from rosoclingo.loop.atoms import Action, canonical
from rosoclingo.loop.inbox import Answer, Item, Message, Taken

TOKENS_HEADER = "answers_with_tokens"
"""A field of a connection's header on ``~in``: the node sends its answers with tokens, too."""


@dataclass(frozen=True)
class Told:
    """An action that an actuator was told to do.

    Attributes:
        number: Counts the actions of a run, from 1.
        step: The step in which it was published, since the last reset.
        actuator: Who is to act.
        action: What to do.
        aborted: Whether it is to stop.
        answer: What was answered; None as long as nothing was.
    """

    number: int
    step: int
    actuator: str
    action: str
    aborted: bool = False
    answer: Optional[str] = None


@dataclass
class TokensState:
    """All that is saved of :class:`Tokens`.

    Attributes:
        run: The id of the run, which it keeps when it goes on after a restart.
        number: That of the last action.
        last: What each actuator was told last, by the actuator.
        nodes: The nodes that have answered with tokens, by the actuator.
    """

    run: str = field(default_factory=lambda: uuid.uuid4().hex)
    number: int = 0
    last: Dict[str, Told] = field(default_factory=dict)
    nodes: Dict[str, Set[str]] = field(default_factory=dict)


class Tokens(TokensState):
    """Gives actions their tokens, and knows which answers belong to them.

    Only the loop's thread uses it.

    Attributes:
        changed: Whether there is something that was not shown yet.
    """

    def __init__(self) -> None:
        super().__init__()
        self.changed = False
        self._noted: Set[Tuple[str, str]] = set()  # actuators and nodes of which that was said

    @property
    def told(self) -> List[Told]:
        """What each actuator was told last, in the order of the numbers."""
        return sorted(self.last.values(), key=lambda told: told.number)

    def begin(self, action: Action) -> None:
        """Gives an action that is about to be published its token."""
        self.number += 1
        actuator = action.actuator
        self.last[actuator] = Told(self.number, action.step, actuator, action.name)
        self.changed = True

    def abort(self, actuator: str) -> None:
        """Takes note that an actuator is to stop what it does."""
        told = self.last.get(actuator)
        if told is not None and told.answer is None:
            self.last[actuator] = replace(told, aborted=True)
            self.changed = True

    def take(self, actuator: str, value: str) -> None:
        """Takes note that what an actuator has said was taken, which is its answer if it owes one.

        Args:
            actuator: Who has said it, if it is an actuator at all.
            value: What it has said.
        """
        told = self.last.get(actuator)
        if told is not None and told.answer is None:
            self.last[actuator] = replace(told, answer=value)
            self.changed = True

    def resolve(self, items: Sequence[Item]) -> Tuple[List[Taken], List[str]]:
        """Makes messages of answers with tokens; each answer is left once.

        Args:
            items: What has come, in order.

        Returns:
            What the loop is to take, and why the rest is dropped. An answer that was taken before
            and comes again is in neither.
        """
        taken: List[Taken] = []
        dropped: List[str] = []
        new: Dict[str, Set[str]] = {}  # what actuators have answered in these items
        for item in items:
            if isinstance(item, Answer):
                self._resolve_answer(item, new, taken, dropped)
            elif not isinstance(item, Message) or self._is_alone(item, new, dropped):
                taken.append(item)
        return taken, dropped

    def _resolve_answer(
        self, answer: Answer, new: Dict[str, Set[str]], taken: List[Taken], dropped: List[str]
    ) -> None:
        told = next((one for one in self.last.values() if one.number == answer.number), None)
        name = f"answer {shorten(answer.value)} to action {answer.number}: "
        if answer.run != self.run:
            dropped.append(f"{name}it is of the run {shorten(answer.run)}, and this is {self.run}")
            return
        if told is None:
            is_old = 0 < answer.number <= self.number
            why = "its actuator was told something else since then" if is_old else "there is none"
            dropped.append(f"{name}{why}")
            return
        if answer.sender:
            self.nodes.setdefault(told.actuator, set()).add(answer.sender)
        value, values = _canonical(answer.value), new.setdefault(told.actuator, set())
        if told.answer is None and value not in values:
            values.add(value)
            taken.append(Message(told.actuator, answer.value, answer.sender))
        elif told.answer not in (None, value):
            dropped.append(
                f"{name}{told.actuator} has answered {shorten(told.answer or '')} already"
            )

    def _is_alone(self, message: Message, new: Dict[str, Set[str]], dropped: List[str]) -> bool:
        """Whether a message on ``~in`` is not an answer that comes with its token, too."""
        source = _canonical(message.id)
        told = self.last.get(source)
        if told is None:
            return True
        value, values = _canonical(message.value), new.setdefault(source, set())
        if message.sender and message.sender in self.nodes.get(source, ()):
            pair = (source, message.sender)
            if value != told.answer and value not in values and pair not in self._noted:
                self._noted.add(pair)
                dropped.append(
                    f"answer {shorten(message.value)} of {source} without a token: "
                    f"{message.sender} answers with tokens; this is said once"
                )
            return False
        if told.answer is None:
            values.add(value)
        return True


def _canonical(text: str) -> str:
    """Returns a term as clingo prints it; what is none is dropped later, with the reason."""
    try:
        return canonical(text)
    except TermError:
        return text
