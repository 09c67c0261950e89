"""Tokens: idempotency keys of actions, by which answers are matched to them. Needs no ROS.

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

Said = Tuple[str, str]
"""The node that has said something, and the value."""


@dataclass(frozen=True)
class Told:
    """An action that an actuator was told to do, with its token and answer.

    Attributes:
        number: Counts the actions of a run, from 1.
        step: The step in which it was published, since the last reset.
        actuator: Who is to act.
        action: What to do.
        aborted: Whether it is to stop.
        answer: The answer that was taken; None as long as none was.
        tokened: The node and the value of an answer that has come with the token.
        plain: Those of one that has come without.
    """

    number: int
    step: int
    actuator: str
    action: str
    aborted: bool = False
    answer: Optional[str] = None
    tokened: Optional[Said] = None
    plain: Optional[Said] = None


@dataclass
class TokensState:
    """Saved state of :class:`Tokens`.

    Attributes:
        run: The id of the run, which it keeps when it goes on after a restart.
        number: That of the last action.
        last: What each actuator was told last, by the actuator.
        twofold: The nodes that have answered an action both with its token and without, by the
            actuator.
        owed: Those of them that have answered the action before with its token only, likewise:
            their next answer without a token is to that.
    """

    run: str = field(default_factory=lambda: uuid.uuid4().hex)
    number: int = 0
    last: Dict[str, Told] = field(default_factory=dict)
    twofold: Dict[str, Set[str]] = field(default_factory=dict)
    owed: Dict[str, str] = field(default_factory=dict)


class Tokens(TokensState):
    """Gives actions their tokens, and matches answers to actions.

    Only the loop's thread uses it.

    Attributes:
        changed: Whether there is a change that was not published.
    """

    def __init__(self) -> None:
        super().__init__()
        self.changed = False

    @property
    def told(self) -> List[Told]:
        """The last action of each actuator, ordered by number."""
        return sorted(self.last.values(), key=lambda told: told.number)

    def begin(self, action: Action) -> None:
        """Gives an action that is about to be published its token."""
        self.number += 1
        actuator = action.actuator
        self._close(actuator)
        self.last[actuator] = Told(self.number, action.step, actuator, action.name)
        self.changed = True

    def _close(self, actuator: str) -> None:
        """Draws conclusions from how an actuator's last action was answered."""
        self.owed.pop(actuator, None)
        told, twofold = self.last.get(actuator), self.twofold.get(actuator, set())
        if told is None or told.tokened == told.plain:
            return
        if told.tokened is None:
            assert told.plain is not None
            twofold.discard(told.plain[0])
        elif told.tokened[0] and told.tokened[0] in twofold:
            self.owed[actuator] = told.tokened[0]

    def abort(self, actuator: str) -> None:
        """Marks an actuator's action as aborted."""
        told = self.last.get(actuator)
        if told is not None and told.answer is None:
            self.last[actuator] = replace(told, aborted=True)
            self.changed = True

    def is_aborted(self, actuator: str) -> bool:
        """Whether an actuator that has not answered was told to stop what it does."""
        told = self.last.get(actuator)
        return told is not None and told.answer is None and told.aborted

    def take(self, actuator: str, value: str) -> None:
        """Records a value that was taken as the answer to an actuator's action, if it owes one.

        Args:
            actuator: Who has said it, if it is an actuator at all.
            value: What it has said.
        """
        told = self.last.get(actuator)
        if told is not None and told.answer is None:
            self.last[actuator] = replace(told, answer=value)
            self.changed = True

    def resolve(self, items: Sequence[Item]) -> Tuple[List[Taken], List[str]]:
        """Resolves answers with tokens to messages, and drops duplicates and misfits.

        Args:
            items: What has come, in order.

        Returns:
            What the loop is to take, and why the rest is dropped. An answer that was taken before
            and comes again is in neither.
        """
        taken: List[Taken] = []
        dropped: List[str] = []
        for item in items:
            if isinstance(item, Answer):
                self._resolve_answer(item, taken, dropped)
            elif not isinstance(item, Message) or self._is_news(item, dropped):
                taken.append(item)
        return taken, dropped

    def _resolve_answer(self, answer: Answer, taken: List[Taken], dropped: List[str]) -> None:
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
        said = (answer.sender, _canonical(answer.value))
        heard = [one[1] for one in (told.tokened, told.plain) if one is not None]
        if told.answer is not None and told.answer != said[1]:
            dropped.append(f"{name}{told.actuator} has answered {shorten(told.answer)} already")
            return
        if told.answer is None and said[1] not in heard:
            taken.append(Message(told.actuator, answer.value, answer.sender))
        self._hear(replace(told, tokened=said))

    def _is_news(self, message: Message, dropped: List[str]) -> bool:
        """Whether a message is new, and no duplicate of an answer with a token."""
        actuator, said = _canonical(message.id), (message.sender, _canonical(message.value))
        told = self.last.get(actuator)
        if told is None:
            return True
        if message.sender and self.owed.get(actuator) == message.sender:
            del self.owed[actuator]
            dropped.append(
                f"answer {shorten(message.value)} of {actuator} without a token: "
                f"{message.sender} has given it to the action before, with its token"
            )
            return False
        is_news = told.tokened != said
        self._hear(replace(told, plain=said))
        return is_news

    def _hear(self, told: Told) -> None:
        """Records an answer, and whether its node answers with and without token."""
        self.last[told.actuator] = told
        if told.tokened is not None and told.tokened == told.plain:
            self.twofold.setdefault(told.actuator, set()).add(told.tokened[0])


def _canonical(text: str) -> str:
    """Returns a term as clingo prints it, and other texts unchanged: they are dropped later."""
    try:
        return canonical(text)
    except TermError:
        return text
