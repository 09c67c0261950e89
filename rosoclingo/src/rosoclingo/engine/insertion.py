# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
"""Plans by insertion, and large neighbourhood search by requests, for tasks that count seconds.

A plan is an order of the chains of requests (:mod:`~rosoclingo.engine.chains`), without ways, and
its value is that of its schedule (:mod:`~rosoclingo.engine.scheduling`). Request by request, a
chain is inserted where the value is best; of the many places, those with the least detours are
tried. If a number runs out, an action that adds to it is inserted, too. Then, again and again, some
related requests are taken out and inserted anew.

Random numbers have a fixed seed, and work is counted in items that are timed.
"""

from array import array

import cython

from rosoclingo.engine.chains import Chains
from rosoclingo.engine.kinds import MAKESPAN
from rosoclingo.engine.scheduling import Scheduler
from rosoclingo.engine.timing import Timetable

FAR = cython.declare(cython.longlong, 1 << 40)
NOISE = cython.declare(cython.int, 10)  # seconds
MOST_OF_CHAIN = cython.declare(cython.int, 14)  # places for one chain that are looked at
MOST_TRIED = 10  # places for a chain that are valid
MOST_LOOKED_AT = 45  # with those that are not
MOST_FILLS = 8  # for one chain
FILL_PLACES = 4
MORE_EARLY = 2  # places for what another actuator does first, if it goes somewhere for that
FILL = -1  # instead of the request for which an action is
MOST_DISTANCE = 200  # seconds, between related requests
ITEMS_PER_EVALUATION = 120  # which take about as long
FACTS_PER_ITEM = 33  # of the task, for each of which that takes longer
ROUNDS_PER_PAIR = 50  # of requests
IN_VAIN = 300  # rounds, before the search goes back to the best plan


@cython.cfunc
def longs(storage) -> cython.p_longlong:
    return cython.cast(cython.p_longlong, cython.cast(cython.size_t, storage.buffer_info()[0]))


@cython.cfunc
def ints(storage) -> cython.p_int:
    return cython.cast(cython.p_int, cython.cast(cython.size_t, storage.buffer_info()[0]))


if not cython.compiled:
    globals().update(longs=lambda storage: storage, ints=lambda storage: storage)


class Solution:
    """An order of actions, with the request for which each of them is."""

    __slots__ = ("order", "owners", "score", "value")

    def __init__(self, order: list, owners: list) -> None:
        self.order, self.owners = order, owners
        self.score, self.value = 0, ()


def inserter_of(task: tuple):
    """Returns what makes plans of a task by insertion, None if that is not possible.

    Args:
        task: A :class:`~rosoclingo.engine.flat.FlatTask`, or a tuple like it.
    """
    if task[6] or not task[4]:
        return None
    if not task[9]:  # an action lasts as long as it costs
        lasting = [action[4] for action in task[5]]
        task = (*task[:9], lasting, *task[10:13], (MAKESPAN, 0), *task[14:])
    chains = Chains(task)
    if not chains.are_complete:
        return None
    inserter = Inserter(task, Timetable(task, {}), chains)
    return inserter if inserter.requests else None


@cython.cclass
class Inserter:
    """Makes and improves plans of one task. Used by one thread at a time."""

    scheduler = cython.declare(object, visibility="readonly")
    chains = cython.declare(object, visibility="readonly")
    actions: list
    domains: list
    durations: list
    due: dict
    distances: dict  # by variable, an array of seconds by two of its values
    shapes: dict  # of each chain
    spots_of: dict  # by variable, an array of where actions begin and end
    stops_array = cython.declare(object)
    stops: cython.p_int  # of the actions at places: position, place before, place
    stops_size: cython.int
    keys_array = cython.declare(object)
    keys: cython.p_longlong  # of the best places: detour, first and last position
    places_of: dict  # of each request
    requests: list
    movable: list  # requests that may be taken out
    standing = cython.declare(object)
    random: cython.uint
    solution = cython.declare(object, visibility="readonly")
    best = cython.declare(object, visibility="readonly")
    in_vain: cython.int
    rounds_in_vain: cython.int
    items_per_evaluation: cython.int

    def __init__(self, task: tuple, table, chains) -> None:
        """Prepares the search.

        Args:
            task: A :class:`~rosoclingo.engine.flat.FlatTask` that counts seconds and has no derived
                variables, or a tuple like it.
            table: Its :class:`~rosoclingo.engine.timing.Timetable`.
            chains: Those of its requests, :class:`~rosoclingo.engine.chains.Chains`.
        """
        self.scheduler = Scheduler(task, table)
        self.chains = chains
        self.actions = task[5]
        self.domains = task[0]
        self.durations = task[9]
        self.due = {}
        for request, seconds, _ in task[10]:
            self.due[request] = min(seconds, self.due.get(request, seconds))
        self.distances = {}
        for (variable, before, after), (_, seconds) in self.chains.paths.items():
            size = task[0][variable]
            if variable not in self.distances:
                self.distances[variable] = array("q", [1 << 40]) * (size * size)
                for value in range(size):
                    self.distances[variable][value * size + value] = 0
            self.distances[variable][before * size + after] = seconds
        self.shapes, self.places_of, self.spots_of = {}, {}, {}
        self.keys_array = array("q", [0]) * (3 * MOST_OF_CHAIN)
        self.keys = longs(self.keys_array)
        self.random = 1
        self.in_vain = self.rounds_in_vain = 0
        self.best = None
        facts = sum([1 + len(one[0]) + len(one[2]) + len(one[3]) for one in task[5]])
        self.items_per_evaluation = ITEMS_PER_EVALUATION + facts // FACTS_PER_ITEM
        self.scheduler.run([])
        self.requests = [
            request for request in range(len(task[4])) if self.scheduler.when_met(request) < 0
        ]
        self.movable, self.standing = self.requests, None

    def hold(self, standing) -> None:
        """Keeps what is begun of a plan in all solutions.

        Args:
            standing: That plan, as :class:`~rosoclingo.engine.standing.Standing`.
        """
        self.standing = standing
        begun = {self.chains.owners.get(index) for index in standing.begun}
        self.movable = [request for request in self.requests if request not in begun]

    @property
    def evaluations(self) -> int:
        """The work until now, as the number of states that a search estimates meanwhile."""
        return self.scheduler.work // self.items_per_evaluation

    @property
    def is_stuck(self) -> bool:
        """Whether so many rounds have found nothing better that others hardly will."""
        return self.rounds_in_vain >= ROUNDS_PER_PAIR * len(self.movable) ** 2

    def draw(self, size: int) -> int:
        """Draws a number from 0 to one less than a size."""
        self.random = (self.random * 1103515245 + 12345) & 0x7FFFFFFF
        return (self.random >> 8) % size

    def shuffle(self, things: list) -> list:
        left = list(things)
        drawn = []
        while left:
            drawn.append(left.pop(self.draw(len(left))))
        return drawn

    def first(self, stop):
        """Inserts all requests, the most urgent ones first.

        Args:
            stop: Called now and then; true ends it.

        Returns:
            The plan, None if no place was found for some request, or if it was told to stop.
        """
        solution = Solution([], [])
        never = 1 << 40
        for request in sorted(self.requests, key=lambda one: (self.due.get(one, never), one)):
            if stop() or not self.insert(solution, request):
                return None
            if self.price(solution):
                solution = self.sorted(solution)
        return self.adopt(solution)

    def begin_with(self, plan: list) -> bool:
        """Begins with a plan; returns whether it consists of chains."""
        fills = {index for found in self.chains.fills.values() for index in found}
        solution = Solution([], [])
        for index in plan:
            if index in self.chains.owners:
                solution.owners.append(self.chains.owners[index])
            elif index in fills:
                solution.owners.append(FILL)
            elif index in self.chains.moves:
                continue
            else:
                return False
            solution.order.append(index)
        if not self.price(solution) or len(self.requests) > len(set(solution.owners) - {FILL}):
            return False
        self.adopt(solution)
        return True

    def adopt(self, solution) -> list:
        self.price(solution)
        self.solution = self.best = self.sorted(solution)
        self.in_vain = self.rounds_in_vain = 0
        return self.scheduler.plan()

    def price(self, solution) -> bool:
        """Sets the score and the value of a solution; returns whether it is possible."""
        if not self.scheduler.run(solution.order):
            return False
        solution.score, solution.value = self.scheduler.score(), self.scheduler.value()
        return True

    def sorted(self, solution):
        """Returns a solution that has just been priced, in the order in which actions begin."""
        begins = self.scheduler.begins_of(len(solution.order))
        places = sorted(range(len(begins)), key=begins.__getitem__)
        other = Solution(
            [solution.order[place] for place in places],
            [solution.owners[place] for place in places],
        )
        if not self.price(other) or other.score > solution.score:
            self.price(solution)
            return solution
        return other

    def round(self):
        """Takes some requests out and inserts them again; returns a plan if it is the best one."""
        before = self.solution
        taken = self.related(before)
        other = self.without(before, set(taken))
        self.in_vain += 1
        self.rounds_in_vain += 1
        if other is None:
            return None
        for request in self.shuffle(taken):
            if not self.insert(other, request):
                return None
        if not self.price(other):
            return None
        if other.score * 10000 < before.score * (10000 + self.draw(100 + self.in_vain)):
            self.solution = self.sorted(other)
            if self.solution.value < self.best.value:
                self.best = self.solution
                self.in_vain = self.rounds_in_vain = 0
                return self.scheduler.plan()
        if self.in_vain > IN_VAIN:
            self.solution = self.best
            self.in_vain = 0
        return None

    def without(self, solution, taken: set):
        """Returns a solution without some requests, and without some of what fills numbers."""
        keeps = self.draw(2)
        pairs = [
            pair
            for pair in zip(solution.order, solution.owners)
            if pair[1] not in taken and (keeps or pair[1] != FILL)
        ]
        other = Solution([pair[0] for pair in pairs], [pair[1] for pair in pairs])
        return other if self.filled(other.order, other.owners, other) else None

    def related(self, solution) -> list:
        """Draws requests that are near to each other, or any."""
        movable = self.movable
        number = len(movable)
        size = min(number, 2 + self.draw(2 + min(6, number // 4)))
        if self.draw(5) == 0:
            return self.shuffle(movable)[:size]
        self.price(solution)
        met = {request: self.scheduler.when_met(request) for request in movable}
        chosen = movable[self.draw(number)]
        if self.draw(2):
            some = self.shuffle(movable)[:4]
            chosen = max(some, key=lambda one: self.badness(one, met[one]))
        places = self.places(chosen)

        def far(other: int) -> int:
            apart = 0
            others = self.places(other)
            for variable in places:
                if variable in others:  # an actuator that may do both
                    for value, end in zip(places[variable], others[variable]):
                        apart += self.distances[variable][value * self.domains[variable] + end]
                    break
            apart = min(apart, MOST_DISTANCE) + abs(met[other] - met[chosen]) // 4
            return apart * self.draw(1000)

        distances = {other: far(other) for other in movable}
        distances[chosen] = -1
        return sorted(movable, key=distances.__getitem__)[:size]

    def badness(self, request: int, met: int) -> int:
        due = self.due.get(request)
        return met + (5 * max(0, met - due) if due is not None else 0)

    def places(self, request: int) -> dict:
        """Returns where actuators go for a request, by the variable for where they are."""
        if request not in self.places_of:
            found: dict = {}
            for chain in self.chains.of_requests[request]:
                variable, _, spots, _ = self.shape(chain)
                if variable >= 0:
                    found.setdefault(variable, [spot[0] for spot in spots if spot[0] >= 0])
            self.places_of[request] = found
        return self.places_of[request]

    def shape(self, chain: tuple) -> tuple:
        """Returns how a chain goes on the map.

        Returns:
            The variable for where its last actuator is, -1 for none; how many of its first actions
            other actuators do; of each other one, where it begins and ends, -1 if that is anywhere;
            and whether one of the others goes somewhere, too.
        """
        if chain in self.shapes:
            return self.shapes[chain]
        roaming = self.chains.roaming
        mains = [self.actions[one][5] for one in chain if self.actions[one][5] in roaming]
        main = mains[len(mains) - 1] if mains else -1
        variable = roaming[main] if mains else -1
        first = 0
        while first < len(chain) - 1 and self.actions[chain[first]][5] != main:
            first += 1
        spots = [self.spot(index, variable) for index in chain[first:]]
        found = variable, first, spots, len(set(mains)) > 1
        self.shapes[chain] = found
        return found

    def spot(self, index: int, variable: int) -> tuple:
        """Returns the value of a variable at the begin and at the end of an action, -1 for any."""
        needs, _, effects, _, _, _ = self.actions[index]
        begins = [value for one, value in needs if one == variable]
        ends = [value for _, one, value in effects if one == variable]
        begin = begins[0] if begins else -1
        return begin, (ends[0] if ends else begin)

    def insert(self, solution, request: int) -> bool:
        """Inserts the best chain of a request at its best place; returns whether there is one."""
        options: list = []
        order = array("i", [*solution.order, 0])
        chains = self.chains.of_requests[request]
        plain = [chain for chain in chains if not self.shape(chain)[3]]
        if len(plain) < len(chains) and self.draw(2):
            chains = plain
        for chain in chains:
            self.find_places(order, chain, options)
        options.sort()
        best = Solution(solution.order, solution.owners)
        best.score = -1
        tried = 0
        for _, _, first, last, chain, split in options[:MOST_LOOKED_AT]:
            if self.try_places(solution, best, request, (first, last, chain, split)):
                tried += 1
                if tried == MOST_TRIED:
                    break
        size = len(solution.order)
        for chain in chains:
            self.try_places(solution, best, request, (size, size, chain, len(chain)))
        if best.score < 0:
            return False
        solution.order, solution.owners = best.order, best.owners
        return True

    def find_places(self, order, chain: tuple, options: list) -> None:
        """Adds places for a chain, each with its detour.

        Args:
            order: The actions, as an array with one more entry.
            chain: The chain.
            options: Gets the places, as the detour, a number, the position of the first action and
                that of the last ones, the chain, and how many of its actions are first ones.
        """
        variable, prefix, spots, _ = self.shape(chain)
        length = len(order) - 1
        if variable < 0:
            for place in (0, length // 2, self.draw(length + 1), length):
                options.append((self.draw(NOISE), len(options), place, place, chain, 1))
            return
        for split in dict.fromkeys((1, len(spots) - 1)):
            self.find_detours(variable, order, (chain, prefix, spots), max(1, split), options)

    def find_stops(self, variable: int, order) -> None:
        """Notes which actions need a value of a variable, and the values before and there."""
        i: cython.int
        length: cython.int = len(order) - 1
        size: cython.int = 0
        here: cython.int = self.scheduler.initial_value(variable)
        actions: cython.p_int = ints(order)
        if variable not in self.spots_of:
            pairs = [self.spot(index, variable) for index in range(len(self.actions))]
            self.spots_of[variable] = array("i", [place for pair in pairs for place in pair])
        spots: cython.p_int = ints(self.spots_of[variable])
        self.stops_array = array("i", [0]) * (3 * length + 3)
        self.stops = ints(self.stops_array)
        for i in range(length):
            if spots[2 * actions[i] + 1] < 0:
                continue
            self.stops[3 * size] = i
            self.stops[3 * size + 1] = here
            self.stops[3 * size + 2] = spots[2 * actions[i]]
            if spots[2 * actions[i]] < 0:
                self.stops[3 * size + 2] = spots[2 * actions[i] + 1]
            here = spots[2 * actions[i] + 1]
            size += 1
        self.stops[3 * size], self.stops[3 * size + 1] = length, here
        self.stops_size = size

    def legs(self, variable: int, spots: list, split: int) -> tuple:
        """Returns where the two parts of a chain begin and end, and how long they go on the map."""
        distances, domain = self.distances[variable], self.domains[variable]
        known = [spot for spot in spots[:split] if spot[0] >= 0]
        rest = [spot for spot in spots[split:] if spot[0] >= 0]
        if not known:
            known, rest = rest[:1], rest[1:]
        if not known:
            return ()
        pairs = [*zip(known, known[1:]), *zip(rest, rest[1:])]
        inner = sum([distances[one[1] * domain + two[0]] for one, two in pairs])
        middle = known[len(known) - 1][1]
        if not rest:
            return known[0][0], middle, middle, middle, inner, False
        return known[0][0], middle, rest[0][0], rest[len(rest) - 1][1], inner, True

    def find_detours(self, variable: int, order, shape: tuple, split: int, options: list) -> None:
        """Adds the places with the least detours."""
        i: cython.int
        j: cython.int
        k: cython.int
        kept: cython.int = 0
        domain: cython.int = self.domains[variable]
        detour: cython.longlong
        leg: cython.longlong
        distances: cython.p_longlong = longs(self.distances[variable])
        chain, prefix, spots = shape
        legs = self.legs(variable, spots, split)
        if not legs:
            return
        begin: cython.int = legs[0]
        middle: cython.int = legs[1]
        second: cython.int = legs[2]
        end: cython.int = legs[3]
        inner: cython.longlong = legs[4]
        has_rest: cython.bint = legs[5]
        self.find_stops(variable, order)
        size: cython.int = self.stops_size
        stops: cython.p_int = self.stops
        keys: cython.p_longlong = self.keys
        for i in range(size + 1):
            leg = distances[stops[3 * i + 1] * domain + begin] + inner
            for j in range(i, size + 1 if has_rest else i + 1):
                if j == i:
                    detour = leg + distances[middle * domain + second]
                else:
                    detour = leg + distances[middle * domain + stops[3 * i + 2]]
                    detour -= distances[stops[3 * i + 1] * domain + stops[3 * i + 2]]
                    detour += distances[stops[3 * j + 1] * domain + second]
                if j < size:
                    detour += distances[end * domain + stops[3 * j + 2]]
                    detour -= distances[stops[3 * j + 1] * domain + stops[3 * j + 2]]
                self.random = (self.random * 1103515245 + 12345) & 0x7FFFFFFF
                detour += (self.random >> 8) % NOISE
                if i == size:
                    detour += 3 * size
                if kept == MOST_OF_CHAIN and detour >= keys[3 * kept - 3]:
                    continue
                k = min(kept, MOST_OF_CHAIN - 1)
                while k > 0 and keys[3 * k - 3] > detour:
                    keys[3 * k], keys[3 * k + 1] = keys[3 * k - 3], keys[3 * k - 2]
                    keys[3 * k + 2] = keys[3 * k - 1]
                    k -= 1
                keys[3 * k], keys[3 * k + 1], keys[3 * k + 2] = detour, stops[3 * i], stops[3 * j]
                kept = min(kept + 1, MOST_OF_CHAIN)
        for k in range(kept):
            if keys[3 * k] < FAR:
                options.append(
                    (keys[3 * k], len(options), keys[3 * k + 1], keys[3 * k + 2], chain,
                     prefix + split)
                )  # fmt: skip

    def try_places(self, solution, best, request: int, place: tuple) -> bool:
        """Tries a place for a chain; returns whether it is possible."""
        first, last, chain, split = place
        order, owners = solution.order, solution.owners
        _, prefix, _, is_mixed = self.shape(chain)
        early = [first]
        if prefix:
            early.append(self.draw(2) * self.draw(first + 1))
        if is_mixed:
            early += [self.draw(first + 1) for _ in range(MORE_EARLY)]
        found = False
        for begin in dict.fromkeys(early):
            new_order = [
                *order[:begin], *chain[:prefix], *order[begin:first], *chain[prefix:split],
                *order[first:last], *chain[split:], *order[last:],
            ]  # fmt: skip
            new_owners = [
                *owners[:begin], *([request] * prefix), *owners[begin:first],
                *([request] * (split - prefix)), *owners[first:last],
                *([request] * (len(chain) - split)), *owners[last:],
            ]  # fmt: skip
            if self.filled(new_order, new_owners, best):
                found = True
        return found

    def filled(self, order: list, owners: list, best) -> bool:
        """Tries an order, with what fills numbers that run out; returns whether it is possible.

        It becomes the best one if it is better.
        """
        scheduler = self.scheduler
        left = MOST_FILLS
        while not scheduler.run(order):
            failed = scheduler.failed_at
            fills = self.chains.fills.get(scheduler.lacking, ())
            if not fills or left == 0:
                return False
            left -= 1
            further = failed, 0
            chosen = None
            positions = [failed]
            actor = self.actions[order[failed]][5]
            place = failed - 1
            while place >= 0 and len(positions) < FILL_PLACES:
                if self.actions[order[place]][5] == actor:
                    positions.append(place)
                place -= 1
            for place in positions:
                for fill in fills:
                    if scheduler.run([*order[:place], fill, *order[place : failed + 1]]):
                        reached = failed + 2, -scheduler.busy
                    else:
                        reached = scheduler.failed_at - 1, -scheduler.busy
                    if reached > further and reached[0] > failed:
                        further, chosen = reached, (place, fill)
            if chosen is None:
                return False
            place, fill = chosen
            order = [*order[:place], fill, *order[place:]]
            owners = [*owners[:place], FILL, *owners[place:]]
        if self.standing is not None and not self.standing.keeps(scheduler.plan()):
            return False
        score = scheduler.score()
        if best.score <= 0 or score < best.score:
            best.order, best.owners, best.score = order, owners, score
        return True
