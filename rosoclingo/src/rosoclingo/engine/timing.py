# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
"""When each action of a plan begins and ends, as lib/order.lp has it.

An action begins when those that it depends on have ended and its actuator is free, and lasts as
long as it costs, or for its seconds if the task counts seconds. For this, each variable has two
slots, the last time that an action read it, and the last time that one changed it; a number has
three; each actuator, and whatever actions occupy, has one. An action waits for some slots and marks
some. A request that becomes met is an item like an action, which takes no time and whose number
follows those of the actions.

Compiled, this runs on pointers into arrays; uncompiled, on the arrays.
"""

from array import array

import cython

from rosoclingo.engine.kinds import ADDS, BECOMES, NEEDS_LEAST, NEEDS_MOST, TAKES


@cython.cfunc
def ints(storage) -> cython.p_int:
    return cython.cast(cython.p_int, cython.cast(cython.size_t, storage.buffer_info()[0]))


@cython.cfunc
def longs(storage) -> cython.p_longlong:
    return cython.cast(cython.p_longlong, cython.cast(cython.size_t, storage.buffer_info()[0]))


if not cython.compiled:
    globals().update(ints=lambda storage: storage, longs=lambda storage: storage)


class _Slots:
    """The slots for which an item waits, and those that it marks."""

    def __init__(self, task: tuple, bases: dict) -> None:
        domains, _, limits, _, _, actions = task[:6]
        self._bases = bases
        self._first_number = 2 * len(domains)
        self.first_actor = self._first_number + 3 * len(limits)
        self._first_occupied = self.first_actor + max([one[5] for one in actions], default=-1) + 1
        self.waits: set = set()
        self.marks: set = set()
        self.lags: dict = {}  # how long after its end an item marks a slot

    def clear(self) -> None:
        self.waits, self.marks = set(), set()
        self.lags = {}

    def read(self, variable: int) -> None:
        if variable in self._bases:  # who reads it reads all on which it rests
            variables, numbers = self._bases[variable]
            for one in variables:
                self.read(one)
            for number in numbers:
                self.treat(NEEDS_MOST, number)
            return
        self.waits.add(2 * variable + 1)
        self.marks.add(2 * variable)

    def write(self, variable: int, lag: int) -> None:
        self.waits.update((2 * variable, 2 * variable + 1))
        self.marks.add(2 * variable + 1)
        if lag:
            self.lags[2 * variable + 1] = lag

    def treat(self, kind: int, number: int) -> None:
        takes = self._first_number + 3 * number
        heeds, alters = takes + 1, takes + 2
        self.waits.add(alters)
        if kind == TAKES:
            self.waits.add(heeds)
            self.marks.add(takes)
        elif kind in (ADDS, BECOMES):
            self.waits.update((takes, heeds))
            self.marks.add(alters)
        else:
            self.marks.add(heeds)
            if kind == NEEDS_MOST:
                self.waits.add(takes)

    def altered(self, number: int) -> int:
        return self._first_number + 3 * number + 2

    def use(self, actor: int) -> None:
        if actor >= 0:
            self.waits.add(self.first_actor + actor)
            self.marks.add(self.first_actor + actor)

    def occupy(self, thing: int) -> None:
        self.waits.add(self._first_occupied + thing)
        self.marks.add(self._first_occupied + thing)

    def of_actor(self, actor: int) -> int:
        return self.first_actor + actor if actor >= 0 else -1

    def size(self, things: int) -> int:
        return self._first_occupied + things


@cython.cclass
class Timetable:
    """The items of a task with their slots. Used by one thread at a time."""

    owned: list
    size = cython.declare(cython.int, visibility="readonly")
    """How many slots there are."""
    first_actor = cython.declare(cython.int, visibility="readonly")
    """The slot of actuator 0; those of the others follow."""
    starts = cython.declare(object, visibility="readonly")
    """The slots before anything is done; some are negative, see FlatTask.since."""
    durations = cython.declare(object, visibility="readonly")
    actor_slots = cython.declare(object, visibility="readonly")
    """The slot of the actuator of each action, -1 if it has none."""
    wait_starts = cython.declare(object, visibility="readonly")
    waits = cython.declare(object, visibility="readonly")
    mark_starts = cython.declare(object, visibility="readonly")
    marks = cython.declare(object, visibility="readonly")
    lags = cython.declare(object, visibility="readonly")
    """How long after the end of its item each mark is made."""

    def __init__(self, task: tuple, bases: dict) -> None:
        """Finds the slots of all items.

        Args:
            task: A :class:`~rosoclingo.engine.flat.FlatTask`, or a tuple like it.
            bases: Those of :func:`~rosoclingo.engine.regression.find_bases`.
        """
        limits, requests, actions, occupied = task[2], task[4], task[5], task[8]
        slots = _Slots(task, bases)
        self.first_actor = slots.first_actor
        self.size = slots.size(max([thing + 1 for things in occupied for thing in things] + [0]))
        self.starts = array("q", [0]) * (self.size + 1)
        for actor, seconds in task[14]:
            self.starts[self.first_actor + actor] = seconds
        for variable, seconds in task[15]:
            self.starts[2 * variable + 1] = seconds
        for number, seconds in task[16]:
            self.starts[slots.altered(number)] = seconds
        lasting = task[9] or [action[4] for action in actions]
        self.durations = array("q", lasting + [0] * (len(requests) + 1))
        ready = {(variable, value): seconds for variable, value, seconds in task[11]}
        self.actor_slots = array("i", [slots.of_actor(action[5]) for action in actions] + [0])
        self.wait_starts, self.waits = array("i", [0]), array("i")
        self.mark_starts, self.marks, self.lags = array("i", [0]), array("i"), array("q")
        for index, (needs, others, effects, numbers, _, actor) in enumerate(actions):
            for variable, _ in needs + others:
                slots.read(variable)
            for conditions, variable, value in effects:
                slots.write(variable, ready.get((variable, value), 0))
                for one, _ in conditions:
                    slots.read(one)
            for kind, number, _ in numbers:
                slots.treat(kind, number)
            slots.use(actor)
            for thing in occupied[index] if occupied else ():
                slots.occupy(thing)
            self._add(slots)
        for wishes, ranges in requests:
            for variable, _ in wishes:
                slots.read(variable)
            for number, _, most in ranges:
                slots.treat(NEEDS_LEAST, number)
                if most < limits[number]:
                    slots.treat(NEEDS_MOST, number)
            self._add(slots)
        self.waits.append(0)
        self.marks.append(0)
        self.lags.append(0)

    def _add(self, slots: _Slots) -> None:
        self.waits.extend(sorted(slots.waits))
        marks = sorted(slots.marks)
        self.marks.extend(marks)
        self.lags.extend([slots.lags.get(slot, 0) for slot in marks])
        self.wait_starts.append(len(self.waits))
        self.mark_starts.append(len(self.marks))
        slots.clear()

    def start(self):
        """Returns the slots before anything was done."""
        return array("q", self.starts)

    def add(self, items: list, slots) -> list:
        """Lets items take place, each as early as it can; returns when each one ends.

        Args:
            items: Actions and requests, in order.
            slots: The slots before them, which become those after them.
        """
        item: cython.int
        i: cython.int
        end: cython.longlong
        times: cython.p_longlong = longs(slots)
        wait_starts: cython.p_int = ints(self.wait_starts)
        waits: cython.p_int = ints(self.waits)
        mark_starts: cython.p_int = ints(self.mark_starts)
        marks: cython.p_int = ints(self.marks)
        lags: cython.p_longlong = longs(self.lags)
        durations: cython.p_longlong = longs(self.durations)
        ends = []
        for item in items:
            end = 0
            for i in range(wait_starts[item], wait_starts[item + 1]):
                end = max(end, times[waits[i]])
            end += durations[item]
            for i in range(mark_starts[item], mark_starts[item + 1]):
                times[marks[i]] = max(times[marks[i]], end + lags[i])
            ends.append(end)
        return ends

    def add_before(self, items: list, tails) -> None:
        """Finds how much time passes at least from a slot's time to the end of some items.

        Args:
            items: Actions and requests, in order.
            tails: For each slot, that time after these items; becomes that before them.
        """
        item: cython.int
        i: cython.int
        tail: cython.longlong
        times: cython.p_longlong = longs(tails)
        wait_starts: cython.p_int = ints(self.wait_starts)
        waits: cython.p_int = ints(self.waits)
        mark_starts: cython.p_int = ints(self.mark_starts)
        marks: cython.p_int = ints(self.marks)
        lags: cython.p_longlong = longs(self.lags)
        durations: cython.p_longlong = longs(self.durations)
        for item in reversed(items):
            tail = 0
            for i in range(mark_starts[item], mark_starts[item + 1]):
                tail = max(tail, times[marks[i]] + lags[i])
            tail += durations[item]
            for i in range(wait_starts[item], wait_starts[item + 1]):
                times[waits[i]] = max(times[waits[i]], tail)

    def waits_of(self, item: int) -> list:
        """Returns the slots for which an item waits."""
        return list(self.waits[self.wait_starts[item] : self.wait_starts[item + 1]])

    def marks_of(self, item: int) -> list:
        """Returns the slots that an item marks."""
        return list(self.marks[self.mark_starts[item] : self.mark_starts[item + 1]])

    def dependencies(self, plan: list) -> list:
        """Returns, for each position of a plan, the positions before on which it depends."""
        last: dict = {}  # slot: the positions that have marked it
        found = []
        for position, index in enumerate(plan):
            before: set = set()
            for slot in self.waits_of(index):
                before.update(last.get(slot, ()))
            found.append(sorted(before))
            for slot in self.marks_of(index):
                last.setdefault(slot, []).append(position)
        return found

    def separate(self, plan: list, order: list, chosen: set) -> tuple:
        """Parts a plan so that some actions are in a row, with those that have to be between them.

        Args:
            plan: The plan.
            order: Its positions, in an order in which it can be done.
            chosen: The positions of these actions.

        Returns:
            The actions before, these, and those after.
        """
        touched: set = set()  # slots that depend on them
        later = set()
        for position in order:
            index = plan[position]
            if position in chosen or not touched.isdisjoint(self.waits_of(index)):
                later.add(position)
                touched.update(self.marks_of(index))
        needed: set = set()  # slots on which they depend
        window = set()
        for position in reversed(order):
            index = plan[position]
            if position in chosen or not needed.isdisjoint(self.marks_of(index)):
                needed.update(self.waits_of(index))
                if position in later:
                    window.add(position)
        before = [plan[one] for one in order if one not in later]
        after = [plan[one] for one in order if one in later and one not in window]
        return before, [plan[one] for one in order if one in window], after
