"""Random testing with shrinking."""

from __future__ import annotations

import random
from dataclasses import dataclass, field, replace
from typing import Any, Callable, Collection, Dict, Iterator, List, Set

from rosoclingo.encodings.alphabet import Alphabet
from rosoclingo.in_process.inputs import AFTER, IN, MESSAGE, STEP, Input, Moment
from rosoclingo.loop.journal import CommandDone
from rosoclingo.loop.values.ids import CANCEL, GOAL
from rosoclingo.tools.check import twins
from rosoclingo.tools.check.findings import Finding, Words
from rosoclingo.tools.check.invariants import findings
from rosoclingo.tools.check.run import CheckedRun, Runner
from rosoclingo.tools.check.twins import TwinInputs

_ALONE = 6  # requests that are asked for alone
_MOST_GOALS, _MOST_OTHERS = 3, 2  # in an episode
_SPARE = 10  # steps, for what comes late
_SOON = (3, 10)  # commands, in which a first plan is found
_AT_FIRST, _BY_STEP = 0.6, 0.6  # how probable it is that something comes then
_SHRINKING = 60  # episodes to shrink one


@dataclass(frozen=True)
class Episode:
    """The inputs of a run, each with its moment.

    Attributes:
        inputs: What comes.
        steps_to_reset: After how many steps the past is forgotten, in a second run; 0 for none.
    """

    inputs: TwinInputs
    steps_to_reset: int = 0


@dataclass
class FailureSearch:
    """Searches for failing runs by random testing, and shrinks them.

    Attributes:
        files: The files and options of the command line, as they were typed.
        alphabet: What can come.
        mode: Another mode than the usual one, as it was typed; empty for that.
        resets: The mode that forgets the past; empty if the encoding cannot do that.
        steps: The longest plan that the command line has set; 0 if it has not.
        runner: Makes the runs.
        episodes: How many random episodes there were, without those that it took to shrink one.
        ignored: Checks that have found something already.
    """

    files: Words
    alphabet: Alphabet
    mode: str = ""
    resets: str = ""
    steps: int = 0
    runner: Runner = field(default_factory=Runner)
    episodes: int = 0
    ignored: Set[str] = field(default_factory=set)
    _judged: Dict[Episode, List[Finding]] = field(default_factory=dict)
    _horizon: int = 0  # the longest plan of an episode, once that is known
    _last_moment: int = 8
    _last_command: int = 60

    def words(self, inputs: TwinInputs, mode: str = "") -> Words:
        """Returns the arguments of ``plan.py`` for a run."""
        mode = mode or self.mode
        typed = [*self.files, *(["--mode", *mode.split()] if mode else []), "--simulate"]
        if self._horizon:
            typed += ["-c", f"steps={self._horizon}"] if not self.steps else []
            typed += ["--most-steps", str(3 * self._horizon)]
        for one in inputs:
            if one.kind == GOAL and one.moment == Moment():
                typed += ["--goal", one.value]
            elif one.kind != CANCEL and one.moment == Moment():
                typed += ["--event", str(one)]
            else:
                typed += ["--at", str(one.moment), str(one)]
        return tuple(typed)

    def run(self, inputs: TwinInputs, mode: str = "") -> CheckedRun:
        """Makes a run."""
        return self.runner.run(self.words(inputs, mode))

    def alone(self) -> List[Finding]:
        """Plans for some requests alone, and learns how long plans are."""
        nothing = self.run(())
        found = self._new(findings(nothing))
        if not nothing.loop.dynamic:
            self.alphabet = replace(self.alphabet, requests=())
        requests = self.alphabet.requests
        some = requests[:: max(1, len(requests) // _ALONE)][:_ALONE]
        longest = commands = 0
        for request in some:
            run = self.run((Input(GOAL, request),))
            found += self._new(findings(run))
            if found:
                break  # the others would show the same
            longest = max(longest, run.steps)
            commands = max(commands, sum(isinstance(event, CommandDone) for event in run.events))
        self._horizon = self.steps or (_MOST_GOALS + 1) * (longest + 1) + _SPARE
        self._last_moment = longest + 4
        self._last_command = commands + 4
        return found

    def by_chance(self, episodes: int, seed: int) -> Iterator[Finding]:
        """Runs random episodes, and yields their findings: one for each check, shrunk.

        Args:
            episodes: How many there are, without those that it takes to shrink one.
            seed: Start of the random numbers.
        """
        if not self.alphabet.requests:
            return
        chance = Chance(
            random.Random(seed),  # noqa: S311 (no secret)
            self.alphabet,
            self._last_moment,
            self._last_command,
            bool(self.resets),
        )
        for _ in range(episodes):
            if self.runner.is_over:
                return
            self.episodes += 1
            episode = chance.episode()
            found = self.judge(episode)
            if found:
                smallest = shrunk(episode, self.alphabet.requests[0], self._shows(found[0].check))
                found = self.judge(smallest)
                self.ignored.add(found[0].check)
                yield found[0]

    def _shows(self, check: str) -> Callable[[Episode], bool]:
        """Returns a predicate: whether an episode has the same finding, within a budget."""
        most = len(self._judged) + _SHRINKING

        def shows(episode: Episode) -> bool:
            is_at_end = len(self._judged) >= most or self.runner.is_over
            if episode not in self._judged and is_at_end:
                return False
            found = self.judge(episode)
            return bool(found) and found[0].check == check

        return shows

    def judge(self, episode: Episode) -> List[Finding]:
        """Returns the findings in an episode."""
        if episode not in self._judged:
            self._judged[episode] = self._judge(episode)
        return self._new(self._judged[episode])

    def _judge(self, episode: Episode) -> List[Finding]:
        run = self.run(episode.inputs)
        found = findings(run)
        if found or run.is_cut:
            return found
        mode = f"{self.resets} -c r={episode.steps_to_reset}"

        def with_resets(inputs: TwinInputs) -> CheckedRun:
            return self.run(inputs, mode)

        resets = with_resets if self.resets and episode.steps_to_reset else None
        return twins.compare(episode.inputs, run, len(self.alphabet.slots), self.run, resets)

    def _new(self, found: List[Finding]) -> List[Finding]:
        return [finding for finding in found if finding.check not in self.ignored]


@dataclass
class Chance:
    """Generates random episodes.

    Attributes:
        random: The random numbers.
        alphabet: What can come.
        last_step: The last step in which something comes.
        last_command: The last command in which something comes.
        resets: Whether there are second runs in which the past is forgotten.
    """

    random: random.Random
    alphabet: Alphabet
    last_step: int
    last_command: int
    resets: bool

    def episode(self) -> Episode:
        """Draws the next episode."""
        kinds = [self._anything, self._anything, self._announced, self._failing, self._recalled]
        inputs = self.random.choice(kinds)()
        after = self.random.choice((0, 1, 1, 2, 3)) if self.resets else 0
        return Episode(twins.without_strange(tuple(inputs)), after)

    def _anything(self) -> List[Input]:
        goals = [
            self._goal(Moment() if self.random.random() < _AT_FIRST else self._anywhere())
            for _ in range(self.random.randint(1, _MOST_GOALS))
        ]
        return [
            *goals,
            *self._some(lambda: self._cancel(self._anywhere()), self.alphabet.cancels),
            *self._some(self._failure, self.alphabet.failures),
            *self._some(self._message, self.alphabet.messages),
        ]

    def _announced(self) -> List[Input]:
        return self._at_first(1) + self._some(self._message, self.alphabet.messages, 1)

    def _failing(self) -> List[Input]:
        return self._at_first(1) + self._some(self._failure, self.alphabet.failures, 1)

    def _recalled(self) -> List[Input]:
        """Draws goals, one of which is cancelled at a random moment, mostly an early one."""
        if not self.alphabet.cancels:
            return self._at_first(2)
        soon = self._moment(self.random.choice((IN, AFTER)), *_SOON)
        moment = soon if self.random.random() < _AT_FIRST else self._anywhere()
        return [*self._at_first(2), self._cancel(moment)]

    def _some(
        self, draw: Callable[[], Input], known: Collection[Any], least: int = 0
    ) -> List[Input]:
        number = self.random.randint(least, _MOST_OTHERS) if known else 0
        return [draw() for _ in range(number)]

    def _at_first(self, least: int) -> List[Input]:
        return [self._goal(Moment()) for _ in range(self.random.randint(least, _MOST_GOALS))]

    def _goal(self, moment: Moment) -> Input:
        return Input(GOAL, self.random.choice(self.alphabet.requests), moment)

    def _cancel(self, moment: Moment) -> Input:
        return Input(CANCEL, str(self.random.randint(1, _MOST_GOALS)), moment)

    def _failure(self) -> Input:
        actuator, answer = self.random.choice(self.alphabet.failures)
        return Input(MESSAGE, answer, self._moment(STEP, 1, self.last_step), actuator)

    def _message(self) -> Input:
        source, value = self.random.choice(self.alphabet.messages)
        return Input(MESSAGE, value, self._anywhere(), source)

    def _anywhere(self) -> Moment:
        if self.random.random() < _BY_STEP:
            return self._moment(STEP, 0, self.last_step)
        return self._moment(self.random.choice((IN, AFTER)), 1, self.last_command)

    def _moment(self, kind: str, first: int, last: int) -> Moment:
        return Moment(kind, self.random.randint(first, last))


def shrunk(episode: Episode, request: str, shows: Callable[[Episode], bool]) -> Episode:
    """Shrinks an episode as far as its finding stays.

    Args:
        episode: It shows something.
        request: A simple request.
        shows: Whether an episode shows it, too.
    """
    while True:
        smaller = next(filter(shows, _smaller(episode, request)), None)
        if smaller is None:
            return episode
        episode = smaller


def _smaller(episode: Episode, request: str) -> Iterator[Episode]:
    """Yields simpler episodes: without one input, with one made simple, or without resets."""
    inputs = episode.inputs
    for i in range(len(inputs)):
        rest = twins.without_strange(inputs[:i] + inputs[i + 1 :])
        yield replace(episode, inputs=rest)
    if episode.steps_to_reset:
        yield replace(episode, steps_to_reset=0)
    for i, one in enumerate(inputs):
        simple = [replace(one, moment=Moment())]
        simple += [replace(one, value=request)] if one.kind == GOAL else []
        for other in simple:
            if other != one:
                yield replace(episode, inputs=(*inputs[:i], other, *inputs[i + 1 :]))
