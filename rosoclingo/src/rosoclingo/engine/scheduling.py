# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
"""Executes orders of actions and times them in seconds, for tasks that count seconds.

An order leaves out what follows from it: the ways of robots to where the next action needs them,
and which of several equal actuators, such as cooks, does an action. Of these, the one that is free
first acts.

Each action begins as early as :mod:`~rosoclingo.engine.timing` allows. If a variable kept a value
for too long, the action that sets the value begins later, which may delay others.

Compiled, this runs on pointers into arrays; uncompiled, on the arrays.
"""

from array import array

import cython

from rosoclingo.engine.kinds import MAKESPAN, WAITS
from rosoclingo.engine.states import merge_numbers

MOST_PLACES = 128  # of a robot that gets somewhere by several ways, such as by a lift
ROUNDS = cython.declare(cython.int, 8)  # of delays, before a plan counts as one that keeps too long
WORK_OF_RUN = cython.declare(cython.int, 40)  # in items
SPAN = cython.declare(cython.int, 4)  # entries for each time in which a value is kept
DIGITS = 10  # by which time counts more than the work of actuators, among plans to insert into
LATE_FACTOR = 20  # of lateness there, if it comes first


@cython.cfunc
def ints(storage) -> cython.p_int:
    return cython.cast(cython.p_int, cython.cast(cython.size_t, storage.buffer_info()[0]))


@cython.cfunc
def longs(storage) -> cython.p_longlong:
    return cython.cast(cython.p_longlong, cython.cast(cython.size_t, storage.buffer_info()[0]))


if not cython.compiled:
    globals().update(ints=lambda storage: storage, longs=lambda storage: storage)


def find_ways(task: tuple) -> dict:
    """Returns the ways, by variable and by the values before and after.

    A way changes nothing but a variable. Only one actuator changes the variable so, and it can do
    so back and forth.

    Args:
        task: A :class:`~rosoclingo.engine.flat.FlatTask`, or a tuple like it.
    """
    found: dict = {}
    actors: dict = {}
    for index, (needs, others, effects, _, _, actor) in enumerate(task[5]):
        if others or len(needs) != 1 or len(effects) != 1 or actor < 0:
            continue
        (variable, before), (conditions, changed, after) = needs[0], effects[0]
        if conditions or changed != variable or before == after:
            continue
        key = variable, before, after
        actors.setdefault(variable, set()).add(actor)
        if key not in found or task[9][index] < task[9][found[key]]:
            found[key] = index
    roaming = {
        variable
        for variable, before, after in found
        if (variable, after, before) in found and len(actors[variable]) == 1
    }
    return {key: index for key, index in found.items() if key[0] in roaming}


def find_paths(task: tuple, all_ways: dict) -> dict:
    """Returns how actuators get from one value to another, by the variable and both values.

    Each path is given by its first way and by how long all of its ways take, such as first to a
    lift, and from there by lift.

    Args:
        task: A :class:`~rosoclingo.engine.flat.FlatTask`, or a tuple like it.
        all_ways: Those of :func:`find_ways`.
    """
    found: dict = {}
    of_variables: dict = {}
    for key, way in all_ways.items():
        found[key] = way, task[9][way]
        of_variables.setdefault(key[0], []).append((key[1], key[2], way))
    for variable, ways in of_variables.items():
        size = task[0][variable]
        if size <= MOST_PLACES and len(ways) < size * (size - 1):
            for before, after, way, seconds in _paths(size, ways, task[9]):
                found[variable, before, after] = way, seconds
    return found


def _paths(size: cython.int, ways: list, lasting: list) -> list:
    """Returns the shortest paths of several ways between places that no way connects."""
    i: cython.int
    j: cython.int
    k: cython.int
    there: cython.longlong
    further: cython.longlong
    far: cython.longlong = 1 << 40
    lengths = array("q", [far]) * (size * size)
    firsts = array("i", [-1]) * (size * size)
    length: cython.p_longlong = longs(lengths)
    first: cython.p_int = ints(firsts)
    direct = set()
    for before, after, way in ways:
        length[before * size + after] = max(1, lasting[way])  # so that no path is a circle
        first[before * size + after] = way
        direct.add(before * size + after)
    is_direct = array("i", [one in direct or one % (size + 1) == 0 for one in range(size * size)])
    fixed: cython.p_int = ints(is_direct)
    for k in range(size):
        for i in range(size):
            there = length[i * size + k]
            if there < far and i != k:
                for j in range(size):
                    further = there + length[k * size + j]
                    if not fixed[i * size + j] and further < length[i * size + j]:
                        length[i * size + j] = further
                        first[i * size + j] = first[i * size + k]
    return [
        (one // size, one % size, first[one], length[one])
        for one in range(size * size)
        if length[one] < far and one not in direct
    ]


def find_twins(task: tuple) -> dict:
    """Returns actions of several actuators that differ in nothing else, by each of them."""
    groups: dict = {}
    for index, (needs, others, effects, numbers, cost, actor) in enumerate(task[5]):
        if actor >= 0:
            key = repr((needs, others, effects, numbers, cost, task[8][index] if task[8] else ()))
            groups.setdefault(key, []).append(index)
    return {index: group for group in groups.values() if len(group) > 1 for index in group}


@cython.cclass
class Scheduler:
    """Executes and times orders of actions of one task. Used by one thread at a time."""

    owned: list
    variables: cython.int
    entries: cython.int
    actions_size: cython.int
    requests: cython.int
    current: cython.p_int  # values of variables, then levels of numbers
    initial: cython.p_int
    need_starts: cython.p_int
    needs: cython.p_int  # variable, value, 1 if it has to be that one and 0 if any other
    range_starts: cython.p_int
    ranges: cython.p_int  # number's entry, least, most
    effect_starts: cython.p_int
    effects: cython.p_int  # variable, value
    condition_starts: cython.p_int  # of each effect
    conditions: cython.p_int  # variable, value
    holding: cython.p_int  # effects that take place
    change_starts: cython.p_int
    changes: cython.p_int  # number's entry, what is added, level afterwards or -1
    costs: cython.p_longlong
    way_starts: cython.p_int  # of each variable, -1 if no way changes it
    ways: cython.p_int  # the first one of a path, by the values before and after
    domains: cython.p_int
    twin_starts: cython.p_int
    twins: cython.p_int
    wisher_starts: cython.p_int  # of each entry
    wishers: cython.p_int  # requests
    wish_starts: cython.p_int  # of each request
    wishes: cython.p_int  # entry, least, most
    keep_starts: cython.p_int  # of each variable
    keeps: cython.p_int  # value, seconds, seconds until it has the value
    due_starts: cython.p_int  # of each request
    dues: cython.p_longlong  # deadline, weight
    earliest: cython.p_longlong  # of each request
    has_earliest: cython.bint
    since: cython.p_int  # of each variable, the item that has set a value that it keeps
    is_met: cython.p_int
    newly_met: cython.int  # requests that the last action has met
    # The slots of items, see timing.
    slots: cython.int
    starts: cython.p_longlong
    times: cython.p_longlong
    durations: cython.p_longlong
    actor_slots: cython.p_int
    wait_starts: cython.p_int
    waits: cython.p_int
    mark_starts: cython.p_int
    marks: cython.p_int
    lags: cython.p_longlong
    # The items of the last order.
    buffers: list
    room: cython.int
    size: cython.int
    items: cython.p_int
    placed: cython.p_int  # of each position of the order, its item
    begins: cython.p_longlong
    ends: cython.p_longlong
    releases: cython.p_longlong
    spans_array = cython.declare(object)
    spans: cython.p_int  # item that sets, item that changes, seconds, seconds until it is set
    spans_size: cython.int
    spans_room: cython.int
    preference: cython.int
    together: cython.longlong
    excess = cython.declare(cython.longlong, visibility="readonly")
    """By how many seconds values are kept for too long."""
    late = cython.declare(cython.longlong, visibility="readonly")
    """The weighted lateness."""
    waiting = cython.declare(cython.longlong, visibility="readonly")
    """The sum of the times at which requests are met."""
    makespan = cython.declare(cython.longlong, visibility="readonly")
    cost = cython.declare(cython.longlong, visibility="readonly")
    busy = cython.declare(cython.longlong, visibility="readonly")
    """The seconds of all actions."""
    work = cython.declare(cython.longlong, visibility="readonly")
    """How many items have been timed."""
    failed_at = cython.declare(cython.int, visibility="readonly")
    """The position of the first action that was not possible, -1 if all were."""
    lacking = cython.declare(cython.int, visibility="readonly")
    """The number of which there is too little for it, -1 if that is not the reason."""

    def __init__(self, task: tuple, table) -> None:
        """Reads a task without derived variables.

        Args:
            task: A :class:`~rosoclingo.engine.flat.FlatTask` that counts seconds, or a tuple.
            table: Its :class:`~rosoclingo.engine.timing.Timetable`.
        """
        domains, initial, limits, levels, requests, actions = task[:6]
        self.owned = [table]
        self.variables = len(domains)
        self.entries = len(domains) + len(limits)
        self.actions_size = len(actions)
        self.requests = len(requests)
        self.current = self.keep([0] * self.entries)
        self.initial = self.keep(initial + levels)
        self.domains = self.keep(domains)
        self.holding = self.keep([0] * max([len(one[2]) for one in actions], default=0))
        self.since = self.keep([0] * len(domains))
        self.is_met = self.keep([0] * len(requests))
        self._build_actions(actions, limits)
        self._build_ways(task)
        self._build_requests(task)
        self.preference, self.together = task[13]
        self.slots = table.size
        self.starts = longs(table.starts)
        self.times = self.keep_long([0] * (table.size + 1))
        self.durations, self.actor_slots = longs(table.durations), ints(table.actor_slots)
        self.wait_starts, self.waits = ints(table.wait_starts), ints(table.waits)
        self.mark_starts, self.marks = ints(table.mark_starts), ints(table.marks)
        self.lags = longs(table.lags)
        self.costs = self.keep_long([action[4] for action in actions])
        self.work = 0
        self.room = self.spans_room = 0
        self.spans_array = array("i")

    @cython.cfunc
    def keep(self, numbers: list) -> cython.p_int:
        kept = array("i", [*numbers, 0])
        self.owned.append(kept)
        return ints(kept)

    @cython.cfunc
    def keep_long(self, numbers: list) -> cython.p_longlong:
        kept = array("q", [*numbers, 0])
        self.owned.append(kept)
        return longs(kept)

    def _build_actions(self, actions: list, limits: list) -> None:
        need_starts, needs, range_starts, ranges = [0], [], [0], []
        effect_starts, effects, condition_starts, conditions = [0], [], [0], []
        change_starts, changes = [0], []
        for wanted, others, happening, numbers, _, _ in actions:
            for variable, value in wanted:
                needs += [variable, value, 1]
            for variable, value in others:
                needs += [variable, value, 0]
            for given, variable, value in happening:
                effects += [variable, value]
                for one, before in given:
                    conditions += [one, before]
                condition_starts.append(len(conditions))
            for number, least, most, added, level in merge_numbers(numbers, limits):
                entry = self.variables + number
                ranges += [entry, least, most]
                if added or level >= 0:
                    changes += [entry, added, level]
            need_starts.append(len(needs))
            range_starts.append(len(ranges))
            effect_starts.append(len(effects) // 2)
            change_starts.append(len(changes))
        self.need_starts, self.needs = self.keep(need_starts), self.keep(needs)
        self.range_starts, self.ranges = self.keep(range_starts), self.keep(ranges)
        self.effect_starts, self.effects = self.keep(effect_starts), self.keep(effects)
        self.condition_starts = self.keep(condition_starts)
        self.conditions = self.keep(conditions)
        self.change_starts, self.changes = self.keep(change_starts), self.keep(changes)

    def _build_ways(self, task: tuple) -> None:
        domains = task[0]
        by_variable: dict = {}
        paths = find_paths(task, find_ways(task))
        for (variable, before, after), (action, _) in paths.items():
            by_variable.setdefault(variable, []).append(
                (before * domains[variable] + after, action)
            )
        way_starts = [-1] * len(domains)
        ways: list = []
        for variable, found in by_variable.items():
            way_starts[variable] = len(ways)
            table = [-1] * (domains[variable] ** 2)
            for place, action in found:
                table[place] = action
            ways += table
        self.way_starts, self.ways = self.keep(way_starts), self.keep(ways)
        groups = find_twins(task)
        twin_starts, twins = [0], []
        for action in range(len(task[5])):
            twins += groups.get(action, [])
            twin_starts.append(len(twins))
        self.twin_starts, self.twins = self.keep(twin_starts), self.keep(twins)

    def _build_requests(self, task: tuple) -> None:
        by_entry: list = [[] for _ in range(self.entries)]
        wish_starts, wishes = [0], []
        for index, (values, levels) in enumerate(task[4]):
            for variable, value in values:
                wishes += [variable, value, value]
                by_entry[variable].append(index)
            for number, least, most in levels:
                wishes += [self.variables + number, least, most]
                by_entry[self.variables + number].append(index)
            wish_starts.append(len(wishes))
        wisher_starts, wishers = [0], []
        for found in by_entry:
            wishers += found
            wisher_starts.append(len(wishers))
        self.wisher_starts, self.wishers = self.keep(wisher_starts), self.keep(wishers)
        self.wish_starts, self.wishes = self.keep(wish_starts), self.keep(wishes)
        of_requests: list = [[] for _ in task[4]]
        for request, seconds, weight in task[10]:
            of_requests[request] += [seconds, weight]
        due_starts, dues = [0], []
        for found in of_requests:
            dues += found
            due_starts.append(len(dues))
        self.due_starts, self.dues = self.keep(due_starts), self.keep_long(dues)
        earliest = [0] * len(task[4])
        for request, seconds in task[17]:
            earliest[request] = seconds
        self.earliest, self.has_earliest = self.keep_long(earliest), len(task[17]) > 0
        lags = {(variable, value): seconds for variable, value, seconds in task[11]}
        kept: list = [[] for _ in task[0]]
        for variable, value, seconds in task[12]:
            kept[variable] += [value, seconds, lags.get((variable, value), 0)]
        keep_starts, keeps = [0], []
        for found in kept:
            keeps += found
            keep_starts.append(len(keeps))
        self.keep_starts, self.keeps = self.keep(keep_starts), self.keep(keeps)

    def run(self, order: list) -> bool:
        """Executes and times an order; returns whether all of its actions are possible."""
        position: cython.int
        action: cython.int
        i: cython.int
        size: cython.int = len(order)
        self.begin()
        self.make_room(8 * size + self.requests + 8)
        self.failed_at = self.lacking = -1
        self.work += WORK_OF_RUN
        for i in range(self.requests):
            self.try_to_meet(i)
        for position in range(size):
            action = order[position]
            if self.room - self.size < self.entries + self.requests + 2:
                self.make_room(2 * self.room + self.entries + self.requests + 2)
            if self.twin_starts[action + 1] > self.twin_starts[action]:
                action = self.free_first(action)
            if not self.act(action):
                self.failed_at = position
                return False
            self.placed[position] = self.size - 1 - self.newly_met
        self.settle()
        return True

    def value(self) -> tuple:
        """Returns the value of the last order; the least is the best."""
        if self.preference == WAITS:
            preferred, rest = self.waiting, self.cost
        elif self.preference == MAKESPAN:
            preferred, rest = self.makespan, self.cost
        else:
            preferred, rest = self.cost, self.makespan
        if self.together:
            return self.excess, self.late + self.together * preferred, rest
        return self.excess, self.late, preferred, rest

    def score(self) -> int:
        """Returns a number by which orders compare while they are made; the least is the best."""
        preferred = (self.waiting, self.makespan, self.cost)[self.preference]
        if self.together:
            counted = self.late + self.together * preferred
        else:
            counted = LATE_FACTOR * self.late + preferred
        return (1_000_000 * self.excess + counted) * DIGITS + self.busy

    def plan(self) -> list:
        """Returns the actions of the last order, with ways, and with the actuators that do them."""
        return [self.items[i] for i in range(self.size) if self.items[i] < self.actions_size]

    def begins_of(self, size: int) -> list:
        """Returns when each action of the last order begins, which has so many."""
        return [self.begins[self.placed[i]] for i in range(size)]

    def when_met(self, request: int) -> int:
        """Returns when the last order meets a request, -1 if it does not."""
        i: cython.int
        for i in range(self.size):
            if self.items[i] == self.actions_size + request:
                return self.ends[i]
        return -1

    def initial_value(self, variable: int) -> int:
        """Returns the value that a variable has at first."""
        return self.initial[variable]

    def time(self, items: list, spans: list) -> None:
        """Times items.

        Args:
            items: Actions and requests, in order.
            spans: Times in which a value is kept, each as the item that sets it, -1 for none, the
                one that changes it, for how long it may be kept, and when it is set after the item.
        """
        item: cython.int
        self.begin()
        self.make_room(len(items))
        for item in items:
            self.add(item)
        for first, last, seconds, lag in spans:
            self.add_span(first, last, seconds, lag)
        self.settle()

    def times_of_actors(self, first: int, actors: list) -> int:
        """Returns the sum of the times at which actuators end.

        Args:
            first: The slot of actuator 0.
            actors: The actuators.
        """
        return sum([self.times[first + actor] for actor in actors if actor >= 0])

    def make_room(self, size: int) -> None:
        """Has room for some items; those that are there stay."""
        if size <= self.room:
            return
        kept: cython.int = self.size
        arrays = [array(kind, [0]) * size for kind in "iiqqq"]
        i: cython.int
        items: cython.p_int = ints(arrays[0])
        placed: cython.p_int = ints(arrays[1])
        begins: cython.p_longlong = longs(arrays[2])
        ends: cython.p_longlong = longs(arrays[3])
        releases: cython.p_longlong = longs(arrays[4])
        for i in range(kept):
            items[i], placed[i], begins[i] = self.items[i], self.placed[i], self.begins[i]
            ends[i], releases[i] = self.ends[i], self.releases[i]
        self.buffers = arrays
        self.items, self.placed = items, placed
        self.begins, self.ends, self.releases = begins, ends, releases
        self.room = size

    @cython.cfunc
    @cython.exceptval(check=False)
    def begin(self) -> cython.void:
        i: cython.int
        self.size = self.spans_size = 0
        self.cost = self.busy = self.excess = 0
        for i in range(self.entries):
            self.current[i] = self.initial[i]
        for i in range(self.requests):
            self.is_met[i] = 0
        for i in range(self.slots):
            self.times[i] = self.starts[i]
        for i in range(self.variables):
            self.since[i] = -1

    @cython.cfunc
    @cython.exceptval(check=False)
    def free_first(self, action: cython.int) -> cython.int:
        """Returns the action of the actuator that ends it first, of equal ones."""
        i: cython.int
        best: cython.int = action
        end: cython.longlong = -1
        other: cython.longlong
        for i in range(self.twin_starts[action], self.twin_starts[action + 1]):
            other = self.times[self.actor_slots[self.twins[i]]] + self.durations[self.twins[i]]
            if end < 0 or other < end:
                best, end = self.twins[i], other
        return best

    @cython.cfunc
    @cython.exceptval(-1)
    def act(self, action: cython.int) -> cython.int:
        """Does an action, after the ways that it needs; returns 0 if that is not possible."""
        i: cython.int = self.need_starts[action]
        variable: cython.int
        value: cython.int
        way: cython.int
        table: cython.int
        while i < self.need_starts[action + 1]:
            variable, value = self.needs[i], self.current[self.needs[i]]
            if (value == self.needs[i + 1]) != (self.needs[i + 2] == 1):
                if self.needs[i + 2] == 0 or self.way_starts[variable] < 0:
                    return 0
                table = self.way_starts[variable] + self.needs[i + 1]
                while value != self.needs[i + 1]:
                    way = self.ways[table + value * self.domains[variable]]
                    if way < 0 or not self.has_numbers(way):
                        return 0
                    if self.room - self.size < self.requests + 2:
                        self.make_room(2 * self.room)
                    self.do(way)
                    value = self.current[variable]
            i += 3
        if not self.has_numbers(action):
            return 0
        self.do(action)
        return 1

    @cython.cfunc
    @cython.exceptval(check=False)
    def has_numbers(self, action: cython.int) -> cython.bint:
        i: cython.int = self.range_starts[action]
        level: cython.int
        while i < self.range_starts[action + 1]:
            level = self.current[self.ranges[i]]
            if level < self.ranges[i + 1]:
                self.lacking = self.ranges[i] - self.variables
                return False
            if level > self.ranges[i + 2]:
                return False
            i += 3
        return True

    @cython.cfunc
    @cython.exceptval(-1)
    def do(self, action: cython.int) -> cython.int:
        """Does an action that is possible, and notes when it begins and ends."""
        i: cython.int
        j: cython.int
        holds: cython.bint
        size: cython.int = 0
        item: cython.int = self.size
        self.newly_met = 0
        self.add(action)
        for i in range(self.effect_starts[action], self.effect_starts[action + 1]):
            holds = True
            j = self.condition_starts[i]
            while j < self.condition_starts[i + 1]:
                if self.current[self.conditions[j]] != self.conditions[j + 1]:
                    holds = False
                    break
                j += 2
            if holds:
                self.holding[size] = i
                size += 1
        for j in range(size):
            i = self.holding[j]
            self.set(self.effects[2 * i], self.effects[2 * i + 1], item)
        i = self.change_starts[action]
        while i < self.change_starts[action + 1]:
            if self.changes[i + 2] < 0:
                self.current[self.changes[i]] += self.changes[i + 1]
            else:
                self.current[self.changes[i]] = self.changes[i + 2]
            i += 3
        for j in range(size):
            self.meet(self.effects[2 * self.holding[j]])
        i = self.change_starts[action]
        while i < self.change_starts[action + 1]:
            self.meet(self.changes[i])
            i += 3
        return 0

    @cython.cfunc
    @cython.exceptval(-1)
    def set(self, variable: cython.int, value: cython.int, item: cython.int) -> cython.int:
        i: cython.int = self.keep_starts[variable]
        lag: cython.int
        while i < self.keep_starts[variable + 1]:
            if self.keeps[i] == self.current[variable]:
                if self.since[variable] != item:
                    lag = self.starts[2 * variable + 1]
                    if self.since[variable] >= 0:
                        lag = self.keeps[i + 2]
                    self.add_span(self.since[variable], item, self.keeps[i + 1], lag)
                break
            i += 3
        self.current[variable] = value
        self.since[variable] = item
        return 0

    @cython.cfunc
    @cython.exceptval(-1)
    def add_span(
        self, first: cython.int, last: cython.int, seconds: cython.int, lag: cython.int
    ) -> cython.int:
        at: cython.int = SPAN * self.spans_size
        if at == self.spans_room:
            self.spans_array.extend([0] * (at + 64))
            self.spans = ints(self.spans_array)
            self.spans_room = len(self.spans_array) // SPAN * SPAN
        self.spans[at], self.spans[at + 1] = first, last
        self.spans[at + 2], self.spans[at + 3] = seconds, lag
        self.spans_size += 1
        return 0

    @cython.cfunc
    @cython.exceptval(check=False)
    def meet(self, entry: cython.int) -> cython.void:
        i: cython.int
        for i in range(self.wisher_starts[entry], self.wisher_starts[entry + 1]):
            if not self.is_met[self.wishers[i]]:
                self.try_to_meet(self.wishers[i])

    @cython.cfunc
    @cython.exceptval(check=False)
    def try_to_meet(self, request: cython.int) -> cython.void:
        i: cython.int = self.wish_starts[request]
        level: cython.int
        while i < self.wish_starts[request + 1]:
            level = self.current[self.wishes[i]]
            if level < self.wishes[i + 1] or level > self.wishes[i + 2]:
                return
            i += 3
        self.is_met[request] = 1
        self.newly_met += 1
        self.add(self.actions_size + request)

    @cython.cfunc
    @cython.exceptval(check=False)
    def add(self, item: cython.int) -> cython.void:
        """Adds an item, which begins as early as it can."""
        self.items[self.size] = item
        self.releases[self.size] = 0
        self.place(self.size)
        self.size += 1
        self.work += 1
        if item < self.actions_size:
            self.busy += self.durations[item]
            self.cost += self.costs[item]

    @cython.cfunc
    @cython.exceptval(check=False)
    def place(self, index: cython.int) -> cython.void:
        """Times an item after those before it."""
        i: cython.int
        item: cython.int = self.items[index]
        end: cython.longlong = self.releases[index]
        for i in range(self.wait_starts[item], self.wait_starts[item + 1]):
            end = max(end, self.times[self.waits[i]])
        self.begins[index] = end
        end += self.durations[item]
        self.ends[index] = end
        for i in range(self.mark_starts[item], self.mark_starts[item + 1]):
            self.times[self.marks[i]] = max(self.times[self.marks[i]], end + self.lags[i])

    @cython.cfunc
    @cython.exceptval(check=False)
    def settle(self) -> cython.void:
        """Delays what would be kept for too long, and adds up what counts."""
        i: cython.int
        left: cython.int = ROUNDS
        request: cython.int
        due: cython.int
        if self.spans_size > 0 or self.has_earliest:
            while self.delay() and left > 0:
                left -= 1
                for i in range(self.slots):
                    self.times[i] = self.starts[i]
                for i in range(self.size):
                    self.place(i)
                self.work += self.size
        self.makespan = self.waiting = self.late = 0
        for i in range(self.size):
            self.makespan = max(self.makespan, self.ends[i])
            request = self.items[i] - self.actions_size
            if request >= 0:
                self.waiting += self.ends[i]
                due = self.due_starts[request]
                while due < self.due_starts[request + 1]:
                    self.late += self.dues[due + 1] * max(0, self.ends[i] - self.dues[due])
                    due += 2

    @cython.cfunc
    @cython.exceptval(check=False)
    def delay(self) -> cython.int:
        """Finds by how much items have to begin later; returns whether there are any."""
        i: cython.int = 0
        first: cython.int
        over: cython.longlong
        is_any: cython.bint = False
        self.excess = 0
        while i < SPAN * self.spans_size:
            first = self.spans[i]
            over = self.begins[self.spans[i + 1]] - self.spans[i + 2] - self.spans[i + 3]
            if first >= 0:
                over -= self.ends[first]
            if over > 0:
                self.excess += over
                if first >= 0:
                    self.releases[first] = max(self.releases[first], self.begins[first] + over)
                    is_any = True
            i += SPAN
        if self.has_earliest:
            is_any |= self.delay_early()
        return is_any

    @cython.cfunc
    @cython.exceptval(check=False)
    def delay_early(self) -> cython.int:
        """Has actions begin later that meet requests too early; returns whether there are any."""
        i: cython.int
        last: cython.int = -1
        over: cython.longlong
        is_any: cython.bint = False
        for i in range(self.size):
            if self.items[i] < self.actions_size:
                last = i
            elif last >= 0:
                over = self.earliest[self.items[i] - self.actions_size] - self.ends[i]
                if over > 0:
                    over += self.ends[i] - self.ends[last]
                    self.releases[last] = max(self.releases[last], self.begins[last] + over)
                    is_any = True
        return is_any
