"""A planning task in integers, as the search reads it.

Of two rooms and a robot with a battery of 5, which is in room 0 and is to be in room 1 with a
battery of at least 2 left::

    FlatTask(
        domains=[2], initial=[0],
        limits=[5], levels=[4],
        requests=[([(0, 1)], [(0, 2, 5)])],
        actions=[([(0, 0)], [], [([], 0, 1)], [(kinds.TAKES, 0, 2)], 1, 0)],
    )
"""

from typing import List, NamedTuple, Tuple

FlatPairs = List[Tuple[int, int]]
"""Variables with values."""
FlatEffects = List[Tuple[FlatPairs, int, int]]
FlatNumbers = List[Tuple[int, int, int]]
FlatAction = Tuple[FlatPairs, FlatPairs, FlatEffects, FlatNumbers, int, int]
FlatRequest = Tuple[FlatPairs, List[Tuple[int, int, int]]]
FlatRule = Tuple[FlatPairs, List[Tuple[int, int, int]], int, int]


_PER_EVALUATION = 1e-5  # seconds
_PER_EVALUATION_AND_FACT = 2.5e-9  # seconds, in addition


class FlatTask(NamedTuple):
    """A task of lists, tuples and integers only, so that ``tuple(task)`` can be marshalled.

    Attributes:
        domains: The number of values of each variable; the values are numbered from 0.
        initial: The value of each variable now.
        limits: The limit of each number, at most 999,999,999; levels are from 0 to there.
        levels: The level of each number now.
        requests: Each with wishes ``(variable, value)`` and ``(number, least, most)``. A request is
            met once all of its wishes hold at the same time, and stays met. A plan meets all.
        actions: Each is ``(needs, others, effects, numbers, cost, actor)``. It needs the values of
            ``needs``, and any other values than those of ``others``. An effect ``(conditions,
            variable, value)`` takes place if all conditions hold before the action; of several
            effects on a variable, the last one counts. A change of a number or a need is ``(kind,
            number, amount)``, with a kind of :mod:`rosoclingo.engine.kinds`; what an action takes
            of a number in several parts counts as one, and so does what it adds. The cost is not
            negative; the actor is the index of the actuator, -1 for none.
        strata: Of each stratum, from the lowest one, its derived variables, each as ``(variable,
            value)`` with the value that it has unless a rule says otherwise.
        rules: The rules of derived variables, each as ``(needs, levels, variable, value)``: the
            variable has the value if others have those of ``needs``, and numbers the levels
            ``(number, least, most)``. A rule needs nothing of a higher stratum, and none of the
            values of its own stratum that are there without rules.
        occupied: For each action, numbers of what no two actions may occupy or change at the same
            time, beside what they need and change; empty if there is nothing like that.
        durations: The seconds that each action takes; empty if the task counts none, and actions
            last as long as they cost.
        due: Deadlines of requests, each as ``(request, seconds, weight)``; a request may have
            several.
        ready: Values that variables get some time after the action that sets them has ended, each
            as ``(variable, value, seconds)``.
        keeps: Values that variables keep for some time at most, until the action begins that sets
            another one, each as ``(variable, value, seconds)``.
        aim: Of a task that counts seconds, what is minimised after lateness, as a constant of
            :mod:`rosoclingo.engine.kinds`; and if it is minimised together with lateness, the value
            of each second or unit of it, else 0.
        free: Actuators that are busy, each as ``(actor, seconds)`` until it is free.
        since: Variables that get the value of ``initial`` only later, each as ``(variable,
            seconds)``, or that have had it for some time, with negative seconds.
        levels_since: Numbers that get the value of ``levels`` only later, or have had it for some
            time, as in ``since``.
        earliest: Requests that are not to be met before some time, each as ``(request, seconds)``.
    """

    domains: List[int]
    initial: List[int]
    limits: List[int]
    levels: List[int]
    requests: List[FlatRequest]
    actions: List[FlatAction]
    strata: Tuple[FlatPairs, ...] = ()
    rules: Tuple[FlatRule, ...] = ()
    occupied: List[List[int]] = []  # noqa: RUF012 (nothing changes it)
    durations: List[int] = []  # noqa: RUF012
    due: List[Tuple[int, int, int]] = []  # noqa: RUF012
    ready: List[Tuple[int, int, int]] = []  # noqa: RUF012
    keeps: List[Tuple[int, int, int]] = []  # noqa: RUF012
    aim: Tuple[int, int] = (0, 0)
    free: List[Tuple[int, int]] = []  # noqa: RUF012
    since: List[Tuple[int, int]] = []  # noqa: RUF012
    levels_since: List[Tuple[int, int]] = []  # noqa: RUF012
    earliest: List[Tuple[int, int]] = []  # noqa: RUF012

    def evaluations(self, seconds: float) -> int:
        """Returns how many states a search looks at in so many seconds of a processor, about.

        So a budget in seconds depends neither on the machine nor on what else it does.
        """
        facts = sum(self.domains) + sum(
            len(needs) + len(others) + len(numbers) + sum(1 + len(each[0]) for each in effects)
            for needs, others, effects, numbers, _, _ in self.actions
        )
        return int(seconds / (_PER_EVALUATION + _PER_EVALUATION_AND_FACT * facts))
