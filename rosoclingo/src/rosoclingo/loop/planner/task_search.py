"""Searches for first plans and better ones outside of clingo, in a separate process.

An encoding with the parts ``facts`` and ``task(k)`` shows its planning task by rows, see
``lib/task.lp``. A plan that is found for it is told to the encoding by parts: ``occ(R,A,N,K)`` and
``headed(K,N,R,V,W)`` for its N-th action, ``attained(K,N,ID)`` for a request that is met after it,
and ``follow(K)``. No layer is grounded for that.
"""

from __future__ import annotations

import contextlib
import enum
import gc
import math
from dataclasses import dataclass, replace
from typing import Callable, Container, Iterable, Iterator, List, Mapping, Optional, Sequence, Tuple

from rosclingo.wire import commands as wire
from rosclingo.wire.term_text import split_term
from rosoclingo.engine.flattening import flatten
from rosoclingo.engine.process import SearchProcess, prepare_search
from rosoclingo.engine.reading import TaskReader, plan_rows
from rosoclingo.engine.rest import begun_of, begun_plan, rest_of_plan
from rosoclingo.engine.task import PlanningTask
from rosoclingo.engine.worker import SearchEnd
from rosoclingo.errors import SearchProcessError, TaskError
from rosoclingo.loop.journal import Ended, SearchEnded
from rosoclingo.loop.quality import Quality
from rosoclingo.loop.values.solver import Solver

TASK = ("task", 1)
"""The part of an encoding that shows the task of a search."""

LIBRARY_PARTS = frozenset(
    {("gather", 1), ("details", 1), ("reachable", 1), ("reach", 2), ("attain", 2), ("plan", 1),
     ("layer", 2), ("moves", 2), ("conditions", 2), ("numbers", 2), ("goal", 2)}
)  # fmt: skip
"""The parts of ``lib/layers.lp`` and ``lib/actions.lp`` that plans come of. If an encoding adds to
one of them, its task is more than it shows."""

_FACTS = "facts"
_SHOWING = "showing_facts"
_TASK = "task("
_ALONE_SECONDS = 3.0  # of processor time, which the search has before clingo looks for layers, too
_IMPROVE_SECONDS = 10.0  # of work, that a search for better plans may take
_MOST_WORK = 10.0  # seconds of a slow processor that a second of work may take
_SECONDS = 60.0  # of processor time, which it has in all
_BYTES = 2**31
_SHOWN_SECONDS = 1.25  # of processor time, after which a first better plan is shown
_POLL_SECONDS = 0.01
_MOMENT_SECONDS = 0.15  # of work, for the place of new requests in the plan that stands


def task_of(symbols: Sequence[str]) -> str:
    """Returns the number of the search whose task an answer set shows; empty without one.

    >>> task_of(["do(a,b,1)", "task(3)"])
    '3'
    """
    for text in symbols:
        if text.startswith(_TASK):
            return split_term(text)[1][0]
    return ""


@contextlib.contextmanager
def _no_collection() -> Iterator[None]:
    """A context without Python's garbage collection, which would look at all new objects.

    A task consists of so many that this would take as long as reading it.
    """
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


@dataclass
class FollowedPlan:
    """The plan that is followed, from which the next search may continue; saved.

    Attributes:
        followed: Its actions, as the encoding shows them.
        passed: How many of its steps there were before the last reset.
        since: The step, counted as those of the plan, since which such plans are followed without
            a break.
    """

    followed: Tuple[str, ...] = ()
    passed: int = 0
    since: int = 0


@dataclass(eq=False)
class TaskSearch:
    """Finds plans for the tasks of one encoding. One thread makes the calls.

    Attributes:
        solver: The solver, whose encoding shows the task.
        run: Runs commands.
        state: Returns the plan that is followed.
        show: Called with the task of each search for a first plan.
        warn: Called with why it cannot be used, so that clingo plans alone.
        warn_of_plan: Called with the fault of a plan of clingo's.
        ages: Returns how many seconds ago each request has come, by slots.
    """

    solver: Solver
    run: Callable[..., object]
    state: Callable[[], FollowedPlan]
    show: Callable[[PlanningTask], None] = lambda _: None
    warn: Callable[[str], None] = lambda _: None
    warn_of_plan: Callable[[str], None] = lambda _: None
    ages: Callable[[], Mapping[str, float]] = dict

    def __post_init__(self) -> None:
        self._reader = TaskReader()
        self._attempt: Optional[_Attempt] = None  # a search that takes long
        self._shown = 0  # better plans since the first one
        self._symbols: Sequence[str] = ()  # the answer set that shows the task
        self._since = 0  # since when plans are followed, if there is one for the last task

    def read_facts(self, ground: Callable[[Sequence[wire.Part]], wire.Command]) -> None:
        """Reads the encoding's facts in base, once.

        It is not after a crash, and if the encoding has had no answer set until now.

        Args:
            ground: Returns the command that grounds parts that are not grounded yet.
        """
        if self._reader.has_facts:
            return
        self.run(ground([wire.Part(_FACTS)]), wire.AssignExternal(_SHOWING, wire.Truth.TRUE))
        outcome = self.solver.solve()
        if outcome.result is wire.Result.SAT:
            with _no_collection():
                self._reader.read_facts(outcome.symbols)
        self.run(wire.AssignExternal(_SHOWING, wire.Truth.FALSE))

    def follow(self, symbols: Sequence[str]) -> None:
        """Sets the plan that is followed from now on."""
        state = self.state()
        state.followed, state.passed, state.since = plan_rows(symbols), 0, self._since

    def read(self, symbols: Sequence[str], step: int) -> PlanningTask:
        """Returns the task that an answer set shows in a step."""
        state = self.state()
        with _no_collection():
            passed = state.passed + step
            task = self._reader.read(symbols, state.followed, passed, self.ages())
        self._since = state.since - state.passed if task.left else step
        return replace(task, is_begun=self._since < step)

    def find(
        self, symbols: Sequence[str], step: int, stopped: Callable[[], bool], patience: float
    ) -> Optional[SearchEnded]:
        """Searches until there is a plan for all reachable requests, or until told to stop.

        The rest of the plan before stays, if it is still possible, and new requests come after
        it.

        Args:
            symbols: An answer set that shows the task.
            step: The current step.
            stopped: Whether the search has to end.
            patience: For how many seconds of work it improves the plan that it has found; 0 for a
                moment.

        Returns:
            How it has ended; None if it takes so long that clingo may look for layers beside it.
        """
        self.close()
        self._shown = 0
        if not self._reader.has_facts:
            return None
        try:
            task = self.read(symbols, step)
            self.show(task)
            self._attempt = _Attempt(task_of(symbols), task, stopped, patience)
            ended = self._attempt.begin()
        except TaskError:  # the search does not know all that an execution does
            return None
        except (SearchProcessError, OSError) as err:
            self.warn_of(err)
            return None
        if stopped():
            self.close()
            return SearchEnded(Ended.CALLED)
        return ended

    def note_task(self, symbols: Sequence[str]) -> None:
        """Remembers the answer set of the current task, against which :meth:`check` validates."""
        self._symbols = symbols

    def check(self, symbols: Sequence[str]) -> None:
        """Validates a plan of clingo's by executing it on the task, and warns if it fails.

        Args:
            symbols: The answer set with the plan.
        """
        if not (self._reader.has_facts and task_of(self._symbols)):
            return
        reason = ""
        with contextlib.suppress(TaskError):  # the task is more than the search knows
            reason = self._reader.obstacle(self._symbols, plan_rows(symbols))
        if reason:
            self.warn_of_plan(
                f"the encoding's task does not allow the plan that clingo has found, and that is "
                f"executed nevertheless: {reason}; rules that the encoding adds to the parts of "
                f"the library may be the cause"
            )

    def warn_of(self, error: Exception) -> None:
        """Warns that the search process cannot be started."""
        self.warn(f"plans come from clingo alone, which may take much longer: {error}")

    @property
    def is_ready(self) -> bool:
        """True if the search process has ended; for any thread."""
        return self._attempt is not None and self._attempt.is_ready

    def take(self) -> Optional[SearchEnded]:
        """Returns the plan of a long search; None without one."""
        attempt, self._attempt = self._attempt, None
        with contextlib.suppress(TaskError):
            return attempt.go_on() if attempt is not None else None
        return None

    def close(self) -> None:
        """Ends a long search."""
        if self._attempt is not None:
            self._attempt.close()
            self._attempt = None

    def improve(
        self, symbols: Sequence[str], step: int, stopped: Callable[[], bool], seconds: float
    ) -> SearchEnded:
        """Searches for a better plan than the rest of the followed one.

        It ends when told to stop; when there is a better one, after a while; or when it is through.

        Args:
            symbols: An answer set that shows the task.
            step: The current step.
            stopped: Whether the search has to end.
            seconds: If the plan does not meet all requests: for how many seconds of processor time
                one that meets more is looked for; else 0.

        Raises:
            TaskError: What the encoding shows is no task, or a plan is none for it.
        """
        number = task_of(symbols)
        if not (number and self._reader.has_facts):
            return SearchEnded(Ended.NOTHING)
        task = self.read(symbols, step)
        plan = rest_of_plan(task) if task.left else []
        if plan is None and seconds:
            plan = begun_plan(task)
        if plan is None:
            return SearchEnded(Ended.NOTHING)
        before, before_met = found(number, task, plan), task.execute(plan).met
        if before.missing and seconds:
            more = _Attempt(number, task, stopped).go_further(plan, seconds)
            if len(more.plan) == len(plan):  # perhaps what it does first excludes the others
                begun = begun_plan(task)
                more = _Attempt(number, task, stopped).go_further(begun, seconds, last=before_met)
            is_better = len(task.execute(more.plan).met) > len(before_met)
            how = Ended.BETTER if is_better else Ended.AS_BEFORE
            ended = found(number, task, more.plan if is_better else plan)
            return replace(ended, how=how, missing=more.missing)
        better = None if before.missing else self._improve(task, plan, stopped)
        if better is None:
            return replace(before, how=Ended.AS_BEFORE)
        return replace(found(number, task, better), how=Ended.BETTER)

    def _improve(
        self, task: PlanningTask, plan: List[int], stopped: Callable[[], bool]
    ) -> Optional[List[int]]:
        enough = _SHOWN_SECONDS * 2**self._shown
        better = _improved(task, plan, stopped, rest=plan, work=_IMPROVE_SECONDS, enough=enough)
        self._shown += better is not None
        return better


def _improved(
    task: PlanningTask,
    plan: List[int],
    stopped: Callable[[], bool],
    *,
    rest: List[int],
    work: float,
    enough: float = math.inf,
) -> Optional[List[int]]:
    """Returns a better plan that keeps begun actions; None without one.

    Args:
        task: The task.
        plan: The rest of the current plan, with additions.
        stopped: Whether the search has to end.
        rest: The rest of the current plan.
        work: For how long it searches, in seconds of work.
        enough: After how many seconds of processor time it ends if it has a better plan.
    """
    first = 0
    if task.elder in task.requests and task.times is None:
        # What meets a request that has waited too long stays. Among seconds, its wait counts more.
        first = task.execute(plan).met.get(task.elder, 0)
    kept = plan[:first]
    done = task.execute(kept)
    open_ones = {s: request for s, request in task.requests.items() if s not in done.met}
    flat = flatten(replace(task, state=done.state, requests=open_ones))
    process = SearchProcess(
        flat,
        seconds=0.0,
        improve_seconds=_MOST_WORK * work,
        improve_evaluations=flat.evaluations(work),
        bytes=_BYTES,
        plan=plan[first:],
        standing=(_names(task, rest), begun_of(task, rest)),
    )
    with contextlib.closing(process):
        prepare_search()  # for when news ends this one
        while not (process.has_ended or stopped()):
            process.wait(_POLL_SECONDS)
            if process.plans_found and process.has_used(enough):
                break
        better = process.latest()
    return None if better is None else [*kept, *better]


def _names(task: PlanningTask, rest: Sequence[int]) -> List[int]:
    """Returns a number for each action, shared by the same action of several actuators.

    It is -1 for ways, and for what the rest of a plan does not have.
    """
    actions = task.actions
    numbers = {actions[index].name: index for index in rest if not actions[index].start}
    return [-1 if one.start else numbers.get(one.name, -1) for one in actions]


class _Result(enum.Enum):
    """The end of a search for some requests."""

    MET = enum.auto()
    NO_PLAN = enum.auto()  # which is proven
    LATE = enum.auto()


class _Attempt:
    """Searches for one plan: request by request if no plan meets all of them.

    Attributes:
        plan: The plan until now.
        missing: How many requests it does not meet, though it is not proven that it has to be so.
    """

    def __init__(
        self, number: str, task: PlanningTask, stopped: Callable[[], bool], patience: float = 0.0
    ) -> None:
        self._number = number
        self._task = task
        self._stopped = stopped
        self._patience = patience
        self._is_alone = bool(task.derivation.variables)
        self._process: Optional[SearchProcess] = None
        self.plan: List[int] = []
        self.missing = 0

    def begin(self) -> Optional[SearchEnded]:
        """Searches alone for a while; returns the plan, or None if the search goes on.

        Where variables are derived, no layers are looked for, so all is searched alone.
        """
        rest = rest_of_plan(self._task)
        result = _Result.NO_PLAN
        seconds = _SECONDS if self._is_alone else _ALONE_SECONDS
        if rest is not None:
            self.plan = rest
            result = self._search(self._task.requests, seconds)
        if result is _Result.NO_PLAN:
            self.plan = begun_plan(self._task)
            if self._task.elder in self._task.requests:
                self._search([self._task.elder], seconds)
                self.close()  # if that is late, the others need not wait, too
            elif self.plan:
                result = self._search(self._task.requests, seconds)
                self.plan = [] if result is _Result.NO_PLAN else self.plan
            if result is _Result.NO_PLAN:
                result = self._search(self._task.requests, seconds)
        if result is _Result.LATE:
            if not (self._is_alone or self._task.execute(self.plan).met):
                return None
            self.close()
            return found(self._number, self._task, self.plan)
        if result is _Result.NO_PLAN:
            self.go_further(rest or [], _ALONE_SECONDS)
            unmet = len(self._task.requests) - len(self._task.execute(self.plan).met)
            if unmet > 1:  # in another order, more of them may be met
                self.missing = unmet
        if rest and result is _Result.MET and self.plan != rest:
            self._insert(rest)
        return found(self._number, self._task, self.plan, missing=self.missing)

    def go_further(self, plan: List[int], seconds: float, last: Container[str] = ()) -> _Attempt:
        """Extends a plan to meet further requests, one after the other, as far as possible.

        Args:
            plan: The plan.
            seconds: Processor time for each of them, in seconds.
            last: Requests whose turn comes after that of all others.
        """
        self.plan = plan
        for slot in sorted(self._task.requests, key=lambda slot: slot in last):
            if self._stopped():
                break
            if self._search([slot], seconds) is _Result.LATE:
                self.close()
                self.missing += 1
        return self

    def _insert(self, rest: List[int]) -> None:
        """Moves actions that were appended to the rest of the plan forward, within a budget."""
        work = self._patience or _MOMENT_SECONDS
        better = _improved(self._task, self.plan, self._stopped, rest=rest, work=work)
        self.plan = self.plan if better is None else better

    def go_on(self) -> Optional[SearchEnded]:
        """Takes the result of a long search."""
        is_found = self._take() is _Result.MET
        return found(self._number, self._task, self.plan) if is_found else None

    @property
    def is_ready(self) -> bool:
        process = self._process
        return process is not None and process.has_ended

    def close(self) -> None:
        if self._process is not None:
            self._process.close()
            self._process = None

    def _search(self, wanted: Iterable[str], seconds: float) -> _Result:
        """Extends the plan to meet some requests; a search that is late goes on.

        In that case, it is extended by what meets some of them, if that is known.
        """
        done = self._task.execute(self.plan)
        missing = {slot: self._task.requests[slot] for slot in wanted if slot not in done.met}
        if not missing:
            return _Result.MET
        with _no_collection():
            flat = flatten(replace(self._task, state=done.state, requests=missing))
        patience = self._patience
        self._process = process = SearchProcess(
            flat,
            seconds=_SECONDS,
            improve_seconds=_MOST_WORK * (patience or 1.0),
            improve_evaluations=flat.evaluations(patience) if patience else None,
            bytes=_BYTES,
        )
        while not (process.has_ended or self._stopped()):
            process.wait(_POLL_SECONDS)
            most = min(seconds, _ALONE_SECONDS) if process.partial else seconds
            if not process.plans_found and process.has_used(most):
                self.plan = [*self.plan, *process.partial]
                return _Result.LATE
        return self._take()

    def _take(self) -> _Result:
        process, self._process = self._process, None
        assert process is not None
        process.close()
        more = process.latest()
        if more is None:
            self.plan = [*self.plan, *process.partial]
            is_proven = process.why_ended == SearchEnd.NO_PLAN
            return _Result.NO_PLAN if is_proven else _Result.LATE
        self.plan = [*self.plan, *more]
        return _Result.MET


def found(
    number: str, task: PlanningTask, plan: Sequence[int], *, missing: Optional[int] = None
) -> SearchEnded:
    """Returns the end of a search that has found a plan.

    Args:
        number: The number of the search.
        task: Its task.
        plan: The plan, for all requests or some.
        missing: How many requests it does not meet, though it is not proven that it has to be so.

    Raises:
        TaskError: It is none.
    """
    done = task.execute(plan)
    unmet = [slot for slot in task.requests if slot not in done.met]
    parts = [*_parts(number, task, plan, done.met)]
    if len(task.requests) > 1 or missing:
        parts += [f"planned({number},{slot})" for slot in unmet]
    parts += [f"details({number})", f"follow({number})"]
    symbols = tuple(f"ground({part})" for part in parts)
    missing = len(unmet) if missing is None else missing
    return SearchEnded(Ended.FOUND, symbols, Quality((done.cost,)), missing=missing)


def _parts(
    number: str, task: PlanningTask, plan: Sequence[int], met: Mapping[str, int]
) -> Iterator[str]:
    for position, chosen in enumerate(plan, 1):
        action = task.actions[chosen]
        if action.start:
            yield f"headed({number},{position},{action.actuator},{action.start},{action.name})"
        else:
            yield f"occ({action.actuator},{action.name},{position},{number})"
    yield from (f"attained({number},{position},{slot})" for slot, position in met.items())
