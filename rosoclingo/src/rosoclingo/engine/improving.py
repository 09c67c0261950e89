# cython: language_level=3
"""Anytime improvement of a plan: large neighbourhood search for less makespan, then less cost.

Each round leaves out actions that the plan does not need, reorders actions that do not depend on
each other, and solves windows of the plan anew: the actions from one position to another are
replaced by cheaper ones that do what the rest of the plan needs. Now and then the whole plan is
such a window, with a weight of the estimate that falls from search to search. With several
actuators, in half of the rounds the actions of busy ones cost more, so that others take over.

An action begins when those that it depends on have ended and its actuator is free, and lasts as
long as it costs. The random numbers have a fixed seed, and budgets count states, not seconds: a
limit of time cuts the sequence of plans, but does not change it.
"""

from rosoclingo.engine.kinds import ADDS, BECOMES, NEEDS_LEAST, NEEDS_MOST, TAKES
from rosoclingo.engine.search import OutOfTimeError, Search
from rosoclingo.engine.states import merge_numbers

GREED_OF_WHOLE = (5, 3, 2, 1)
GREED_OF_WINDOWS = (1, 1, 2, 5)
FIRST_WINDOW = 8  # actions
FIRST_EVALUATIONS = 100
FIRST_EVALUATIONS_OF_WHOLE = 3000
MOST_EVALUATIONS = 200_000
MOST_WINDOW = 60  # actions, before windows are small again
ROUNDS_IN_VAIN = 4  # before windows grow
BUSY_FACTOR = 4


class _Roles:
    """The variables and numbers that an action, or a request that becomes met, reads or changes.

    Attributes:
        reads: Variables whose values matter.
        writes: Variables that it may change.
        takes: Numbers of which it takes.
        heeds: Numbers that have to be large or small enough.
        wants_room: Numbers that have to be small enough.
        alters: Numbers to which it adds, or that it sets.
    """

    def __init__(self, reads: set, writes: set, numbers: list, bases: dict) -> None:
        for variable in reads & bases.keys():
            base, levels = bases[variable]
            reads = (reads - {variable}) | base
            numbers = [*numbers, *((NEEDS_MOST, number, 0) for number in levels)]
        self.reads = sorted(reads)
        self.writes = sorted(writes)
        self.takes = _numbers_of(numbers, (TAKES,))
        self.heeds = _numbers_of(numbers, (NEEDS_LEAST, NEEDS_MOST))
        self.wants_room = _numbers_of(numbers, (NEEDS_MOST,))
        self.alters = _numbers_of(numbers, (ADDS, BECOMES))


def _numbers_of(numbers: list, kinds: tuple) -> list:
    return sorted({number for kind, number, _ in numbers if kind in kinds})


def _bases(strata: tuple, rules: tuple) -> dict:
    """Returns the variables and the numbers on which each derived variable rests."""
    around: dict = {variable: (set(), set()) for stratum in strata for variable, _ in stratum}
    for values, levels, variable, _ in rules:
        around[variable][0].update(one for one, _ in values)
        around[variable][1].update(number for number, _, _ in levels)
    bases = {}
    for variable in around:
        seen, new = {variable}, [variable]
        numbers: set = set()
        while new:
            near, levels = around.get(new.pop(), ((), ()))
            numbers.update(levels)
            new += [one for one in near if one not in seen]
            seen.update(near)
        bases[variable] = (seen - around.keys(), numbers)
    return bases


def _roles_of_action(action: tuple, bases: dict) -> _Roles:
    needs, others, effects, numbers, _, _ = action
    reads = {variable for variable, _ in needs + others}
    for conditions, _, _ in effects:
        reads.update(variable for variable, _ in conditions)
    return _Roles(reads, {variable for _, variable, _ in effects}, numbers, bases)


def _roles_of_request(request: tuple, limits: list, bases: dict) -> _Roles:
    values, levels = request
    needs = [(NEEDS_LEAST, number, least) for number, least, _ in levels]
    needs += [(NEEDS_MOST, number, most) for number, _, most in levels if most < limits[number]]
    return _Roles({variable for variable, _ in values}, set(), needs, bases)


class _Order:
    """The items before, of which each next item has to say on which ones it depends.

    An item has a mark: the time of its end, or its position. :meth:`before` returns the marks of
    the items that an item has to wait for, not counting those of the same actuator.
    """

    def __init__(self) -> None:
        self._marks: dict = {}  # (role, variable or number): marks

    def before(self, roles: _Roles) -> set:
        found: set = set()
        self._collect(found, roles.reads, ("writes",))
        self._collect(found, roles.writes, ("writes", "reads"))
        self._collect(found, roles.takes, ("alters", "heeds"))
        self._collect(found, roles.heeds, ("alters",))
        self._collect(found, roles.wants_room, ("takes",))
        self._collect(found, roles.alters, ("takes", "heeds", "alters"))
        return found

    def _collect(self, found: set, things: list, roles: tuple) -> None:
        for thing in things:
            for role in roles:
                marks = self._marks.get((role, thing))
                if marks:
                    found.update(marks)

    def add(self, roles: _Roles, mark: int) -> None:
        for role, things in (
            ("reads", roles.reads),
            ("takes", roles.takes),
            ("heeds", roles.heeds),
            ("alters", roles.alters),
        ):
            for thing in things:
                self._marks.setdefault((role, thing), set()).add(mark)
        for variable in roles.writes:  # it waits for all that had to do with the variable before
            self._marks["reads", variable] = set()
            self._marks["writes", variable] = {mark}


class Improver:
    """Improves plans of a task. Used by one thread at a time."""

    def __init__(self, task: tuple, stop, evaluations: int = 10**9) -> None:
        """Prepares the search.

        Args:
            task: A :class:`~rosoclingo.engine.flat.FlatTask`, or a tuple like it.
            stop: Called without arguments, now and then; true ends the search.
            evaluations: How many states are looked at in all, about.
        """
        domains, _, limits, _, requests, actions, strata, rules = task
        self._stop = stop
        self._most = evaluations
        self._search = Search(task, stop)
        self._states = self._search.states
        self._limits = limits
        self._requests = requests
        self._actions = actions
        self._variables = len(domains)
        self._first_request = len(domains) + len(limits)
        self._bases = _bases(strata, rules)
        self._roles = [_roles_of_action(action, self._bases) for action in actions]
        self._request_roles = [
            _roles_of_request(request, limits, self._bases) for request in requests
        ]
        self._numbers = [merge_numbers(action[3], limits) for action in actions]
        actors = {action[5] for action in actions}
        self._is_sequential = len(actors) == 1 and -1 not in actors
        self._random = 1
        self._plan: list = []
        self._value: tuple = ()
        self._trace: list = []
        self._met: list = []  # the requests that become met, by position
        self._rest: list = []  # what the actions from a position need: values, ranges of levels
        self._costs: list = []
        self._size = FIRST_WINDOW
        self._evaluations = FIRST_EVALUATIONS
        self._whole_searches = 0
        self._in_whole = 0  # evaluations
        self._rounds_in_vain = 0
        self._is_through = False

    def value(self, plan: list):
        """Returns the makespan and the total cost of a plan, None if it is none."""
        trace: list = []
        if len(self._states.simulate(plan, -1, trace)) < len(plan) or self._states.unmet_wishes():
            return None
        return self._schedule(plan, self._met_in(trace))[0]

    def improve(self, plan: list):
        """Yields better and better plans; ends when it does not know how to go on.

        Args:
            plan: A plan of the task.

        Raises:
            OutOfTimeError: It was told to stop.
            MemoryError: There is no room for more states.
        """
        self._adopt(plan)
        first = self._value
        self._eliminate()
        if self._value < first:
            yield self._plan
        while not self._is_through and self._value > (0, 0):
            for _ in self._round():
                yield self._plan

    def _round(self):
        """Yields whenever the plan has become better."""
        self._reorder()
        self._choose_costs()
        if self._search.evaluations >= 3 * self._in_whole:
            before = self._search.evaluations
            if self._solve_whole():
                yield
            self._in_whole += self._search.evaluations - before
        found = False
        position = 0
        while position < len(self._plan) and not self._is_through:
            end = min(len(self._plan), position + self._size)
            if self._solve(position, end, self._draw(GREED_OF_WINDOWS), self._evaluations):
                found = True
                yield
            elif end == len(self._plan):
                break
            else:
                position += max(1, self._size // 2)
        before_value = self._value
        self._eliminate()
        if self._value < before_value:
            yield
        self._grow(found)

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
        self._costs = [action[4] for action in self._actions]
        self._is_biased = not self._is_sequential and self._draw((True, False))
        if self._is_biased:
            ends = self._schedule(self._plan, self._met)[1]
            last = max(ends.values(), default=0)
            for index, action in enumerate(self._actions):
                if last and ends.get(action[5], 0) * 10 >= last * 9:
                    self._costs[index] *= BUSY_FACTOR
        more = 0 if min(self._costs) else 1
        self._search.set_costs(self._costs, [cost + more for cost in self._costs])

    def _adopt(self, plan: list) -> None:
        """Makes a valid plan the current one."""
        self._trace = []
        self._states.simulate(plan, -1, self._trace)
        self._plan = plan
        self._met = self._met_in(self._trace)
        self._value = self._schedule(plan, self._met)[0]
        self._rest = []

    def _try(self, plan: list) -> bool:
        """Adopts a plan if it is valid and not worse; tells whether it is better."""
        value = self.value(plan)
        if value is None or value > self._value:
            return False
        better = value < self._value
        self._adopt(plan)
        return better

    def _met_in(self, trace: list) -> list:
        """Returns, for each position of a plan, the requests that become met there."""
        met: list = [[] for _ in trace]
        for request in range(len(self._requests)):
            entry = self._first_request + request
            for position, state in enumerate(trace):
                if state[entry]:
                    met[position].append(request)
                    break
        return met

    def _schedule(self, plan: list, met: list) -> tuple:
        """Returns makespan and cost, and the end of each actuator's last action."""
        order = _Order()
        ends: dict = {}
        makespan = total = 0
        for position, index in enumerate(plan):
            self._add_requests(order, met[position])
            cost, actor = self._actions[index][4:6]
            begin = max(order.before(self._roles[index]), default=0)
            if actor >= 0:
                begin = max(begin, ends.get(actor, 0))
            end = begin + cost
            order.add(self._roles[index], end)
            if actor >= 0:
                ends[actor] = end
            makespan = max(makespan, end)
            total += cost
        return (makespan, total), ends

    def _add_requests(self, order: _Order, requests: list) -> None:
        for request in requests:
            roles = self._request_roles[request]
            order.add(roles, max(order.before(roles), default=0))

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
        order = _Order()
        for position, index in enumerate(self._plan):
            for other in order.before(self._roles[index]):
                followers[other].append(position)
                missing[position] += 1
            order.add(self._roles[index], position)
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
        better = self._solve(0, len(self._plan), greed, evaluations)
        if not better:
            self._whole_searches += 1
            if self._search.is_exhausted and self._is_sequential:
                self._is_through = True
        return better

    def _solve(self, begin: int, end: int, greed: int, evaluations: int) -> bool:
        """Solves a window of the plan anew; tells whether the plan is better then."""
        evaluations = min(evaluations, self._most - self._search.evaluations)
        if evaluations <= 0:
            self._is_through = True
            return False
        if not self._rest:
            self._regress()
        values, levels = self._rest[end]
        requests = [request for met in self._met[begin + 1 : end + 1] for request in met]
        ranges = [(self._variables + number, *pair) for number, pair in levels.items()]
        bound = sum([self._costs[index] for index in self._plan[begin:end]])
        found = self._search.find_within(
            self._trace[begin], (list(values.items()), requests, ranges), bound, greed, evaluations
        )
        return found is not None and self._try(self._plan[:begin] + found + self._plan[end:])

    def _regress(self) -> None:
        """Finds out what the rest of the plan needs, at each position."""
        values: dict = {}
        levels: dict = {}
        self._rest = [(values, levels)]
        for position in range(len(self._plan) - 1, -1, -1):
            values, levels = dict(values), dict(levels)
            for request in self._met[position + 1]:
                wishes, number_wishes = self._requests[request]
                values.update(wishes)
                for number, least, most in number_wishes:
                    self._narrow(levels, number, least, most)
            self._settle(self._plan[position], self._trace[position + 1], values, levels)
            self._regress_over(self._plan[position], self._trace[position], values, levels)
            self._rest.append((values, levels))
        self._rest.reverse()

    def _settle(self, index: int, state, values: dict, levels: dict) -> None:
        """Replaces derived values that an action may change by all on which they rest."""
        if not self._bases:
            return
        roles = self._roles[index]
        for variable in [one for one in values if one in self._bases]:
            base, numbers = self._bases[variable]
            if base.isdisjoint(roles.writes) and numbers.isdisjoint(roles.alters + roles.takes):
                continue
            del values[variable]
            values.update((one, state[one]) for one in base)
            for number in numbers:
                level = state[self._variables + number]
                self._narrow(levels, number, level, level)

    def _regress_over(self, index: int, state, values: dict, levels: dict) -> None:
        needs, others, effects, _, _, _ = self._actions[index]
        for conditions, variable, _ in effects:
            if all(state[one] == value for one, value in conditions):
                values.pop(variable, None)
        values.update(needs)
        # Other values might do as well, but this is simple.
        for variable, _ in others:
            values[variable] = state[variable]
        for conditions, _, _ in effects:
            for variable, _ in conditions:
                values[variable] = state[variable]
        for number, least, most, added, level in self._numbers[index]:
            if level >= 0:
                levels.pop(number, None)
            elif number in levels:
                low, high = levels[number]
                levels[number] = (low - added, high - added)
            self._narrow(levels, number, least, most)

    def _narrow(self, levels: dict, number: int, least: int, most: int) -> None:
        low, high = levels.get(number, (0, self._limits[number]))
        levels[number] = (max(low, least), min(high, most))
