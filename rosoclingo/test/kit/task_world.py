"""Random worlds around an encoding of ``actions.lp``, which outlive the process and judge it.

Actions fail or end in an unknown way, goals are cancelled, messages change facts, and processes
die. Nothing that begins may be impossible, and all goals have to end as they should.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Callable, Dict, List, Optional, Sequence, Set, Tuple

from crashes import Client, Life, World
from task_judge import Physics, Rules

from rosclingo.wire.term_text import split_term
from rosoclingo.loop.inputs.inbox import Item
from rosoclingo.loop.journal import AnswerArrived, MessageArrived, StatusSet
from rosoclingo.loop.values.execution import Execution

PACKAGES = Path(__file__).resolve().parents[3]
_CALM_AFTER = 60  # answers, after which nothing goes wrong any more


@dataclass(frozen=True)
class Domain:
    """An encoding and what may happen in it.

    Attributes:
        files: Its files.
        requests: Prefixes of the requests that are asked for; each is possible.
        news: Prefixes of messages which report that a fact has changed.
        unknown: Prefixes of actions whose outcome may stay unknown.
        full: Prefixes of numbers that a message refills when nothing else can be done.
        slots: For how many goals is planned.
        is_timed: Whether time goes by while robots act.
    """

    files: Sequence[str]
    requests: Tuple[str, ...]
    news: Tuple[str, ...] = ()
    unknown: Tuple[str, ...] = ()
    full: Tuple[str, ...] = ()
    slots: Sequence[int] = (1, 2, 3, 4)
    is_timed: bool = False


ENCODINGS = PACKAGES / "rosoclingo" / "test" / "encodings"
ASP = PACKAGES / "rosoclingo_aspprograms"
DOMAINS: Dict[str, Domain] = {
    "errands": Domain(
        [str(ENCODINGS / "errands.lp")], ("visit", "meet"), ("at(", "lamp("), ("go", "mend"),
    ),
    "kitchen": Domain(
        [str(ENCODINGS / "kitchen.lp")], ("meal",), ("stove(", "pot("),
        ("light", "wash"), ("gas", "plates"),
    ),
    "tugs": Domain(
        [str(ENCODINGS / "tugs.lp")], ("to(",), ("light(",), ("switch",), ("fuel",), slots=(1,),
    ),
    "trucks": Domain(
        [str(ENCODINGS / "trucks.lp")], ("bring",), ("fuel(", "box(", "at("), ("go", "fill"),
        ("fuel",),
    ),
    "hospital": Domain(
        [str(ASP / "hospital" / "hospital.lp"),
         str(ASP / "hospital" / "instances" / "small.lp"),
         str(ENCODINGS / "linen_robots.lp")],
        ("linen", "return"), ("battery(", "at("), ("go", "recharge"), ("battery",),
    ),
    "diner": Domain(
        [str(ENCODINGS / "diner.lp")], ("eat", "tidy"), ("lamp(", "legs(", "food("),
        ("go", "switch", "rest"), ("legs",), is_timed=True,
    ),
}  # fmt: skip
MOST_SLOTS = ["-c", "slots=4"]


class WatchedClient(Client):
    """A client whose goal is judged when it gets a status."""

    def __init__(self, see: Callable[[StatusSet], None]) -> None:
        super().__init__()
        self._see = see

    def changed(self, change: StatusSet) -> None:
        self._see(change)
        super().changed(change)


class TaskWorld(World):
    """Robots and clients.

    Attributes:
        physics: What there is.
        violations: What was wrong.
        counts: How often each kind of event has come.
        comes_alone: How often nothing else comes together with a goal.
    """

    comes_alone = 0.6

    def __init__(self, rules: Rules, domain: Domain, chance: Random) -> None:
        texts = sorted(row[0] for row in rules.base["request"])
        texts = [text for text in texts if text.startswith(domain.requests)]
        self.chance = chance
        super().__init__([chance.choice(texts) for _ in range(chance.randint(1, 6))])
        self.clients = {key: WatchedClient(self._see) for key in self.clients}
        self.physics = Physics(rules)
        self.counts: Dict[str, int] = {}
        self.failures = chance.choice([0.0, 0.05, 0.15, 0.3])
        self.doubts = chance.choice([0.0, 0.5])  # of these, what is unknown
        self.trouble = chance.choice([0.0, 0.05, 0.15])  # cancels and news
        self.together = chance.choice([0.0, 0.5, 1.0])  # how often all answers come at once
        self._domain = domain
        self._says = sorted(rules.base["says"])
        self._places = sorted({place for way in rules.base["way"] for place in way})
        self._robots = sorted(row[0] for row in rules.base["moves"])
        self._life: Optional[Life] = None
        self._outcomes: Dict[Tuple[str, int], str] = {}
        self._messages: List[Tuple[MessageArrived, Callable[[], None]]] = []
        self._said: Dict[str, Tuple[Life, int]] = {}
        self._canceled: Set[str] = set()
        self._unsure: Set[str] = set()  # goals of which a variable was lost
        self._ended: Set[str] = set()
        self._acts: Dict[Tuple[str, int], str] = {}

    @property
    def violations(self) -> List[str]:
        return self.physics.violations

    # What is heard.

    def connect(self, life: Life) -> None:
        self._life = life

    def hear(self, run: str, told: Sequence[Execution]) -> None:
        self._open = [(run, one.number) for one in told if one.answer is None]
        self._enter()
        for one in self._pausing:
            if one.action.startswith("go("):
                self.physics.try_again(one.actuator, one.action)
        for one in told:
            token = run, one.number
            if one.answer is None and self._done.get(one.actuator) != token:
                self._done[one.actuator] = token
                self._acts[token] = one.actuator
                self.effects.append((one.actuator, one.action))
                if one.attempt > 1 and one.action.startswith("go("):
                    self.physics.try_again(one.actuator, one.action)
                self.physics.begin(one.actuator, one.action)

    @property
    def _pausing(self) -> Sequence[Execution]:
        """The executions that are tried again, of whose failures the planner does not know."""
        assert self._life is not None
        ordered = self._life.loop.state.executions.ordered
        return [one for one in ordered if one.is_held and one.pauses]

    def _enter(self) -> None:
        assert self._life is not None
        for key, goal in self._life.known.items():
            if goal.slot is not None and key not in self._ended:
                self._put(key, goal.slot)

    def _put(self, key: str, slot: str) -> None:
        before = self.physics.slots.get(slot)
        if before is not None and before[0] != key:
            self.violations.append(f"goal {key} gets the slot {slot} of goal {before[0]}")
        self.physics.enter(slot, key, self._requests[key])

    def _see(self, change: StatusSet) -> None:
        """Judges a status."""
        key, word = change.goal, change.status.value
        if key in self._ended or not change.status.is_terminal:
            return
        self._ended.add(key)
        about = f"goal {key}, {self._requests[key]}, is {word}"
        slot = next((s for s, (goal, _) in self.physics.slots.items() if goal == key), change.slot)
        if word in ("recalled", "preempted", "canceled") and key not in self._canceled:
            self.violations.append(f"{about}, and was not cancelled")
        is_due = {"aborted": key in self._unsure, "rejected": key in self._canceled}
        if not is_due.get(word, True):
            self.violations.append(f"{about}: {change.reason}")
        if not slot:
            return
        self._put(key, slot)
        if word == "succeeded":
            self.violations.extend(f"{about}, but {why}" for why in self.physics.unmet(slot))
        elif word in ("canceled", "preempted"):
            why = self.physics.unrestored(slot)
            if why and self.physics.unmet(slot):
                self.violations.append(f"{about}, but {', '.join(why)}")
        self.physics.leave(slot)

    # What happens.

    def turn(self, life: Life) -> None:
        """Lets something happen while the loop waits; nothing if all is over."""
        self._enter()
        if self._messages:
            self._send_message(life)
            return
        lost = [k for k, c in self.clients.items()
                if k not in self._to_ask and k not in life.known and not c.end()]  # fmt: skip
        if lost:
            life.ask(lost[0])
            return
        chance = self.chance
        self._to_ask = [key for key in self._to_ask if key not in life.known]
        if self._to_ask and (chance.random() < 0.2 or not self._open):
            life.ask(self._to_ask[0])
            if chance.random() < self.comes_alone:
                return
        if self._disturb(life):
            return
        if self._domain.is_timed and chance.random() < 0.4:
            life.clock += chance.randint(1, 10)
            life.loop.state.watchdog.look_soon()
            if chance.random() < 0.5 and life.own_moments():
                return
        if self._open:
            tokens = self._open if chance.random() < self.together else [chance.choice(self._open)]
            for token in list(tokens):
                self._answer(life, token)
        elif not life._items:
            self._relieve(life)

    @property
    def _is_calm(self) -> bool:
        return len(self._outcomes) > _CALM_AFTER

    def _count(self, what: str) -> None:
        self.counts[what] = self.counts.get(what, 0) + 1

    def _disturb(self, life: Life) -> bool:
        chance = self.chance
        if chance.random() >= self.trouble or self._is_calm:
            return False
        goals = [k for k in life.known if not self.clients[k].end() and k not in self._canceled]
        news = [row for row in self._news() if self._is_old(life, row[1])]
        if news and (not goals or chance.random() < 0.5):
            source, variable, value = chance.choice(news)
            self._count("news")
            self._said[variable] = life, life.elapsed
            self._tell(source, lambda: self.physics.set(variable, value))
            self._send_message(life)
            return True
        if goals:
            key = chance.choice(goals)
            self._count("cancel")
            self._cancel(life, key)
            return True
        return False

    def _is_old(self, life: Life, variable: str) -> bool:
        """Whether the last message about a variable belongs to an earlier step."""
        said, step = self._said.get(variable, (None, 0))
        return said is None or (life.elapsed > step if said is life else life.elapsed > 0)

    def _cancel(self, life: Life, key: str) -> None:
        self._canceled.add(key)
        self.physics.canceled.add(key)
        life.cancel(life.known[key])

    def _news(self) -> List[Tuple[str, str, str]]:
        """Returns the messages that may report a change now."""
        physics = self.physics
        acts = [physics.act(one.actuator, one.action) for one in self._pausing]
        touched = {v for act in acts if act is not None for v in act.reads | act.writes}
        touched.update(n for act in acts if act is not None for n in (*act.takes, *act.adds))
        found = [row for row in self._says if row[0].startswith(self._domain.news or ("\0",))]
        if "at(" in self._domain.news:
            found += [(f"at({r},{p})", f"at({r})", p) for r in self._robots for p in self._places]
        return [
            (c, v, x) for c, v, x in found
            if not physics.is_touched(v) and (v in physics.values or v in physics.levels)
            and v not in physics.lost and v not in touched and physics.now(v) != x
        ]  # fmt: skip

    def _tell(self, text: str, change: Callable[[], None]) -> None:
        self._messages.append((MessageArrived("info", text), change))

    def _send_message(self, life: Life) -> None:
        """Sends a message once, unless it has not come; what it says is so from then on."""
        message, change = self._messages[0]
        try:
            life.put(message)
        finally:
            if message in (item for _, item in life.store.inputs(lambda _: None)):
                del self._messages[0]
                change()

    def _answer(self, life: Life, token: Tuple[str, int]) -> None:
        if token not in self._outcomes:
            actuator = self._acts[token]
            action, act = self.physics.running[actuator]
            outcome = self._outcome(action, act.writes)
            self._outcomes[token] = outcome
            self._count(outcome)
            for variable in (*act.writes, *act.takes, *act.adds, *act.becomes):
                self._said[variable] = life, life.elapsed  # what was done in a step is believed
            lost = self.physics.end(actuator, outcome, self.chance.random() < 0.5)
            for slot, (key, _) in self.physics.slots.items():
                if set(lost) & self.physics.own(slot):
                    self._unsure.add(key)
        life.put(AnswerArrived(*token, self._outcomes[token]))

    def _outcome(self, action: str, writes: Set[str]) -> str:
        if self._is_calm or self.chance.random() >= self.failures:
            return "success"
        if self.chance.random() < self.doubts and action.startswith(
            self._domain.unknown or ("\0",)
        ):
            return "unknown"
        return "failure"

    def _relieve(self, life: Life) -> None:
        """Says what robots cannot find out, and repairs what keeps them from going on."""
        if all(client.end() for client in self.clients.values()):
            return
        physics = self.physics
        for way in sorted(map(sorted, physics.blocked)) if self.chance.random() < 0.5 else ():
            self._tell(f"unblocked({','.join(way)})",
                       lambda way=way: physics.blocked.discard(frozenset(way)))  # type: ignore[misc]  # fmt: skip
        for variable in sorted(physics.lost):
            value = physics.values[variable]
            said = [c for c, v, x in self._says if (v, x) == (variable, value)]
            if variable.startswith("at("):
                said.append(f"at({variable[3:-1]},{value})")
            if said:
                self._tell(said[0], lambda v=variable, x=value: physics.set(v, x))  # type: ignore[misc]
        if not self._messages:
            for number, limit in sorted(physics.limits.items()):
                full = str(limit)
                said = [c for c, v, x in self._says if (v, x) == (number, full)]
                if number.startswith(self._domain.full or ("\0",)) and physics.now(number) != full:
                    self._tell(said[0], lambda v=number, x=full: physics.set(v, x))  # type: ignore[misc]
        if self._messages:
            self._send_message(life)

    def judge(self) -> List[str]:
        """Returns what was wrong, once all is over."""
        for key, client in self.clients.items():
            if not client.end():
                self.violations.append(
                    f"goal {key}, {self._requests[key]}, has not ended: {self.physics.describe()}"
                )
            elif len(set(client.end())) > 1:
                self.violations.append(f"goal {key} has ended {client.end()}")
        for number, level in self.physics.levels.items():
            if not 0 <= level <= self.physics.limits[number]:
                self.violations.append(f"{number} is {level}")
        return self.violations


class TaskLife(Life):
    """A life whose world knows its goals."""

    def put(self, *items: Item) -> None:
        """Takes inputs; what the loop itself says after a time is so from then on."""
        super().put(*items)
        for item in items:
            if not (isinstance(item, MessageArrived) and isinstance(self._world, TaskWorld)):
                continue
            physics = self._world.physics
            name, arguments = split_term(item.value)
            if name == "unblocked":
                physics.blocked.discard(frozenset(arguments))
            elif name == "ready":
                physics.ripen(*arguments)

    def live(self) -> None:
        world = self._world
        assert isinstance(world, TaskWorld)
        world.connect(self)
        try:
            super().live()
        finally:
            said = [text for text in self.warnings if "does not allow the plan" in text]
            world.violations.extend(said)
