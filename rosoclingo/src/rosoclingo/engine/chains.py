# cython: language_level=3
"""Finds chains: the quickest actions by which one actuator alone meets a request.

Actuators that stay where they are, such as ovens, may help. Ways are left out, since they follow
from where the next action is, and numbers, since others use them, too. A chain is found by
Dijkstra's algorithm over the variables that its actions need and change. Of two such chains, the
begin of one and the end of the other are a chain, too, if that meets the request: one robot fills
an oven, and another one fetches what is ready.
"""

from heapq import heappop, heappush

from rosoclingo.engine.kinds import ADDS, BECOMES
from rosoclingo.engine.scheduling import find_paths, find_twins, find_ways

MOST_ACTIONS = 60  # that may help a request
MOST_STATES = 2000
MOST_MIXED = 12  # chains of two actuators, for one request
MOST_IN_VAIN = 3  # pairs of actuators without such a chain, before no others are looked at


class Chains:
    """The chains of all requests of a task.

    Attributes:
        of_requests: For each request, its chains; a chain is a tuple of actions.
        owners: Of each action in a chain, or equal to one in a chain, the request.
        fills: Of each number, the actions that add to it and that are in no chain.
        paths: Those of :func:`~rosoclingo.engine.scheduling.find_paths`.
        moves: All ways.
        roaming: For each actuator that goes somewhere, the variable for where it is.
        are_complete: Whether each request that is not met yet has a chain; if not, nothing else is
            there of the requests after that, nor of numbers.
    """

    def __init__(self, task: tuple) -> None:
        """Finds them.

        Args:
            task: A :class:`~rosoclingo.engine.flat.FlatTask` that counts seconds, or a tuple.
        """
        self._initial = task[1]
        self._actions = actions = task[5]
        self._durations = task[9]
        ways = find_ways(task)
        self.paths = find_paths(task, ways)
        self._twins = find_twins(task)
        self.moves = moves = set(ways.values())
        self._places = {variable for variable, _, _ in ways}
        self.roaming = {
            actions[index][5]: variable for (variable, _, _), index in sorted(ways.items())
        }
        self._makers: dict = {}  # of each value of a variable
        for index, action in enumerate(actions):
            if index not in moves and self._twins.get(index, [index])[0] == index:
                for _, variable, value in action[2]:
                    self._makers.setdefault((variable, value), []).append(index)
        self.of_requests: list = []
        self.are_complete = True
        for request in task[4]:
            chains = self._chains(request)
            self.of_requests.append(chains)
            if not chains and not self._is_met(request, task[3]):
                self.are_complete = False
                return
        self.owners: dict = {}
        for request, chains in enumerate(self.of_requests):
            for chain in chains:
                for index in chain:
                    for twin in self._twins.get(index, [index]):
                        self.owners[twin] = request
        self.fills: dict = {}
        for index, action in enumerate(actions):
            if index not in self.owners and index not in moves:
                for kind, number, _ in action[3]:
                    if kind in (ADDS, BECOMES):
                        self.fills.setdefault(number, []).append(index)

    def _is_met(self, request: tuple, levels: list) -> bool:
        wishes, ranges = request
        wrong = [1 for variable, value in wishes if self._initial[variable] != value]
        return not wrong and not [
            1 for one, least, most in ranges if not least <= levels[one] <= most
        ]

    def _chains(self, request: tuple) -> list:
        wishes, levels = request
        if levels or [1 for variable, _ in wishes if variable in self._places]:
            return []
        helpful = self._helpful(wishes)
        if len(helpful) > MOST_ACTIONS:
            return []
        actors = sorted({self._actions[index][5] for index in helpful})
        mains = [actor for actor in actors if actor in self.roaming]
        staying = [index for index in helpful if self._actions[index][5] not in self.roaming]
        found = []
        for main in mains or actors:
            mine = [index for index in helpful if self._actions[index][5] == main]
            if mains:
                mine = sorted([*mine, *staying])
            chain = self._quickest(wishes, mine)
            if [1 for index in chain if self._actions[index][5] == main]:
                found.append(chain)
        if not found:
            found = [chain for chain in [self._quickest(wishes, staying)] if chain]
        return found + self._mixed(wishes, found) if mains else found

    def _mixed(self, wishes: list, chains: list) -> list:
        """Returns chains that one actuator begins and another one ends."""
        found: list = []
        size = len(chains)
        pairs = [(i, (i + step) % size) for step in range(1, size) for i in range(size)]
        for number, (one, other) in enumerate(pairs):
            if len(found) >= MOST_MIXED or (not found and number == MOST_IN_VAIN):
                break
            first, last = chains[one], chains[other]
            for split in range(1, len(last)):
                begin = first[:split]
                chain = begin + last[split:]
                goes = [1 for index in begin if self._actions[index][5] in self.roaming]
                if goes and self._meets(wishes, chain):
                    found.append(chain)
        return found

    def _meets(self, wishes: list, chain: tuple) -> bool:
        """Tells if a chain is possible from the initial state and meets wishes."""
        variables = self._variables(wishes, chain)
        entry = {variable: number for number, variable in enumerate(variables)}
        state = tuple([self._initial[one] for one in variables])
        for index in chain:
            after = self._do(index, state, entry)
            if after is None:
                return False
            state = after[0]
        return not [1 for variable, value in wishes if state[entry[variable]] != value]

    def _helpful(self, wishes: list) -> list:
        """Returns the actions that may be needed for values that there are not yet."""
        waiting = list(wishes)
        known: set = set()
        found: dict = {}
        while waiting and len(found) <= MOST_ACTIONS:
            fact = waiting.pop()
            variable, value = fact
            if fact in known or variable in self._places or self._initial[variable] == value:
                continue
            known.add(fact)
            for index in self._makers.get(fact, ()):
                if index not in found:
                    found[index] = True
                    needs, _, effects, _, _, _ = self._actions[index]
                    waiting += needs
                    for conditions, _, _ in effects:
                        waiting += conditions
        return sorted(found)

    def _quickest(self, wishes: list, actions: list) -> tuple:
        """Returns the quickest sequence of some actions, empty if there is none."""
        variables = self._variables(wishes, actions)
        entry = {variable: number for number, variable in enumerate(variables)}
        goal = [(entry[variable], value) for variable, value in wishes]
        queue: list = [(0, 0, tuple([self._initial[one] for one in variables]), ())]
        count = 0
        seen: set = set()
        while queue and len(seen) < MOST_STATES:
            seconds, _, state, chain = heappop(queue)
            if not [1 for number, value in goal if state[number] != value]:
                return chain
            if state in seen:
                continue
            seen.add(state)
            for index in actions:
                after = self._do(index, state, entry)
                if after is not None:
                    count += 1
                    following, lasts = after
                    heappush(queue, (seconds + lasts, count, following, (*chain, index)))
        return ()

    def _variables(self, wishes: list, actions) -> list:
        """Returns the variables of wishes, and those that actions need and change."""
        used = {variable for variable, _ in wishes}
        for index in actions:
            needs, others, effects, _, _, _ = self._actions[index]
            used.update([variable for variable, _ in needs + others])
            for conditions, variable, _ in effects:
                used.add(variable)
                used.update([one for one, _ in conditions])
        return sorted(used)

    def _do(self, index: int, state: tuple, entry: dict):
        """Returns the state after an action and the ways to it, and how long they take, or None."""
        needs, others, effects, _, _, _ = self._actions[index]
        lasts = self._durations[index]
        values = list(state)
        for variable, value in needs:
            before = values[entry[variable]]
            if before != value:
                path = self.paths.get((variable, before, value))
                if path is None:
                    return None
                lasts += path[1]
                values[entry[variable]] = value
        for variable, value in others:
            if values[entry[variable]] == value:
                return None
        before_effects = list(values)
        for conditions, variable, value in effects:
            if not [1 for one, wanted in conditions if before_effects[entry[one]] != wanted]:
                values[entry[variable]] = value
        return tuple(values), lasts
