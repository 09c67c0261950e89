# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
"""States that a search has reached: applies actions, and recognises states that were there before.

The current state is an array of integers: the values of the variables, the levels of the numbers,
and 1 for each request that is met, else 0. A stored state has as few bits for each of them as it
needs, in words of 31 bits; all are in one array, which grows, with a hash table of their indices.

Compiled, this runs on pointers into arrays, which ``ints`` takes; uncompiled, on the arrays.
"""

from array import array

import cython

from rosoclingo.engine.kinds import ADDS, BECOMES, NEEDS_LEAST, TAKES

WORD_BITS = 31  # so that the sign does not matter
_FIRST_ROOM = 1024
UNCHANGED = cython.declare(cython.int, -1)
# Of the hash, by Fowler, Noll and Vo; with types, as large literals would be Python objects.
HASH_START = cython.declare(cython.uint, 2166136261)
HASH_PRIME = cython.declare(cython.uint, 16777619)
HASH_MASK = cython.declare(cython.uint, 0xFFFFFFFF)


@cython.cfunc
def ints(storage) -> cython.p_int:
    return cython.cast(cython.p_int, cython.cast(cython.size_t, storage.buffer_info()[0]))


if not cython.compiled:
    globals()["ints"] = lambda storage: storage


def merge_numbers(numbers: list, limits: list) -> list:
    """Returns what an action needs and changes of each number, with one entry for each number.

    Each entry is (number, least before, most before, what is added, level afterwards or -1).
    """
    merged: dict = {}
    for kind, number, amount in numbers:
        one = merged.setdefault(number, [number, 0, limits[number], 0, 0, UNCHANGED])
        if kind == TAKES:
            one[3] += amount
        elif kind == ADDS:
            one[4] += amount
        elif kind == BECOMES:
            one[5] = amount
        elif kind == NEEDS_LEAST:
            one[1] = max(one[1], amount)
        else:
            one[2] = min(one[2], amount)
    return [
        (number, max(least, takes), min(most, limits[number] - adds), adds - takes, level)
        for number, least, most, takes, adds, level in merged.values()
    ]


@cython.cclass
class States:
    """The states of a search, each with the state before it and the action between them."""

    owned: list  # the arrays of the task, which must not move
    state = cython.declare(object, visibility="readonly")
    """Array: the current state."""
    current: cython.p_int
    entries: cython.int
    variables: cython.int
    requests: cython.int
    first_request: cython.int  # where in the state it is told whether the first one is met
    initial: cython.p_int
    need_starts: cython.p_int  # of each action
    needs: cython.p_int  # variable, value, 1 if it has to be that one and 0 if any other
    range_starts: cython.p_int  # of each action
    ranges: cython.p_int  # number's entry in the state, least, most
    effect_starts: cython.p_int  # of each action
    effect_variables: cython.p_int
    effect_values: cython.p_int
    condition_starts: cython.p_int  # of each effect
    condition_variables: cython.p_int
    condition_values: cython.p_int
    pending: cython.p_int  # effects that take place
    change_starts: cython.p_int  # of each action
    changes: cython.p_int  # number's entry in the state, what is added, level afterwards
    value_starts: cython.p_int  # of each request
    values: cython.p_int  # variable, value
    level_starts: cython.p_int
    levels: cython.p_int  # number's entry in the state, least, most
    unmet: cython.int
    strata_size: cython.int
    stratum_starts: cython.p_int  # of each stratum
    derived: cython.p_int  # variable, the value that it has without a rule
    rules_size: cython.int
    rule_needs: cython.p_int  # how many values each rule needs
    rule_missing: cython.p_int
    rule_facts: cython.p_int  # what each rule derives: variable, value
    reading_size: cython.int
    reading: cython.p_int  # variables that rules read, and that are not derived
    fact_offsets: cython.p_int  # of each variable
    fact_user_starts: cython.p_int  # of each value of each variable
    fact_users: cython.p_int  # rules
    tests_size: cython.int
    tests: cython.p_int  # rule, number's entry in the state, least, most
    derived_stack: cython.p_int  # variables
    stacked: cython.int
    word_of: cython.p_int
    shift_of: cython.p_int
    mask_of: cython.p_int
    width: cython.int
    rows_array = cython.declare(object)
    rows: cython.p_int
    room: cython.int
    parents_array = cython.declare(object)
    parents: cython.p_int
    by_array = cython.declare(object)
    by: cython.p_int
    slots_array = cython.declare(object)
    slots: cython.p_int
    slots_mask: cython.uint
    size = cython.declare(cython.int, visibility="readonly")
    """The number of stored states."""
    known = cython.declare(cython.int, visibility="readonly")
    """The stored state to which the last action led, if that was stored already."""

    def __init__(self, task: tuple) -> None:
        """Reads the task, and stores its initial state as state 0.

        Args:
            task: A :class:`~rosoclingo.engine.flat.FlatTask`, or a tuple like it.
        """
        domains, initial, limits, levels, requests, actions, strata, rules = task[:8]
        self.owned = []
        self.variables = len(domains)
        self.requests = len(requests)
        self.first_request = len(domains) + len(limits)
        self.entries = self.first_request + len(requests)
        self._build_actions(actions, limits)
        self._build_requests(requests)
        self._build_rules(domains, strata, rules)
        self._build_words(task)
        self.state = array("i", initial + levels + [0] * (len(requests) + 1))
        self.current = ints(self.state)
        self.initial = self.keep(self.state)
        self.rows_array, self.parents_array, self.by_array = array("i"), array("i"), array("i")
        self.room = 0
        self.slots_array = None
        self.slots_mask = 0
        self.known = -1
        self.restart(self.state)

    @cython.cfunc
    def keep(self, values) -> cython.p_int:
        storage = array("i", values)
        storage.append(0)  # so that it has an address
        self.owned.append(storage)
        return ints(storage)

    def _build_actions(self, actions: list, limits: list) -> None:
        starts, variables, values = [0], [], []
        condition_starts, conditions = [0], []
        change_starts, changes = [0], []
        need_starts, all_needs = [0], []
        range_starts, ranges = [0], []
        for action in actions:
            for variable, value in action[0]:
                all_needs += [variable, value, 1]
            for variable, value in action[1]:
                all_needs += [variable, value, 0]
            need_starts.append(len(all_needs))
            for wanted, variable, value in action[2]:
                conditions += wanted
                condition_starts.append(len(conditions))
                variables.append(variable)
                values.append(value)
            starts.append(len(variables))
            for number, least, most, added, level in merge_numbers(action[3], limits):
                ranges += [self.variables + number, least, most]
                if added or level != UNCHANGED:
                    changes += [self.variables + number, added, level]
            change_starts.append(len(changes))
            range_starts.append(len(ranges))
        self.need_starts = self.keep(need_starts)
        self.needs = self.keep(all_needs)
        self.range_starts = self.keep(range_starts)
        self.ranges = self.keep(ranges)
        self.effect_starts = self.keep(starts)
        self.effect_variables = self.keep(variables)
        self.effect_values = self.keep(values)
        self.condition_starts = self.keep(condition_starts)
        self.condition_variables = self.keep([variable for variable, _ in conditions])
        self.condition_values = self.keep([value for _, value in conditions])
        self.change_starts = self.keep(change_starts)
        self.changes = self.keep(changes)
        self.pending = self.keep([0] * max([len(action[2]) for action in actions], default=0))

    def _build_requests(self, requests: list) -> None:
        value_starts, values = [0], []
        level_starts, levels = [0], []
        for wishes, number_wishes in requests:
            for variable, value in wishes:
                values += [variable, value]
            for number, least, most in number_wishes:
                levels += [self.variables + number, least, most]
            value_starts.append(len(values))
            level_starts.append(len(levels))
        self.value_starts = self.keep(value_starts)
        self.values = self.keep(values)
        self.level_starts = self.keep(level_starts)
        self.levels = self.keep(levels)

    def _build_rules(self, domains: list, strata: tuple, rules: tuple) -> None:
        offsets = []
        total: int = 0
        for size in domains:
            offsets.append(total)
            total += size
        users: list = [[] for _ in range(total)]
        facts, tests, needs = [], [], []
        read: set = set()
        for rule, (values, levels, variable, value) in enumerate(rules):
            facts += [variable, value]
            needs.append(len(values) + len(levels))
            for one, wanted in values:
                users[offsets[one] + wanted].append(rule)
                read.add(one)
            for number, least, most in levels:
                tests += [rule, self.variables + number, least, most]
        starts, user_starts, all_users, pairs = [0], [0], [], []
        for stratum in strata:
            for variable, value in stratum:
                pairs += [variable, value]
                read.discard(variable)
            starts.append(len(pairs))
        for using in users:
            all_users += using
            user_starts.append(len(all_users))
        self.strata_size = len(strata)
        self.stratum_starts = self.keep(starts)
        self.derived = self.keep(pairs)
        self.rules_size = len(rules)
        self.rule_needs = self.keep(needs)
        self.rule_missing = self.keep(needs)
        self.rule_facts = self.keep(facts)
        self.reading_size = len(read)
        self.reading = self.keep(sorted(read))
        self.fact_offsets = self.keep(offsets)
        self.fact_user_starts = self.keep(user_starts)
        self.fact_users = self.keep(all_users)
        self.tests_size = len(tests)
        self.tests = self.keep(tests)
        self.derived_stack = self.keep([0] * (len(pairs) // 2 + 1))

    @cython.cfunc
    @cython.exceptval(check=False)
    def derive(self) -> cython.void:
        """Gives all derived variables their values, stratum by stratum."""
        i: cython.int
        stratum: cython.int
        level: cython.int
        last: cython.int
        self.stacked = 0
        last = self.stratum_starts[self.strata_size]
        i = 0
        while i < last:
            self.current[self.derived[i]] = self.derived[i + 1]
            i += 2
        for i in range(self.rules_size):
            self.rule_missing[i] = self.rule_needs[i]
            if self.rule_needs[i] == 0:
                self.conclude(i)
        i = 0
        while i < self.tests_size:
            level = self.current[self.tests[i + 1]]
            if self.tests[i + 2] <= level <= self.tests[i + 3]:
                self.fulfil(self.tests[i])
            i += 4
        for i in range(self.reading_size):
            self.tell(self.reading[i])
        for stratum in range(self.strata_size):
            while self.stacked > 0:
                self.stacked -= 1
                self.tell(self.derived_stack[self.stacked])
            i = self.stratum_starts[stratum]
            while i < self.stratum_starts[stratum + 1]:
                if self.current[self.derived[i]] == self.derived[i + 1]:
                    self.tell(self.derived[i])
                i += 2

    @cython.cfunc
    @cython.exceptval(check=False)
    def tell(self, variable: cython.int) -> cython.void:
        """Tells rules which value a variable has."""
        i: cython.int
        fact: cython.int = self.fact_offsets[variable] + self.current[variable]
        for i in range(self.fact_user_starts[fact], self.fact_user_starts[fact + 1]):
            self.fulfil(self.fact_users[i])

    @cython.cfunc
    @cython.exceptval(check=False)
    def fulfil(self, rule: cython.int) -> cython.void:
        self.rule_missing[rule] -= 1
        if self.rule_missing[rule] == 0:
            self.conclude(rule)

    @cython.cfunc
    @cython.exceptval(check=False)
    def conclude(self, rule: cython.int) -> cython.void:
        variable: cython.int = self.rule_facts[2 * rule]
        if self.current[variable] != self.rule_facts[2 * rule + 1]:
            self.current[variable] = self.rule_facts[2 * rule + 1]
            self.derived_stack[self.stacked] = variable
            self.stacked += 1

    def _build_words(self, task: tuple) -> None:
        """Decides which bits of a stored state have which entry of the state."""
        domains, _, limits, levels, requests, actions = task[:6]
        highest = [size - 1 for size in domains]
        tops = [max(pair) for pair in zip(limits, levels)]
        for _, _, _, numbers, _, _ in actions:
            for kind, number, amount in numbers:
                if kind == BECOMES:
                    tops[number] = max(tops[number], amount)
        word, used = 0, 0
        words, shifts, masks = [], [], []
        for most in highest + tops + [1] * len(requests):
            bits = max(1, most.bit_length())
            if used + bits > WORD_BITS:
                word, used = word + 1, 0
            words.append(word)
            shifts.append(used)
            masks.append((1 << bits) - 1)
            used += bits
        self.word_of = self.keep(words)
        self.shift_of = self.keep(shifts)
        self.mask_of = self.keep(masks)
        self.width = word + 1

    def restart(self, state) -> None:
        """Forgets all states, and stores one as state 0.

        Args:
            state: The state, without gaps; requests whose wishes hold in it become met.
        """
        i: cython.int
        for i in range(self.entries):
            self.current[i] = state[i]
        self.derive()
        self.size = 0
        if len(self.rows_array) == 0:
            self.grow()
        if self.slots_array is None or self.slots_mask >= 4 * _FIRST_ROOM:
            self.slots_array = array("i", [-1]) * (4 * _FIRST_ROOM)
            self.slots = ints(self.slots_array)
            self.slots_mask = 4 * _FIRST_ROOM - 1
        else:
            for i in range(4 * _FIRST_ROOM):
                self.slots[i] = -1
        self.meet()
        self.store(-1, -1)

    def expand(self, index: int, action: int) -> int:
        """Applies an action, which can be done, to a stored state.

        The successor is the current state then.

        Returns:
            Its index, or -1 if it had been stored before, as state :attr:`known`.

        Raises:
            MemoryError: There is no room for it.
        """
        self.unpack(index)
        self.change(action)
        self.meet()
        return self.store(index, action)

    def simulate(self, plan: list, skip: int, trace) -> list:
        """Applies the actions of a plan, from the initial state, and leaves out impossible ones.

        Args:
            plan: Indices of actions.
            skip: The position in the plan that is left out, too; -1 for none.
            trace: None, or a list that gets the state before the first action and after each one.

        Returns:
            The actions that were applied. The state after them is the current one.
        """
        i: cython.int
        action: cython.int
        left_out: cython.int = skip
        applied = []
        for i in range(self.entries):
            self.current[i] = self.initial[i]
        self.derive()
        self.meet()
        if trace is not None:
            trace.append(self.state[:])
        for i in range(len(plan)):
            action = plan[i]
            if i == left_out or not self.is_applicable(action):
                continue
            self.change(action)
            self.meet()
            applied.append(action)
            if trace is not None:
                trace.append(self.state[:])
        return applied

    @cython.cfunc
    @cython.exceptval(check=False)
    def is_applicable(self, action: cython.int) -> cython.bint:
        i: cython.int = self.need_starts[action]
        level: cython.int
        while i < self.need_starts[action + 1]:
            if (self.current[self.needs[i]] == self.needs[i + 1]) != (self.needs[i + 2] == 1):
                return False
            i += 3
        i = self.range_starts[action]
        while i < self.range_starts[action + 1]:
            level = self.current[self.ranges[i]]
            if level < self.ranges[i + 1] or level > self.ranges[i + 2]:
                return False
            i += 3
        return True

    def unmet_wishes(self) -> int:
        """Returns the number of wishes of the current state that keep requests from being met."""
        return self.unmet

    def reparent(self, index: int, parent: int, action: int) -> None:
        """Replaces the state before a stored state, since a cheaper way leads there."""
        self.parents[index] = parent
        self.by[index] = action

    def path(self, index: int) -> list:
        """Returns the actions that lead from state 0 to a stored state."""
        found = []
        while self.parents[index] >= 0:
            found.append(self.by[index])
            index = self.parents[index]
        found.reverse()
        return found

    def links(self) -> tuple:
        """Returns the arrays of the states before, and of the actions that led from there.

        They move whenever a state is stored.
        """
        return self.parents_array, self.by_array

    @cython.cfunc
    @cython.exceptval(check=False)
    def unpack(self, index: cython.int) -> cython.void:
        i: cython.int
        base: cython.longlong = cython.cast(cython.longlong, self.width) * index
        for i in range(self.entries):
            self.current[i] = (
                self.rows[base + self.word_of[i]] >> self.shift_of[i]
            ) & self.mask_of[i]

    @cython.cfunc
    @cython.exceptval(check=False)
    def change(self, action: cython.int) -> cython.void:
        i: cython.int
        j: cython.int
        size: cython.int = 0
        holds: cython.bint
        current: cython.p_int = self.current
        for i in range(self.effect_starts[action], self.effect_starts[action + 1]):
            holds = True
            for j in range(self.condition_starts[i], self.condition_starts[i + 1]):
                if current[self.condition_variables[j]] != self.condition_values[j]:
                    holds = False
                    break
            if holds:
                self.pending[size] = i
                size += 1
        for j in range(size):
            i = self.pending[j]
            current[self.effect_variables[i]] = self.effect_values[i]
        i = self.change_starts[action]
        while i < self.change_starts[action + 1]:
            if self.changes[i + 2] == UNCHANGED:
                current[self.changes[i]] += self.changes[i + 1]
            else:
                current[self.changes[i]] = self.changes[i + 2]
            i += 3
        if self.strata_size > 0:
            self.derive()

    @cython.cfunc
    @cython.exceptval(check=False)
    def meet(self) -> cython.void:
        """Notes which requests are met, and counts the wishes of the others that do not hold."""
        request: cython.int
        i: cython.int
        missing: cython.int
        current: cython.p_int = self.current
        self.unmet = 0
        for request in range(self.requests):
            if current[self.first_request + request]:
                continue
            missing = 0
            i = self.value_starts[request]
            while i < self.value_starts[request + 1]:
                if current[self.values[i]] != self.values[i + 1]:
                    missing += 1
                i += 2
            i = self.level_starts[request]
            while i < self.level_starts[request + 1]:
                if not (self.levels[i + 1] <= current[self.levels[i]] <= self.levels[i + 2]):
                    missing += 1
                i += 3
            if missing == 0:
                current[self.first_request + request] = 1
            self.unmet += missing

    @cython.cfunc
    @cython.exceptval(-2)
    def store(self, parent: cython.int, action: cython.int) -> cython.int:
        i: cython.int
        index: cython.int
        base: cython.longlong
        other: cython.longlong
        same: cython.bint
        rows: cython.p_int
        if self.size == self.room:
            self.grow()
        if cython.cast(cython.uint, self.size) * 2 > self.slots_mask:
            self.rehash()
        rows = self.rows
        base = cython.cast(cython.longlong, self.width) * self.size
        for i in range(self.width):
            rows[base + i] = 0
        for i in range(self.entries):
            rows[base + self.word_of[i]] |= self.current[i] << self.shift_of[i]
        slot: cython.uint = self.hash_of(self.size) & self.slots_mask
        while self.slots[slot] >= 0:
            index = self.slots[slot]
            other = cython.cast(cython.longlong, self.width) * index
            same = True
            for i in range(self.width):
                if rows[other + i] != rows[base + i]:
                    same = False
                    break
            if same:
                self.known = index
                return -1
            slot = (slot + 1) & self.slots_mask
        index = self.size
        self.slots[slot] = index
        self.parents[index] = parent
        self.by[index] = action
        self.size = index + 1
        return index

    @cython.cfunc
    @cython.exceptval(check=False)
    def hash_of(self, index: cython.int) -> cython.uint:
        i: cython.int
        base: cython.longlong = cython.cast(cython.longlong, self.width) * index
        mixed: cython.uint = HASH_START
        for i in range(self.width):
            mixed = ((mixed ^ self.rows[base + i]) * HASH_PRIME) & HASH_MASK
            mixed = mixed ^ (mixed >> 15)
        return mixed

    def grow(self) -> None:
        """Makes room for half as many states more."""
        more: int = max(_FIRST_ROOM, self.room // 2)
        self.rows_array.frombytes(bytes(4 * more * self.width))
        self.parents_array.frombytes(bytes(4 * more))
        self.by_array.frombytes(bytes(4 * more))
        self.rows = ints(self.rows_array)
        self.parents = ints(self.parents_array)
        self.by = ints(self.by_array)
        self.room += more

    def rehash(self) -> None:
        """Doubles the hash table."""
        index: cython.int
        slot: cython.uint
        size: int = 2 * (self.slots_mask + 1)
        self.slots_array = None  # frees it first
        self.slots_array = array("i", [-1]) * size
        self.slots = ints(self.slots_array)
        self.slots_mask = size - 1
        for index in range(self.size):
            slot = self.hash_of(index) & self.slots_mask
            while self.slots[slot] >= 0:
                slot = (slot + 1) & self.slots_mask
            self.slots[slot] = index
