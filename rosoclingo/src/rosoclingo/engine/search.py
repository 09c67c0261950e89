# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
"""The search for a plan: greedy best-first by h_FF and by the number of wishes that are not met.

Each of the two estimates has a queue of all successors and one of the preferred ones, with which
the relaxed plan begins. Successors wait with the estimate of the state before them (a lazy search),
and among equal ones the actuator with the least work comes first, so that all of them work. The
four queues take turns, and whenever an estimate improves, the preferred successors have the next
thousand turns. :meth:`Search.find_within` is the same search as weighted A*, for improving a plan.

Neither time nor memory changes the result: a search finds the same plan or none before its limit.
"""

from array import array

import cython

from rosoclingo.engine.relaxation import RelaxedTask
from rosoclingo.engine.states import States

_FIRST_ROOM = 1024
BOOST = cython.declare(cython.int, 1000)
WINDOW_BOOST = cython.declare(cython.int, 100)
NEAREST = cython.declare(cython.int, 3)  # requests that are tried before those further away
STEPS_PER_CHECK = cython.declare(cython.int, 15)  # one less than a power of 2
MOST_LOAD = cython.declare(cython.longlong, (1 << 31) - 1)
LOAD_BITS = cython.declare(cython.int, 31)
MOST_ESTIMATE = cython.declare(cython.longlong, (1 << 24) - 1)
ESTIMATE_BITS = cython.declare(cython.int, 24)


@cython.cfunc
def ints(storage) -> cython.p_int:
    return cython.cast(cython.p_int, cython.cast(cython.size_t, storage.buffer_info()[0]))


@cython.cfunc
def longs(storage) -> cython.p_longlong:
    return cython.cast(cython.p_longlong, cython.cast(cython.size_t, storage.buffer_info()[0]))


if not cython.compiled:
    globals().update(ints=lambda storage: storage, longs=lambda storage: storage)


class OutOfTimeError(Exception):
    """The search was told to stop."""


@cython.cclass
class Heap:
    """Successors by key; among equal keys the one that was added first. A binary heap."""

    keys_array = cython.declare(object)
    keys: cython.p_longlong
    items_array = cython.declare(object)
    items: cython.p_int
    room: cython.int
    size: cython.int
    turns: cython.longlong  # how often it was chosen, less its boosts

    def __init__(self) -> None:
        """Makes an empty one."""
        self.keys_array, self.items_array = array("q"), array("i")
        self.room = 0
        self.clear()

    def clear(self) -> None:
        """Removes all."""
        self.size = 0
        self.turns = 0

    def grow(self) -> None:
        """Makes room for half as many items more."""
        more: int = max(_FIRST_ROOM, self.room // 2)
        self.keys_array.frombytes(bytes(8 * more))
        self.items_array.frombytes(bytes(4 * more))
        self.keys = longs(self.keys_array)
        self.items = ints(self.items_array)
        self.room += more

    @cython.cfunc
    @cython.exceptval(-1)
    def push(self, key: cython.longlong, item: cython.int) -> cython.int:
        i: cython.int
        above: cython.int
        if self.size == self.room:
            self.grow()
        i = self.size
        self.size += 1
        while i > 0:
            above = (i - 1) >> 1
            if self.keys[above] < key:
                break
            if self.keys[above] == key and self.items[above] < item:
                break
            self.keys[i] = self.keys[above]
            self.items[i] = self.items[above]
            i = above
        self.keys[i] = key
        self.items[i] = item
        return 0

    @cython.cfunc
    @cython.exceptval(check=False)
    def pop(self) -> cython.int:
        i: cython.int = 0
        below: cython.int
        top: cython.int = self.items[0]
        keys: cython.p_longlong = self.keys
        items: cython.p_int = self.items
        self.size -= 1
        key: cython.longlong = keys[self.size]
        item: cython.int = items[self.size]
        while True:
            below = 2 * i + 1
            if below >= self.size:
                break
            if below + 1 < self.size and (
                keys[below + 1] < keys[below]
                or (keys[below + 1] == keys[below] and items[below + 1] < items[below])
            ):
                below += 1
            if keys[below] > key or (keys[below] == key and items[below] > item):
                break
            keys[i] = keys[below]
            items[i] = items[below]
            i = below
        keys[i] = key
        items[i] = item
        return top


@cython.cclass
class Wanted:
    """Goals of a search, compared with a state."""

    owned: list
    state: cython.p_int
    entries: cython.p_int
    least: cython.p_int
    most: cython.p_int
    size: cython.int

    def __init__(self, state, first_request: int, goals: tuple) -> None:
        """Takes the array of the state, and the goals as in :meth:`Search.find_within`."""
        values, requests, levels = goals
        ranges = [(variable, value, value) for variable, value in values]
        ranges += [(first_request + request, 1, 1) for request in requests]
        ranges += levels
        self.size = len(ranges)
        self.owned = [state]
        self.state = ints(state)
        for column in range(3):
            self.owned.append(array("i", [one[column] for one in ranges] + [0]))
        self.entries = ints(self.owned[1])
        self.least = ints(self.owned[2])
        self.most = ints(self.owned[3])

    @cython.cfunc
    @cython.exceptval(check=False)
    def holds(self) -> cython.bint:
        i: cython.int
        for i in range(self.size):
            if not (self.least[i] <= self.state[self.entries[i]] <= self.most[i]):
                return False
        return True


@cython.cclass
class Timed:
    """The times of a search in which a way must not end too late, see ``Search.find_within``."""

    owned: tuple
    is_used = cython.declare(cython.bint)
    counts_waiting: cython.bint
    size: cython.int
    begin_times: cython.p_longlong
    times_array = cython.declare(object)
    times: cython.p_longlong  # of the slots, in the state in hand
    tails: cython.p_longlong
    latest: cython.longlong
    may_act: cython.p_int
    durations: cython.p_longlong
    actor_slots: cython.p_int
    wait_starts: cython.p_int
    waits: cython.p_int
    mark_starts: cython.p_int
    marks: cython.p_int
    path_array = cython.declare(object)
    path: cython.p_int
    path_room: cython.int

    def __init__(self) -> None:
        """Uses no times."""
        self.is_used = False
        self.path_array = array("i")
        self.path_room = 0

    def begin(self, timing) -> None:
        """Takes the times of a search; None: it uses none."""
        self.is_used = timing is not None
        if timing is None:
            return
        table, begin_times, tails, latest, may_act, counts_waiting = timing
        self.owned = timing
        self.size = table.size
        self.begin_times = longs(begin_times)
        self.times_array = array("q", begin_times)
        self.times = longs(self.times_array)
        self.tails = longs(tails)
        self.latest = latest
        self.may_act = ints(may_act)
        self.counts_waiting = counts_waiting
        self.durations, self.actor_slots = longs(table.durations), ints(table.actor_slots)
        self.wait_starts, self.waits = ints(table.wait_starts), ints(table.waits)
        self.mark_starts, self.marks = ints(table.mark_starts), ints(table.marks)

    @cython.cfunc
    @cython.exceptval(-1)
    def follow(self, links: tuple, state: cython.int) -> cython.int:
        """Finds out the times in a state."""
        parents: cython.p_int = ints(links[0])
        by: cython.p_int = ints(links[1])
        length: cython.int = 0
        i: cython.int
        action: cython.int
        end: cython.longlong
        while parents[state] >= 0:
            if length == self.path_room:
                self.path_room += 256
                self.path_array.frombytes(bytes(4 * 256))
                self.path = ints(self.path_array)
            self.path[length] = by[state]
            length += 1
            state = parents[state]
        for i in range(self.size):
            self.times[i] = self.begin_times[i]
        while length > 0:
            length -= 1
            action = self.path[length]
            end = self.end_of(action)
            for i in range(self.mark_starts[action], self.mark_starts[action + 1]):
                self.times[self.marks[i]] = max(self.times[self.marks[i]], end)
        return 0

    @cython.cfunc
    @cython.inline
    @cython.exceptval(check=False)
    def end_of(self, action: cython.int) -> cython.longlong:
        i: cython.int
        end: cython.longlong = 0
        for i in range(self.wait_starts[action], self.wait_starts[action + 1]):
            end = max(end, self.times[self.waits[i]])
        return end + self.durations[action]

    @cython.cfunc
    @cython.exceptval(check=False)
    def step(self, action: cython.int, cost: cython.longlong) -> cython.longlong:
        """Returns what an action counts in the state in hand, -1 if the plan ends too late."""
        i: cython.int
        slot: cython.int = self.actor_slots[action]
        end: cython.longlong
        if slot >= 0 and not self.may_act[slot]:
            return -1
        end = self.end_of(action)
        for i in range(self.mark_starts[action], self.mark_starts[action + 1]):
            if end + self.tails[self.marks[i]] > self.latest:
                return -1
        if self.counts_waiting and slot >= 0:
            return end - self.times[slot]
        return cost


@cython.cclass
class Search:
    """Searches for plans of a task. Used by one thread at a time."""

    stop = cython.declare(object)
    relaxation = cython.declare(object)
    states = cython.declare(object, visibility="readonly")
    """The states of the last search."""
    evaluations = cython.declare(cython.longlong, visibility="readonly")
    """How many states all searches have estimated."""
    owned: list
    actors: cython.p_int
    loads: cython.p_int  # what each action adds to the load of its actor
    costs: cython.p_int
    actors_size: cython.int
    loads_before: cython.p_longlong  # of each actor, where the search begins
    loads_of: cython.p_longlong  # of each actor, before the state in hand
    applicable: cython.p_int
    preferred: cython.p_int
    sizes: cython.p_int
    first_request: cython.int
    is_preferred: cython.p_int
    requests_size: cython.int
    request: cython.int  # which the search is for; -1 for all
    state: cython.p_int
    by_estimate: Heap
    preferred_by_estimate: Heap
    by_unmet: Heap
    preferred_by_unmet: Heap
    queues: tuple
    bound: cython.longlong  # of the cost of a cheaper way
    greed: cython.longlong
    least_estimate: cython.longlong
    item_states_array = cython.declare(object)
    item_states: cython.p_int
    item_actions_array = cython.declare(object)
    item_actions: cython.p_int
    item_distances_array = cython.declare(object)  # of the state after it
    item_distances: cython.p_longlong
    item_distances_room: cython.int
    items_room: cython.int
    items_size: cython.int
    distances_array = cython.declare(object)  # of each state, in a search for a cheaper way
    distances: cython.p_longlong
    distances_room: cython.int
    timed: Timed
    is_exhausted = cython.declare(cython.bint, visibility="readonly")
    """True if the last :meth:`find_within` has proven that no such plan exists."""
    steps: cython.int

    def __init__(self, task: tuple, stop) -> None:
        """Prepares the search.

        Args:
            task: A :class:`~rosoclingo.engine.flat.FlatTask`, or a tuple like it.
            stop: Called without arguments, now and then; true ends the search.
        """
        actions = task[5]
        self.stop = stop
        self.evaluations = 0
        self.steps = 0
        self.states = States(task)
        self.relaxation = RelaxedTask(task, self.states.state)
        self.first_request = len(task[0]) + len(task[2])
        self.requests_size = len(task[4])
        self.request = -1
        self.state = ints(self.states.state)
        self.owned = [array("i", [action[5] for action in actions] + [0])]
        self.actors = ints(self.owned[0])
        self.owned.append(array("i", [max(1, action[4]) for action in actions] + [0]))
        self.loads = ints(self.owned[1])
        self.owned.append(array("i", [action[4] for action in actions] + [0]))
        self.costs = ints(self.owned[2])
        used = {action[5] for action in actions} - {-1}
        self.actors_size = max(used) + 1 if len(used) > 1 else 0
        self.owned.append(array("q", [0] * (self.actors_size + 1)))
        self.loads_of = longs(self.owned[3])
        self.owned.append(array("i", [0] * (len(actions) + 1)))
        self.is_preferred = ints(self.owned[4])
        self.owned.append(array("q", [0] * (self.actors_size + 1)))
        self.loads_before = longs(self.owned[5])
        self.applicable = ints(self.relaxation.applicable)
        self.preferred = ints(self.relaxation.preferred)
        self.sizes = ints(self.relaxation.sizes)
        self.item_states_array, self.item_actions_array = array("i"), array("i")
        self.item_distances_array = array("q")
        self.item_distances_room = 0
        self.items_room = 0
        self.items_size = 0
        self.distances_array = array("q")
        self.distances_room = 0
        self.timed = Timed()
        self.is_exhausted = False
        self.by_estimate, self.preferred_by_estimate = Heap(), Heap()
        self.by_unmet, self.preferred_by_unmet = Heap(), Heap()
        self.queues = (
            self.by_estimate,
            self.preferred_by_estimate,
            self.by_unmet,
            self.preferred_by_unmet,
        )

    def reuse(self, stop) -> None:
        """Prepares for other searches of the task, with a limit and a count of states of their own.

        Args:
            stop: As for a new object.
        """
        self.stop = stop
        self.evaluations = 0

    @cython.cfunc
    @cython.exceptval(-1)
    def add_item(self, state: cython.int, action: cython.int) -> cython.int:
        if self.items_size == self.items_room:
            self.grow()
        self.item_states[self.items_size] = state
        self.item_actions[self.items_size] = action
        self.items_size += 1
        return self.items_size - 1

    def grow(self) -> None:
        """Makes room for half as many successors more."""
        more: int = max(_FIRST_ROOM, self.items_room // 2)
        self.item_states_array.frombytes(bytes(4 * more))
        self.item_actions_array.frombytes(bytes(4 * more))
        self.item_states = ints(self.item_states_array)
        self.item_actions = ints(self.item_actions_array)
        self.items_room += more

    @cython.cfunc
    @cython.exceptval(-1)
    def check(self) -> cython.int:
        self.steps += 1
        if (self.steps & STEPS_PER_CHECK) == 0 and self.stop():
            raise OutOfTimeError
        return 0

    @cython.cfunc
    @cython.exceptval(-1)
    def add_up_loads(self, state: cython.int) -> cython.int:
        """Adds up what each actor has done until a state."""
        i: cython.int
        for i in range(self.actors_size):
            self.loads_of[i] = self.loads_before[i]
        links: tuple = self.states.links()
        parents: cython.p_int = ints(links[0])
        by: cython.p_int = ints(links[1])
        while parents[state] >= 0:
            i = by[state]
            if self.actors[i] >= 0:
                self.loads_of[self.actors[i]] += self.loads[i]
            state = parents[state]
        return 0

    @cython.cfunc
    @cython.inline
    @cython.exceptval(check=False)
    def load_after(self, action: cython.int) -> cython.longlong:
        actor: cython.int = self.actors[action]
        if self.actors_size == 0 or actor < 0:
            return 0
        return min(MOST_LOAD, self.loads_of[actor] + self.costs[action])

    def clear(self) -> None:
        """Forgets the successors of the last search."""
        for queue in self.queues:
            queue.clear()
        self.items_size = 0

    def find(self):
        """Searches from the initial state for a plan that meets all requests.

        Returns:
            A plan, as a list of indices of actions, or None: no plan exists.

        Raises:
            OutOfTimeError: It was told to stop.
            MemoryError: There is no room for more states.
        """
        return self.search(-1)

    def find_soon(self, evaluations: int) -> tuple:
        """Searches from the initial state for a plan that meets all requests, or some of them.

        If that takes long, one request after the other is searched for: the nearest one, then that
        which is nearest from there, and so on. A search for all is long where much can be done that
        does not help the next one. It may end where nothing is found for those that are nearest.

        Args:
            evaluations: The most states that it looks at for all, and then for each of them.

        Returns:
            A plan, None if none exists; and whether it meets all requests, or none exists.

        Raises:
            OutOfTimeError: It was told to stop.
            MemoryError: There is no room for more states.
        """
        i: cython.int
        if self.requests_size == 1:
            return [], False
        begin = array("i", self.states.state)
        plan = self.search(evaluations)
        if plan is not None or self.is_exhausted:
            return plan, True
        self.states.restart(begin)
        plan = self.find_one_by_one(evaluations)
        is_whole = self.states.unmet_wishes() == 0
        self.states.restart(begin)
        self.relaxation.set_goals([], list(range(self.requests_size)))
        for i in range(self.actors_size):
            self.loads_before[i] = 0
        return plan, is_whole

    def find_one_by_one(self, evaluations: int) -> list:
        """Searches from the current state, and stays where the plan ends."""
        states = self.states
        i: cython.int
        actor: cython.int
        plan: list = []
        while True:
            left = [i for i in range(self.requests_size) if not self.is_met(i)]
            if not left:
                return plan
            self.relaxation.set_goals([], left)
            self.relaxation.evaluate()
            begin = array("i", states.state)
            for request in self.relaxation.nearest(left)[:NEAREST]:
                self.relaxation.set_goals([], [request])
                self.request = request
                part = self.search(evaluations)
                self.request = -1
                if part is not None:
                    break
                states.restart(begin)
            else:
                return plan
            plan += part
            for i in part:
                actor = self.actors[i]
                if actor >= 0:
                    self.loads_before[actor] += self.loads[i]
            states.restart(states.state)

    def search(self, evaluations: int):
        """Searches from the current state, and stays where the plan ends.

        Args:
            evaluations: The most states that it looks at; any number if negative.
        """
        queue: Heap
        estimate: cython.longlong
        unmet: cython.longlong
        least_estimate: cython.longlong = MOST_LOAD
        least_unmet: cython.longlong = MOST_LOAD
        left: cython.longlong = evaluations
        state: cython.int = 0
        item: cython.int
        self.clear()
        self.is_exhausted = False
        while True:
            unmet = self.states.unmet_wishes()
            if unmet == 0:
                return self.states.path(state)
            if self.request >= 0 and self.is_met(self.request):
                return self.states.path(state)
            if left == 0:
                return None
            left -= 1
            estimate = self.relaxation.evaluate()
            self.evaluations += 1
            if estimate >= 0:
                if unmet < least_unmet:
                    least_unmet = unmet
                    self.boost()
                if estimate < least_estimate:
                    least_estimate = estimate
                    self.boost()
                self.queue_successors(state, estimate, unmet)
            state = -1
            while state < 0:
                self.check()
                queue = self.choose()
                if queue.size == 0:
                    self.is_exhausted = True
                    return None
                queue.turns += 1
                item = queue.pop()
                state = self.states.expand(self.item_states[item], self.item_actions[item])

    @cython.cfunc
    @cython.exceptval(check=False)
    def is_met(self, request: cython.int) -> cython.bint:
        return self.state[self.first_request + request] != 0

    @cython.cfunc
    @cython.exceptval(check=False)
    def boost(self) -> cython.void:
        self.preferred_by_estimate.turns -= BOOST
        self.preferred_by_unmet.turns -= BOOST

    @cython.cfunc
    @cython.exceptval(check=False)
    def mark_preferred(self, mark: cython.int) -> cython.void:
        i: cython.int
        for i in range(self.sizes[1]):
            self.is_preferred[self.preferred[i]] = mark

    @cython.cfunc
    @cython.exceptval(-1)
    def queue_successors(
        self, state: cython.int, estimate: cython.longlong, unmet: cython.longlong
    ) -> cython.int:
        i: cython.int
        action: cython.int
        item: cython.int
        load: cython.longlong
        if self.actors_size > 0:
            self.add_up_loads(state)
        self.mark_preferred(1)
        for i in range(self.sizes[0]):
            action = self.applicable[i]
            load = self.load_after(action)
            item = self.add_item(state, action)
            self.by_estimate.push((estimate << LOAD_BITS) + load, item)
            self.by_unmet.push((unmet << LOAD_BITS) + load, item)
            if self.is_preferred[action]:
                self.preferred_by_estimate.push((estimate << LOAD_BITS) + load, item)
                self.preferred_by_unmet.push((unmet << LOAD_BITS) + load, item)
        self.mark_preferred(0)
        return 0

    @cython.cfunc
    def choose(self):
        """Returns the queue whose turn it is, an empty one if all are empty."""
        chosen: Heap = self.by_estimate
        queue: Heap
        for queue in self.queues:
            if queue.size > 0 and (chosen.size == 0 or queue.turns < chosen.turns):
                chosen = queue
        return chosen

    def set_costs(self, costs: list, weights: list) -> None:
        """Replaces the costs of the actions, and what they count in the estimate, at least 1."""
        i: cython.int
        for i in range(len(costs)):
            self.costs[i] = costs[i]
        self.relaxation.set_weights(weights)

    @cython.cfunc
    @cython.exceptval(-1)
    def set_distance(self, state: cython.int, distance: cython.longlong) -> cython.int:
        if state >= self.distances_room:
            more: int = max(_FIRST_ROOM, self.distances_room // 2)
            self.distances_array.frombytes(bytes(8 * more))
            self.distances = longs(self.distances_array)
            self.distances_room += more
        self.distances[state] = distance
        return 0

    @cython.cfunc
    @cython.exceptval(-1)
    def set_item_distance(self, item: cython.int, distance: cython.longlong) -> cython.int:
        if item >= self.item_distances_room:
            more: int = max(_FIRST_ROOM, self.item_distances_room // 2)
            self.item_distances_array.frombytes(bytes(8 * more))
            self.item_distances = longs(self.item_distances_array)
            self.item_distances_room += more
        self.item_distances[item] = distance
        return 0

    def find_within(
        self, start, goals: tuple, bound: int, greed: int, evaluations: int, *, timing=None
    ):
        """Searches for a way that costs less than a bound, by weighted A*.

        Args:
            start: The state that it begins in, as ``States.state``.
            goals: Values, as pairs; indices of requests that are to be met; and ranges of levels,
                as triples of the entry in the state, the least and the most.
            bound: What the way has to cost less than.
            greed: The weight of the estimate.
            evaluations: The most states that are estimated.
            timing: None, or a :class:`~rosoclingo.engine.timing.Timetable`; its slots before the
                way; for each of them, what time passes from there to the end of the plan; when
                that has to be; for each actuator, 1 if it may act; and 1 if a way counts the time
                that it takes its actuators, with the time that they wait, instead of its cost.

        Returns:
            The indices of the actions, or None: none was found.

        Raises:
            OutOfTimeError: It was told to stop.
            MemoryError: There is no room for more states.
        """
        distance: cython.longlong
        state: cython.int = 0
        item: cython.int
        left: cython.longlong = evaluations
        states = self.states
        wanted: Wanted = Wanted(states.state, self.first_request, goals)
        self.clear()
        self.bound = bound
        self.greed = greed
        self.least_estimate = MOST_LOAD
        self.is_exhausted = False
        self.timed.begin(timing)
        states.restart(start)
        self.relaxation.set_goals(goals[0], goals[1])
        self.set_distance(0, 0)
        while True:
            if wanted.holds():
                return states.path(state)
            if left <= 0:
                return None
            left -= 1
            self.queue_cheap_successors(state)
            state = -1
            while state < 0:
                self.check()
                item = self.next_cheap_item()
                if item < 0:
                    self.is_exhausted = True
                    return None
                distance = self.item_distances[item]
                state = states.expand(self.item_states[item], self.item_actions[item])
                if state < 0 and distance < self.distances[states.known]:
                    state = states.known
                    states.reparent(state, self.item_states[item], self.item_actions[item])
                if state >= 0:
                    self.set_distance(state, distance)

    @cython.cfunc
    @cython.exceptval(-1)
    def queue_cheap_successors(self, state: cython.int) -> cython.int:
        """Estimates the current state, and queues the successors that cost less than the bound."""
        i: cython.int
        action: cython.int
        item: cython.int
        step: cython.longlong
        distance: cython.longlong
        key: cython.longlong
        estimate: cython.longlong = self.relaxation.evaluate()
        timed: Timed = self.timed
        self.evaluations += 1
        if estimate < 0:
            return 0
        if estimate < self.least_estimate:
            self.least_estimate = estimate
            self.preferred_by_estimate.turns -= WINDOW_BOOST
        if timed.is_used:
            timed.follow(self.states.links(), state)
        self.mark_preferred(1)
        for i in range(self.sizes[0]):
            action = self.applicable[i]
            step = self.costs[action]
            if timed.is_used:
                step = timed.step(action, step)
                if step < 0:
                    continue
            distance = self.distances[state] + step
            if distance >= self.bound:
                continue
            key = (distance + self.greed * estimate) << ESTIMATE_BITS
            key += min(MOST_ESTIMATE, estimate)
            item = self.add_item(state, action)
            self.set_item_distance(item, distance)
            self.by_estimate.push(key, item)
            if self.is_preferred[action]:
                self.preferred_by_estimate.push(key, item)
        self.mark_preferred(0)
        return 0

    @cython.cfunc
    @cython.exceptval(check=False)
    def next_cheap_item(self) -> cython.int:
        """Returns the next successor, preferred ones and all in turns; -1 if there is none."""
        queue: Heap = self.by_estimate
        preferred: Heap = self.preferred_by_estimate
        if preferred.size > 0 and (preferred.turns <= queue.turns or queue.size == 0):
            queue = preferred
        if queue.size == 0:
            return -1
        queue.turns += 1
        return queue.pop()
