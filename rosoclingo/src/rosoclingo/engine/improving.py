# cython: language_level=3
"""Anytime improvement of a plan: large neighbourhood search for less makespan, then less cost.

If a task counts seconds, lateness comes first, and then what the task prefers. Most of the work is
then done by :mod:`~rosoclingo.engine.insertion`, if each request has chains.

Each round leaves out actions that the plan does not need, reorders actions that do not depend on
each other, and solves windows of the plan anew: the actions from one position to another are
replaced by better ones that do what the rest of the plan needs. Now and then the whole plan is
such a window, with a weight of the estimate that falls from search to search.

With several actuators, a window has actions of some of them that follow each other in time, after a
reordering in which these are in a row. The actions before the window say when each thing in it can
begin at the earliest, and those after it, when it has to have ended for the plan to be shorter, or
as short as before (:mod:`~rosoclingo.engine.timing`). In half of the rounds the actions of busy
actuators cost more, so that others take over.

This module has no generators, as compiled ones import a module that takes time. The random numbers
have a fixed seed, and budgets count states, not seconds: a limit of time cuts the sequence of
plans, but does not change it.
"""

from array import array

from rosoclingo.engine.regression import Regression, find_bases
from rosoclingo.engine.scheduling import Scheduler
from rosoclingo.engine.search import OutOfTimeError, Search
from rosoclingo.engine.timing import Timetable

GREED_OF_WHOLE = (5, 3, 2, 1)
GREED_OF_WINDOWS = (1, 1, 2, 5)
FIRST_WINDOW = 8  # actions
LEAST_WINDOW = 4
FIRST_EVALUATIONS = 100
FIRST_EVALUATIONS_OF_WHOLE = 3000
MOST_EVALUATIONS = 200_000
MOST_WINDOW = 60  # actions, before windows are small again
ROUNDS_IN_VAIN = 4  # before windows grow
BUSY_FACTOR = 4
INSERTION_SHARE = 9  # of the work in windows
FIRST_INSERTIONS = 20_000  # in states of a search, before the first window
NO_BOUND = 1 << 60
# Whether the plan has to become shorter; whether waiting counts in the window, instead of costs.
AIMS = ((True, True), (True, True), (True, False), (False, True), (False, False))


class Improver:
    """Improves plans of a task. Used by one thread at a time."""

    def __init__(
        self,
        task: tuple,
        stop,
        evaluations: int = 10**9,
        search=None,
        *,
        standing=None,
        inserter=None,
    ) -> None:
        """Prepares the search.

        Args:
            task: A :class:`~rosoclingo.engine.flat.FlatTask`, or a tuple like it.
            stop: Called without arguments, now and then; true ends the search.
            evaluations: How many states are looked at in all, about.
            search: A search of the task that is not used any more, as it takes time to make one.
            standing: The plan that stands, of which better ones keep what is begun; None if nothing
                is, see :class:`~rosoclingo.engine.standing.Standing`.
            inserter: An :class:`~rosoclingo.engine.insertion.Inserter`; None if there is none.
        """
        self._standing = standing
        self._first_value: tuple = ()
        domains, _, limits, _, requests, actions = task[:6]
        self._stop = stop
        self._most = evaluations
        self._search = search or Search(task, stop)
        self._search.reuse(stop)
        self._states = self._search.states
        bases = find_bases(task[6], task[7])
        self._table = Timetable(task, bases)
        self._regression = Regression(task, bases)
        self._requests = len(requests)
        self._first_request = len(domains) + len(limits)
        self._actions = actions
        self._actors = [action[5] for action in actions]
        self._all_actors = sorted(set(self._actors))
        self._is_sequential = len(self._all_actors) == 1 and self._all_actors[0] >= 0
        self._costs = [action[4] for action in actions]
        self._durations = task[9] or self._costs
        self._scheduler = Scheduler(task, self._table) if task[9] else None
        self._inserter = inserter
        if inserter is not None and standing is not None:
            inserter.hold(standing)
        self._inserted = 0 if self._inserter is None else self._inserter.evaluations
        self._keeps = {(variable, value): seconds for variable, value, seconds in task[12]}
        self._lags = {(variable, value): seconds for variable, value, seconds in task[11]}
        self._set_costs(self._durations)
        self._random = 1
        self._report = lambda _: None
        self._best: tuple = ()
        self._plan: list = []
        self._value: tuple = ()
        self._makespan = 0
        self._busy = 0  # the sum of the times at which actuators end, and of costs
        self._trace: list = []
        self._met: list = []  # the requests that become met, by position
        self._size = FIRST_WINDOW
        self._evaluations = FIRST_EVALUATIONS
        self._whole_searches = 0
        # Several actuators have their first windows before.
        self._in_whole = 0 if self._is_sequential else FIRST_EVALUATIONS_OF_WHOLE
        self._rounds_in_vain = 0
        self._is_through = False

    def value(self, plan: list):
        """Returns the value of a plan, which is to be as small as possible; None if it is none.

        That is its makespan and its total cost, unless the task counts seconds, see
        :meth:`~rosoclingo.engine.scheduling.Scheduler.value`.
        """
        trace: list = []
        met = self._execute(plan, trace)
        return None if met is None else self._schedule(plan, trace, met)[0]

    def improve(self, plan: list, report) -> None:
        """Looks for better and better plans, until it does not know how to go on.

        Args:
            plan: A plan of the task.
            report: Called with each plan that is better than all before.

        Raises:
            OutOfTimeError: It was told to stop.
            MemoryError: There is no room for more states.
        """
        self._report = report
        trace: list = []
        met = self._execute(plan, trace)
        self._adopt(plan, trace, met, self._schedule(plan, trace, met))
        self._best = self._first_value = self._value
        self._eliminate()
        while not self._is_through and any(self._value):
            self._round()

    @property
    def _evaluations_left(self) -> int:
        used = self._search.evaluations
        if self._inserter is not None:
            used += self._inserter.evaluations - self._inserted
        return self._most - used

    def _insert_anew(self) -> None:
        """Improves the plan by insertion, for longer than windows have been solved until now."""
        inserter = self._inserter
        if inserter is None:
            return
        size = len(self._value)  # without seconds, excess and lateness do not count
        is_known = inserter.best is not None and inserter.best.value[-size:] <= self._value
        if not is_known and not inserter.begin_with(self._plan):
            return
        enough = INSERTION_SHARE * self._search.evaluations + FIRST_INSERTIONS
        while inserter.evaluations - self._inserted < enough and self._evaluations_left > 0:
            if inserter.is_stuck:
                return
            if self._stop():
                raise OutOfTimeError
            plan = inserter.round()
            if plan is not None:
                self._try(plan)

    def _round(self) -> None:
        self._insert_anew()
        self._reorder()
        if not self._is_sequential:
            self._choose_costs()
        if self._search.evaluations >= 3 * self._in_whole:
            before = self._search.evaluations
            self._solve_whole()
            self._in_whole += self._search.evaluations - before
        found = self._solve_windows() if self._is_sequential else self._solve_timed_windows()
        before_value = self._value
        self._eliminate()
        self._grow(found or self._value < before_value)

    def _grow(self, found: bool) -> None:
        """Makes windows larger if smaller ones are of no more use."""
        self._rounds_in_vain = 0 if found else self._rounds_in_vain + 1
        if self._rounds_in_vain < ROUNDS_IN_VAIN:
            return
        self._rounds_in_vain = 0
        if self._size >= len(self._plan) and self._evaluations > MOST_EVALUATIONS:
            self._is_through = True
        self._size = min(max(1, len(self._plan)), self._size * 3 // 2)
        self._evaluations *= 2
        if self._size > MOST_WINDOW:
            self._size = 6 + self._draw(range(20))

    def _draw(self, choices):
        self._random = (self._random * 1103515245 + 12345) & 0x7FFFFFFF
        return choices[(self._random >> 8) % len(choices)]

    def _choose_costs(self) -> None:
        """Takes the costs of the actions as they are, or higher for actuators that are busy."""
        costs = list(self._durations)
        if self._draw((True, False)):
            slots = self._table.start()
            self._table.add(self._items(self._plan, self._met), slots)
            last = max(self._actor_slots(slots), default=0)
            for index, actor in enumerate(self._actors):
                if actor >= 0 and slots[self._table.first_actor + actor] * 10 >= last * 9 > 0:
                    costs[index] *= BUSY_FACTOR
        self._set_costs(costs)

    def _set_costs(self, costs: list) -> None:
        self._drawn_costs = costs
        more = 0 if min(costs, default=1) else 1
        self._search.set_costs(costs, [cost + more for cost in costs])

    def _execute(self, plan: list, trace: list):
        """Executes a plan.

        Args:
            plan: The plan.
            trace: Gets the state before each action, and the last one.

        Returns:
            The requests that become met, for each state; None if it is no plan.
        """
        if len(self._states.simulate(plan, -1, trace)) < len(plan) or self._states.unmet_wishes():
            return None
        met: list = [[] for _ in trace]
        for request in range(self._requests):
            entry = self._first_request + request
            for position, state in enumerate(trace):
                if state[entry]:
                    met[position].append(request)
                    break
        return met

    def _schedule(self, plan: list, trace: list, met: list) -> tuple:
        """Returns the value, the makespan, and the sum of costs and of when each actuator ends."""
        if self._scheduler is not None:
            timed = self._scheduler
            timed.time(self._items(plan, met), self._spans(plan, trace, met))
            busy = timed.busy + timed.times_of_actors(self._table.first_actor, self._all_actors)
            return timed.value(), timed.makespan, busy
        slots = self._table.start()
        ends = self._table.add(self._items(plan, met), slots)
        cost = sum([self._costs[index] for index in plan])
        makespan = max(ends, default=0)
        return (makespan, cost), makespan, cost + sum(self._actor_slots(slots))

    def _spans(self, plan: list, trace: list, met: list) -> list:
        """Returns from where to where in the items a value is kept for a limited time."""
        spans: list = []
        items = [len(met[0]) - 1]  # of the state before each action, the item that led there
        for requests in met[1:]:
            items.append(items[-1] + 1 + len(requests))
        for (variable, value), seconds in self._keeps.items():
            lag = self._table.starts[2 * variable + 1]
            since = -1 if trace[0][variable] == value else None
            for position, index in enumerate(plan):
                changed = [
                    one
                    for conditions, one, _ in self._actions[index][2]
                    if one == variable
                    and not [1 for each, wanted in conditions if trace[position][each] != wanted]
                ]
                if not changed:
                    continue
                item = items[position] + 1
                if since is not None:
                    spans.append((since, item, seconds, lag))
                since = item if trace[position + 1][variable] == value else None
                lag = self._lags.get((variable, value), 0)
        return spans

    def _actor_slots(self, slots) -> list:
        first = self._table.first_actor
        return [slots[first + actor] for actor in self._all_actors if actor >= 0]

    def _items(self, plan: list, met: list) -> list:
        """Returns the actions of a plan with the requests that become met, in order."""
        first = len(self._costs)
        items = [first + request for request in met[0]]
        for index, requests in zip(plan, met[1:]):
            items.append(index)
            items += [first + request for request in requests]
        return items

    def _adopt(self, plan: list, trace: list, met: list, schedule: tuple) -> None:
        """Makes a valid plan the current one."""
        self._plan, self._trace, self._met = plan, trace, met
        self._value, self._makespan, self._busy = schedule

    def _try(self, plan: list) -> bool:
        """Adopts a plan if it is valid and not worse; tells whether it is better.

        Among plans of one makespan, actuators that end early count, too: this leads to plans of a
        less makespan. A plan that is better than all before is reported and adopted in any case.
        """
        if self._standing is not None and not self._standing.keeps(plan):
            return False
        trace: list = []
        met = self._execute(plan, trace)
        if met is None:
            return False
        value, _, busy = schedule = self._schedule(plan, trace, met)
        before, after = (*self._value[:-1], self._busy), (*value[:-1], busy)
        if after > before and value >= self._best:
            return False
        self._adopt(plan, trace, met, schedule)
        if value < self._best:
            self._best = value
            standing = self._standing
            if standing is None or standing.is_gain(self._first_value, value, plan):
                self._report(plan)
        return after < before

    def _eliminate(self) -> None:
        """Leaves out each action, with those that it makes possible, if all is met without."""
        position = 0
        while position < len(self._plan):
            if self._stop():
                raise OutOfTimeError
            shorter = self._states.simulate(self._plan, position, None)
            length = len(self._plan)
            if not self._states.unmet_wishes():
                self._try(shorter)
            if len(self._plan) == length:
                position += 1

    def _reorder(self) -> None:
        """Draws another order of the actions, in which each follows those that it depends on."""
        followers: list = [[] for _ in self._plan]
        missing = [0] * len(self._plan)
        for position, before in enumerate(self._table.dependencies(self._plan)):
            for other in before:
                followers[other].append(position)
                missing[position] += 1
        ready = [position for position, count in enumerate(missing) if count == 0]
        plan = []
        chosen = -1
        while ready:
            next_ones = [one for one in ready if chosen >= 0 and one in followers[chosen]]
            if not next_ones or self._draw(range(10)) >= 8:
                next_ones = ready
            chosen = self._draw(next_ones)
            ready.remove(chosen)
            plan.append(self._plan[chosen])
            for follower in followers[chosen]:
                missing[follower] -= 1
                if missing[follower] == 0:
                    ready.append(follower)
        self._try(plan)

    def _solve_whole(self) -> bool:
        """Searches for a whole plan, with a weight that falls; tells whether one is better."""
        number = self._whole_searches
        greed = GREED_OF_WHOLE[min(number, len(GREED_OF_WHOLE) - 1)]
        evaluations = FIRST_EVALUATIONS_OF_WHOLE << min(number, 8)
        if self._is_sequential:
            better = self._solve(0, len(self._plan), greed, evaluations)
        else:
            aim = (True, self._draw((True, False)))
            better = self._solve_timed(
                (0, len(self._plan)), self._all_actors, greed, evaluations, aim
            )
        if not better:
            self._whole_searches += 1
            if self._search.is_exhausted and self._is_sequential and self._scheduler is None:
                self._is_through = True
        return better

    def _solve_windows(self) -> bool:
        """Solves one window after the other anew; tells whether the plan is better then."""
        found = False
        position = 0
        while position < len(self._plan) and not self._is_through:
            end = min(len(self._plan), position + self._size)
            if self._solve(position, end, self._draw(GREED_OF_WINDOWS), self._evaluations):
                found = True
            elif end == len(self._plan):
                break
            else:
                position += max(1, self._size // 2)
        return found

    def _solve(self, begin: int, end: int, greed: int, evaluations: int, timing=None) -> bool:
        """Solves a window of the plan anew; tells whether the plan is better then.

        Args:
            begin: The position of the window's first action.
            end: The position after its last one.
            greed: The weight of the estimate.
            evaluations: The most states that are estimated.
            timing: None, or what the window has to cost less than, and times, see
                :meth:`~rosoclingo.engine.search.Search.find_within`.
        """
        evaluations = min(evaluations, self._evaluations_left)
        if evaluations <= 0:
            self._is_through = True
            return False
        if timing is None:
            timing = sum([self._drawn_costs[index] for index in self._plan[begin:end]]), None
        values, ranges = self._regression.needs(self._plan, self._trace, self._met, end)
        requests = [request for met in self._met[begin + 1 : end + 1] for request in met]
        goals = values, requests, ranges
        bound, times = timing
        found = self._search.find_within(
            self._trace[begin], goals, bound, greed, evaluations, timing=times
        )
        return found is not None and self._try(self._plan[:begin] + found + self._plan[end:])

    def _solve_timed_windows(self) -> bool:
        """Solves windows of some actuators anew; tells whether the plan is better then."""
        found = False
        for _ in range(max(1, 2 * len(self._plan) // self._size)):
            if self._is_through:
                break
            actors = self._draw_actors()
            window = self._draw_window(actors)
            greed, aim = self._draw(GREED_OF_WINDOWS), self._draw(AIMS)
            evaluations = self._evaluations * self._draw((1, 1, 2, 4))
            if window and self._solve_timed(window, actors, greed, evaluations, aim):
                found = True
        return found

    def _draw_actors(self) -> list:
        drawn = list(self._all_actors)
        number = self._draw((2, 2, 3, len(drawn)))
        while len(drawn) > number:
            drawn.remove(self._draw(drawn))
        return drawn

    def _draw_window(self, actors: list) -> tuple:
        """Draws a window of some actuators, and has its actions in a row.

        Returns:
            The position of its first action, and that after its last one; empty if none was found.
        """
        order = self._by_time()
        theirs = [one for one in order if self._actors[self._plan[one]] in actors]
        size = self._draw(
            (self._size, self._draw(range(LEAST_WINDOW, LEAST_WINDOW + 2 * self._size)))
        )
        begin = self._draw(range(max(1, len(theirs) - size // 2)))
        chosen = set(theirs[begin : begin + size])
        before, window, after = self._table.separate(self._plan, order, chosen)
        plan = before + window + after
        trace: list = []
        met = self._execute(plan, trace)
        if met is None or not window:
            return ()
        schedule = self._schedule(plan, trace, met)
        if schedule[0] > self._value:
            return ()
        self._adopt(plan, trace, met, schedule)
        return len(before), len(before) + len(window)

    def _by_time(self) -> list:
        """Returns the positions of the plan's actions, in the order in which they begin."""
        items = self._items(self._plan, self._met)
        begins: list = []
        for item, end in zip(items, self._table.add(items, self._table.start())):
            if item < len(self._costs):
                begins.append((end - self._durations[item], len(begins)))
        return [position for _, position in sorted(begins)]

    def _solve_timed(
        self, window: tuple, actors: list, greed: int, evaluations: int, aim: tuple
    ) -> bool:
        """Solves a window of the plan anew, see :meth:`_solve`, by some actuators."""
        begin, end = window
        is_shorter, counts_waiting = aim
        table = self._table
        slots, tails = table.start(), array("q", [0]) * (table.size + 1)
        table.add(self._items(self._plan[:begin], self._met[: begin + 1]), slots)
        table.add_before(self._items(self._plan[end:], [[], *self._met[end + 1 :]]), tails)
        may_act = array("i", [0]) * (table.size + 1)
        for actor in actors:
            if actor >= 0:
                may_act[table.first_actor + actor] = 1
        if is_shorter and counts_waiting:
            bound = NO_BOUND
        elif counts_waiting:
            after = array("q", slots)
            table.add(self._plan[begin:end], after)
            bound = sum(self._actor_slots(after)) - sum(self._actor_slots(slots))
        else:
            bound = sum([self._drawn_costs[index] for index in self._plan[begin:end]])
        latest = self._makespan - int(is_shorter)
        timing = (table, slots, tails, latest, may_act, counts_waiting)
        return self._solve(begin, end, greed, evaluations, (bound, timing))
