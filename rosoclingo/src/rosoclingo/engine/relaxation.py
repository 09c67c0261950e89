# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
"""h_FF: estimates the cost of reaching all goals by a relaxed plan, whose supporters h_add chooses.

In the relaxation, a fact that holds once holds from then on. There are four kinds of facts: a
variable has a value; a variable has any value but one; a number is at least, or at most, a
threshold that some action or request needs; and a request is met. An action becomes one operator
for each set of conditions of its effects; a request becomes one that costs nothing.

Compiled, this runs on pointers into arrays, which ``ints`` takes; uncompiled, on the arrays.
"""

from array import array

import cython

from rosoclingo.engine.kinds import ADDS, BECOMES, NEEDS_LEAST, TAKES

UNREACHED = cython.declare(cython.int, 1 << 29)
MOST_COST = cython.declare(cython.int, 1 << 16)  # of a fact; higher ones count as this
# The needs of an operator that are missing are above its cost in one number, which is in the cache
# at once.
NEED = cython.declare(cython.longlong, 0x10000000000)  # 2^40, too large for a shift in C
MOST_ACTION_COST = cython.declare(
    cython.int, 100
)  # in the propagation; higher costs of a task are scaled down to it


@cython.cfunc
def ints(storage) -> cython.p_int:
    return cython.cast(cython.p_int, cython.cast(cython.size_t, storage.buffer_info()[0]))


@cython.cfunc
def longs(storage) -> cython.p_longlong:
    return cython.cast(cython.p_longlong, cython.cast(cython.size_t, storage.buffer_info()[0]))


if not cython.compiled:
    globals().update(ints=lambda storage: storage, longs=lambda storage: storage)


def join(lists: list) -> tuple:
    """Returns where each list starts in the concatenation of all, and the concatenation."""
    starts, joined = array("i", [0]), array("i")
    for one in lists:
        joined.extend(one)
        starts.append(len(joined))
    joined.append(0)  # so that it has an address
    return starts, joined


class _Facts:
    """Numbers the facts of a task."""

    def __init__(self, task: tuple) -> None:
        domains, _, limits, _, requests, actions, _, rules = task[:8]
        self.limits = limits
        self.size = 0
        self.offsets = []
        for size in domains:
            self.offsets.append(self.size)
            self.size += size
        self.others: dict = {}  # (variable, value): the fact that it has another value
        self.thresholds: dict = {}  # (number, is at least, amount): fact
        self.others_of: dict = {}  # variable: [(value, fact)]
        self.thresholds_of: dict = {}  # number: [(is at least, amount, fact)]
        for _, others, _, numbers, _, _ in actions:
            for pair in others:
                self._add_other(pair)
            for least, number, amount in number_needs(numbers, limits):
                self._add_threshold(number, least, amount)
        for _, wishes in requests:
            self._add_ranges(wishes)
        self.denied = _denied(task)
        for values, levels, variable, _ in rules:
            self._add_ranges(levels)
            if variable in self.denied:
                for pair in values:
                    self._add_other(pair)
                for number, least, most in levels:
                    self._add_threshold(number, False, least - 1)
                    self._add_threshold(number, True, most + 1)
        self.met = range(self.size, self.size + len(requests))
        self.size += len(requests)
        self.broken = range(self.size, self.size + len(rules))  # some need of the rule is not met
        self.size += len(rules) if self.denied else 0

    def _add_other(self, pair: tuple) -> None:
        if pair not in self.others:
            self.others[pair] = self.size
            self.others_of.setdefault(pair[0], []).append((pair[1], self.size))
            self.size += 1

    def _add_ranges(self, levels: list) -> None:
        for number, least, most in levels:
            self._add_threshold(number, True, least)
            self._add_threshold(number, False, most)

    def _add_threshold(self, number: int, least: bool, amount: int) -> None:
        if (number, least, amount) not in self.thresholds:
            self.thresholds[number, least, amount] = self.size
            self.thresholds_of.setdefault(number, []).append((least, amount, self.size))
            self.size += 1

    def of_conditions(self, values: list, levels: list) -> list:
        """Returns the facts that stand for values of variables, and for ranges of numbers."""
        found = [self.offsets[variable] + value for variable, value in values]
        for number, least, most in levels:
            found.append(self.thresholds[number, True, least])
            found.append(self.thresholds[number, False, most])
        return list(dict.fromkeys(found))

    def of_value(self, variable: int, value: int) -> list:
        """Returns the facts that hold when a variable has a value."""
        facts = [self.offsets[variable] + value]
        facts += [fact for other, fact in self.others_of.get(variable, ()) if other != value]
        return facts

    def of_change(self, kind: int, number: int, amount: int) -> list:
        """Returns the thresholds that a change of a number may bring about."""
        return [
            fact
            for least, threshold, fact in self.thresholds_of.get(number, ())
            if (kind == ADDS and least and threshold <= self.limits[number])
            or (kind == TAKES and not least and threshold >= 0)
            or (kind == BECOMES and (amount >= threshold if least else amount <= threshold))
        ]


def _denied(task: tuple) -> set:
    """Returns the derived variables whose value without rules is a condition of something."""
    _, _, _, _, requests, actions, strata, rules = task[:8]
    without = {variable: value for stratum in strata for variable, value in stratum}
    denied: set = set()
    if not without:
        return denied
    conditions = [values for values, _ in requests] + [rule[0] for rule in rules]
    near: dict = {}  # of each derived variable, those that its rules read
    for values, _, variable, _ in rules:
        near.setdefault(variable, []).extend([one for one, _ in values if one in without])
    new = []
    for needs, others, effects, _, _, _ in actions:
        conditions.append(needs)
        conditions += [effect[0] for effect in effects]
        new += [variable for variable, _ in others if variable in without]
    for pairs in conditions:
        new += [variable for variable, value in pairs if without.get(variable) == value]
    while new:
        variable = new.pop()
        if variable not in denied:
            denied.add(variable)
            new += near.get(variable, ())
    return denied


def number_needs(numbers: list, limits: list) -> list:
    """Returns what an action needs of numbers before it, each as (is at least, number, amount)."""
    sums: dict = {}
    needs = []
    for kind, number, amount in numbers:
        if kind in (TAKES, ADDS):
            sums[kind == TAKES, number] = sums.get((kind == TAKES, number), 0) + amount
        elif kind != BECOMES:
            needs.append((kind == NEEDS_LEAST, number, amount))
    for (takes, number), amount in sums.items():
        needs.append((takes, number, amount if takes else limits[number] - amount))
    return needs


@cython.cclass
class RelaxedTask:
    """The relaxed task. :meth:`evaluate` reads the state in an array that the caller fills."""

    owned: list  # the arrays, which must not move
    facts = cython.declare(object)
    state: cython.p_int
    variables: cython.int
    facts_size: cython.int
    operators_size: cython.int
    offsets: cython.p_int
    others_size: cython.int
    other_variables: cython.p_int
    other_values: cython.p_int
    other_facts: cython.p_int
    thresholds_size: cython.int
    threshold_entries: cython.p_int  # where in the state the level of the number is
    threshold_least: cython.p_int
    threshold_amounts: cython.p_int
    threshold_facts: cython.p_int
    requests_size: cython.int
    first_request: cython.int  # where in the state it is told whether the first one is met
    met_facts: cython.p_int
    user_starts: cython.p_int
    users: cython.p_int
    need_starts: cython.p_int
    needs: cython.p_int
    effect_starts: cython.p_int
    effects: cython.p_int
    action_of: cython.p_int  # -1 for a request
    is_base: cython.p_int  # 1 if the operator can be applied as soon as the action can be
    start_costs: cython.p_int
    entries_before: cython.p_longlong  # of the operators, where nothing holds
    weights: cython.p_int  # of the actions, in the estimate
    free: cython.p_int
    free_size: cython.int
    goals: cython.p_int
    goals_size: cython.int
    is_goal: cython.p_int
    entries: cython.p_longlong  # of each operator: how many needs are missing, and its cost
    fact_costs: cython.p_int
    supporters: cython.p_int
    seen: cython.p_int
    action_seen: cython.p_int
    preferred_seen: cython.p_int
    achiever_starts: cython.p_int  # of each fact; operators, if there are several actuators
    achievers: cython.p_int
    has_actuators: cython.bint
    stamp: cython.int
    stack: cython.p_int
    queue: cython.p_int
    queue_next: cython.p_int
    queue_size: cython.int
    bucket_first: cython.p_int
    bucket_last: cython.p_int
    highest: cython.int
    applicable_pointer: cython.p_int
    preferred_pointer: cython.p_int
    sizes_pointer: cython.p_int
    applicable = cython.declare(object, visibility="readonly")
    """Array of the actions that can be done in the state, ``sizes[0]`` of them."""
    preferred = cython.declare(object, visibility="readonly")
    """Array of those with which the relaxed plan begins, ``sizes[1]`` of them."""
    sizes = cython.declare(object, visibility="readonly")

    def __init__(self, task: tuple, state) -> None:
        """Builds the operators.

        Args:
            task: A :class:`~rosoclingo.engine.flat.FlatTask`, or a tuple like it.
            state: Array of values, then levels, then 1 for each request that is met, else 0.
        """
        self.owned = [state]
        self.facts = _Facts(task)
        self.state = ints(state)
        self.stamp = 0
        self._build_state(task)
        self._build_operators(task)
        self._build_scratch(len(task[5]))
        self.set_goals([], list(range(self.requests_size)))

    @cython.cfunc
    def keep(self, values) -> cython.p_int:
        storage = array("i", values)
        storage.append(0)  # so that it has an address
        self.owned.append(storage)
        return ints(storage)

    def _build_state(self, task: tuple) -> None:
        facts = self.facts
        self.variables = len(task[0])
        self.facts_size = facts.size
        self.offsets = self.keep(facts.offsets)
        self.others_size = len(facts.others)
        self.other_variables = self.keep([pair[0] for pair in facts.others])
        self.other_values = self.keep([pair[1] for pair in facts.others])
        self.other_facts = self.keep(facts.others.values())
        self.thresholds_size = len(facts.thresholds)
        self.threshold_entries = self.keep([len(task[0]) + key[0] for key in facts.thresholds])
        self.threshold_least = self.keep([int(key[1]) for key in facts.thresholds])
        self.threshold_amounts = self.keep([key[2] for key in facts.thresholds])
        self.threshold_facts = self.keep(facts.thresholds.values())
        self.requests_size = len(task[4])
        self.first_request = len(task[0]) + len(task[2])
        self.met_facts = self.keep(facts.met)

    def _build_operators(self, task: tuple) -> None:
        facts, limits, offsets = self.facts, task[2], self.facts.offsets
        all_needs: list = []
        all_effects: list = []
        actions: list = []
        base: list = []
        for index, (needs, others, effects, numbers, _, _) in enumerate(task[5]):
            common = [offsets[variable] + value for variable, value in needs]
            common += [facts.others[pair] for pair in others]
            for least, number, amount in number_needs(numbers, limits):
                common.append(facts.thresholds[number, least, amount])
            groups: dict = {(): []}
            for kind, number, amount in numbers:
                groups[()] += facts.of_change(kind, number, amount)
            for conditions, variable, value in effects:
                groups.setdefault(tuple(conditions), []).extend(facts.of_value(variable, value))
            for conditions, reached in groups.items():
                own = [offsets[variable] + value for variable, value in conditions]
                all_needs.append(list(dict.fromkeys(common + own)))
                all_effects.append(list(dict.fromkeys(reached)))
                actions.append(index)
                base.append(int(not conditions))
        for index, (values, wishes) in enumerate(task[4]):
            all_needs.append(facts.of_conditions(values, wishes))
            all_effects.append([facts.met[index]])
            actions.append(-1)
            base.append(0)
        first_rule = len(actions)
        self._add_rules(task, all_needs, all_effects)
        actions += [-1] * (len(all_needs) - first_rule)
        base += [0] * (len(all_needs) - first_rule)
        self._join_operators(all_needs, all_effects)
        self.has_actuators = len({action[5] for action in task[5]} - {-1}) > 1
        if self.has_actuators:
            self._join_achievers(all_effects)
        self.action_of = self.keep(actions)
        self.is_base = self.keep(base)
        self.weights = self.keep([0] * len(task[5]))
        self.start_costs = self.keep([0] * len(actions))
        for operator in range(first_rule, len(actions)):
            if not all_needs[operator]:
                self.start_costs[operator] = 1
        self.set_weights([1] * len(task[5]))

    def _add_rules(self, task: tuple, all_needs: list, all_effects: list) -> None:
        """Adds the rules of derived variables as operators without an action.

        For denied variables, there are operators for their value without rules, too: this holds if
        all rules are broken, and a rule is broken if one of its conditions does not hold. A rule
        with a condition in its own stratum, and so in a circle, can be broken for a cost of 1.
        """
        facts = self.facts
        stratum_of = {pair[0]: n for n, stratum in enumerate(task[6]) for pair in stratum}
        rules_of: dict = {}
        for index, (values, levels, variable, value) in enumerate(task[7]):
            rules_of.setdefault(variable, []).append(index)
            all_needs.append(facts.of_conditions(values, levels))
            all_effects.append(facts.of_value(variable, value))
            if variable not in facts.denied:
                continue
            ends = []
            for one, wanted in values:
                is_same = stratum_of.get(one, -1) == stratum_of[variable]
                ends.append([] if is_same else [facts.others[one, wanted]])
            for number, least, most in levels:
                ends.append([facts.thresholds[number, False, least - 1]])
                ends.append([facts.thresholds[number, True, most + 1]])
            all_needs += ends
            all_effects += [[facts.broken[index]] for _ in ends]
        for stratum in task[6]:
            for variable, value in stratum:
                if variable not in facts.denied:
                    continue
                all_needs.append([facts.broken[rule] for rule in rules_of.get(variable, [])])
                all_effects.append(facts.of_value(variable, value))

    def _join_operators(self, all_needs: list, all_effects: list) -> None:
        users: list = [[] for _ in range(self.facts_size)]
        for operator, needs in enumerate(all_needs):
            for fact in needs:
                users[fact].append(operator)
        self.operators_size = len(all_needs)
        joined = [*join(users), *join(all_needs), *join(all_effects)]
        self.owned += joined
        self.user_starts, self.users = ints(joined[0]), ints(joined[1])
        self.need_starts, self.needs = ints(joined[2]), ints(joined[3])
        self.effect_starts, self.effects = ints(joined[4]), ints(joined[5])
        entries = array("q", [len(needs) << 40 for needs in all_needs] + [0])
        self.entries_before, copied = longs(entries), entries[:]
        self.entries = longs(copied)
        self.owned += [entries, copied]
        without = [operator for operator, needs in enumerate(all_needs) if not needs]
        self.free = self.keep(without)
        self.free_size = len(without)
        most = len(joined[5]) + self.facts_size
        self.queue = self.keep([0] * most)
        self.queue_next = self.keep([0] * most)

    def _join_achievers(self, all_effects: list) -> None:
        achievers: list = [[] for _ in range(self.facts_size)]
        for operator, effects in enumerate(all_effects):
            for fact in effects:
                achievers[fact].append(operator)
        joined = join(achievers)
        self.owned += joined
        self.achiever_starts, self.achievers = ints(joined[0]), ints(joined[1])

    def _build_scratch(self, actions: int) -> None:
        self.fact_costs = self.keep([0] * self.facts_size)
        self.supporters = self.keep([0] * self.facts_size)
        self.seen = self.keep([0] * self.facts_size)
        self.is_goal = self.keep([0] * self.facts_size)
        self.goals = self.keep([0] * self.facts_size)
        self.goals_size = 0
        self.stack = self.keep([0] * self.facts_size)
        self.bucket_first = self.keep(array("i", [-1]) * (MOST_COST + 1))
        self.bucket_last = self.keep(array("i", [-1]) * (MOST_COST + 1))
        self.action_seen = self.keep([0] * actions)
        self.preferred_seen = self.keep([0] * actions)
        self.applicable = array("i", [0] * (actions + 1))
        self.applicable_pointer = ints(self.applicable)
        self.preferred = array("i", [0] * (actions + 1))
        self.preferred_pointer = ints(self.preferred)
        self.sizes = array("i", [0, 0])
        self.sizes_pointer = ints(self.sizes)

    def set_weights(self, weights: list) -> None:
        """Replaces what each action counts in the estimate, at least 1."""
        i: cython.int
        action: cython.int
        weight: cython.int
        scale: cython.int = max(1, max(weights, default=1) // MOST_ACTION_COST)
        for i in range(len(weights)):
            self.weights[i] = weights[i]
        for i in range(self.operators_size):
            action = self.action_of[i]
            if action >= 0:
                weight = self.weights[action] // scale
                self.start_costs[i] = weight if weight > 0 else 1
            self.entries_before[i] += self.start_costs[i] - self.entries_before[i] % NEED

    def set_goals(self, values: list, requests: list) -> None:
        """Replaces the goals.

        Args:
            values: Variables with the values that they are to have.
            requests: Indices of the requests that are to be met.
        """
        i: cython.int
        for i in range(self.goals_size):
            self.is_goal[self.goals[i]] = 0
        facts = [self.facts.offsets[variable] + value for variable, value in values]
        facts += [self.facts.met[request] for request in requests]
        self.goals_size = 0
        for fact in dict.fromkeys(facts):
            i = fact
            self.goals[self.goals_size] = i
            self.goals_size += 1
            self.is_goal[i] = 1

    def evaluate(self) -> int:
        """Returns the estimate for the state, -1 if no plan leads from it to the goals.

        The actions that can be done are found, too, unless the goals hold already.
        """
        self.reset()
        self.reach_state()
        self.propagate()
        return self.extract()

    @cython.cfunc
    @cython.exceptval(check=False)
    def reset(self) -> cython.void:
        i: cython.int
        entries: cython.p_longlong = self.entries
        entries_before: cython.p_longlong = self.entries_before
        fact_costs: cython.p_int = self.fact_costs
        for i in range(self.facts_size):
            fact_costs[i] = UNREACHED
        for i in range(self.operators_size):
            entries[i] = entries_before[i]
        self.queue_size = 0
        self.highest = 0
        self.sizes_pointer[0] = 0
        self.sizes_pointer[1] = 0

    @cython.cfunc
    @cython.inline
    @cython.exceptval(check=False)
    def reach(self, fact: cython.int, cost: cython.int, operator: cython.int) -> cython.void:
        entry: cython.int
        if cost < self.fact_costs[fact]:
            self.fact_costs[fact] = cost
            self.supporters[fact] = operator
            entry = self.queue_size
            self.queue_size = entry + 1
            self.queue[entry] = fact
            self.queue_next[entry] = -1
            if self.bucket_first[cost] < 0:
                self.bucket_first[cost] = entry
            else:
                self.queue_next[self.bucket_last[cost]] = entry
            self.bucket_last[cost] = entry
            self.highest = max(self.highest, cost)

    @cython.cfunc
    @cython.exceptval(check=False)
    def reach_state(self) -> cython.void:
        i: cython.int
        level: cython.int
        holds: cython.bint
        for i in range(self.variables):
            self.reach(self.offsets[i] + self.state[i], 0, -1)
        for i in range(self.others_size):
            if self.state[self.other_variables[i]] != self.other_values[i]:
                self.reach(self.other_facts[i], 0, -1)
        for i in range(self.thresholds_size):
            level = self.state[self.threshold_entries[i]]
            if self.threshold_least[i]:
                holds = level >= self.threshold_amounts[i]
            else:
                holds = level <= self.threshold_amounts[i]
            if holds:
                self.reach(self.threshold_facts[i], 0, -1)
        for i in range(self.requests_size):
            if self.state[self.first_request + i]:
                self.reach(self.met_facts[i], 0, -1)
        for i in range(self.free_size):
            self.fire(self.free[i])

    @cython.cfunc
    @cython.exceptval(check=False)
    def fire(self, operator: cython.int) -> cython.void:
        i: cython.int
        fact: cython.int
        cost: cython.int
        effects: cython.p_int = self.effects
        fact_costs: cython.p_int = self.fact_costs
        if self.is_base[operator] and self.entries[operator] == self.start_costs[operator]:
            self.applicable_pointer[self.sizes_pointer[0]] = self.action_of[operator]
            self.sizes_pointer[0] += 1
        cost = min(self.entries[operator], MOST_COST)
        for i in range(self.effect_starts[operator], self.effect_starts[operator + 1]):
            fact = effects[i]
            if cost < fact_costs[fact]:
                self.reach(fact, cost, operator)

    @cython.cfunc
    @cython.exceptval(check=False)
    def propagate(self) -> cython.void:
        cost: cython.int = 0
        entry: cython.int
        fact: cython.int
        i: cython.int
        operator: cython.int
        unreached: cython.int = self.goals_size
        users: cython.p_int = self.users
        entries: cython.p_longlong = self.entries
        change: cython.longlong
        left: cython.longlong
        while cost <= self.highest:
            entry = self.bucket_first[cost]
            change = cost - NEED
            while entry >= 0:
                fact = self.queue[entry]
                if self.fact_costs[fact] == cost:
                    if self.is_goal[fact]:
                        unreached -= 1
                        if unreached == 0 and cost > 0:
                            break
                    for i in range(self.user_starts[fact], self.user_starts[fact + 1]):
                        operator = users[i]
                        left = entries[operator] + change
                        entries[operator] = left
                        if left < NEED:
                            self.fire(operator)
                entry = self.queue_next[entry]
            if unreached == 0:
                break
            cost += 1
        for cost in range(self.highest + 1):
            self.bucket_first[cost] = -1

    @cython.cfunc
    @cython.exceptval(check=False)
    def extract(self) -> cython.longlong:
        """Walks back from the goals over the supporters, which are the relaxed plan."""
        estimate: cython.longlong = 0
        size: cython.int = 0
        i: cython.int
        goal: cython.int
        fact: cython.int
        operator: cython.int
        action: cython.int
        first: cython.bint
        self.stamp += 1
        for i in range(self.goals_size):
            fact = self.goals[i]
            if self.fact_costs[fact] == UNREACHED:
                return -1
            self.seen[fact] = self.stamp
            self.stack[size] = fact
            size += 1
        while size > 0:
            size -= 1
            goal = self.stack[size]
            operator = self.supporters[goal]
            if operator < 0:
                continue
            first = True
            for i in range(self.need_starts[operator], self.need_starts[operator + 1]):
                fact = self.needs[i]
                if self.fact_costs[fact] > 0:
                    first = False
                    if self.seen[fact] != self.stamp:
                        self.seen[fact] = self.stamp
                        self.stack[size] = fact
                        size += 1
            action = self.action_of[operator]
            if action >= 0 and self.action_seen[action] != self.stamp:
                self.action_seen[action] = self.stamp
                estimate += self.weights[action]
                if first:
                    self.prefer(action)
            if first and self.has_actuators:
                self.prefer_others(goal)
        return estimate

    def nearest(self, requests: list) -> list:
        """Returns requests in the order of what they cost in the state that was evaluated."""
        i: cython.int
        costs: dict = {}
        for request in requests:
            i = self.facts.met[request]
            costs[request] = self.fact_costs[i]
        return sorted(requests, key=costs.__getitem__)

    @cython.cfunc
    @cython.inline
    @cython.exceptval(check=False)
    def prefer(self, action: cython.int) -> cython.void:
        if self.preferred_seen[action] != self.stamp:
            self.preferred_seen[action] = self.stamp
            self.preferred_pointer[self.sizes_pointer[1]] = action
            self.sizes_pointer[1] += 1

    @cython.cfunc
    @cython.exceptval(check=False)
    def prefer_others(self, fact: cython.int) -> cython.void:
        """Prefers each action that reaches a fact as cheaply, so that other actuators may do it."""
        i: cython.int
        operator: cython.int
        cost: cython.int = self.fact_costs[fact]
        for i in range(self.achiever_starts[fact], self.achiever_starts[fact + 1]):
            operator = self.achievers[i]
            if (
                self.entries[operator] == cost
                and cost == self.start_costs[operator]
                and self.action_of[operator] >= 0
            ):
                self.prefer(self.action_of[operator])
