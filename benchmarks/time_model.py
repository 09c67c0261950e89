"""OR-Tools' CP-SAT on the tasks of :mod:`time_tasks`: one route through the stops of all robots."""

from __future__ import annotations

import time
from typing import Dict, List, Sequence, Set, Tuple

from ortools.sat.python import cp_model

from time_tasks import LATE_WEIGHT, Act, TimeTask

_HORIZON = 10_000  # seconds
_WORKERS = 2
Stop = Tuple[int, int]  # an errand, and 0 where it is picked up, 1 where it is put down


class TimeModel:
    """The model of a task."""

    def __init__(self, task: TimeTask, hint: Sequence[Act]) -> None:
        """Makes the model.

        Args:
            task: The task.
            hint: A plan, from which the search begins.
        """
        self._task = task
        self.model = cp_model.CpModel()
        self._distances = task.distances()
        self._stops: List[Stop] = [(n, i) for n in range(len(task.errands)) for i in (0, 1)]
        self._robots = len(task.starts)
        self._nodes = {stop: self._robots + n for n, stop in enumerate(self._stops)}
        self._arcs: Dict[Tuple[int, int], cp_model.IntVar] = {}
        self._begins = {stop: self._integer(_HORIZON) for stop in self._stops}
        self._doers = {stop: self._integer(self._robots - 1) for stop in self._stops}
        self._loads = {stop: self._integer(task.room) for stop in self._stops}
        self._cooked: Dict[int, cp_model.IntVar] = {}
        self._late: Dict[int, cp_model.IntVar] = {}
        self._last = self._integer(_HORIZON)
        self._route()
        self._times()
        self._begin_with(hint)

    def _integer(self, most: int) -> cp_model.IntVar:
        return self.model.NewIntVar(0, most, "")

    def _arc(self, start: int, end: int) -> cp_model.IntVar:
        self._arcs[start, end] = self.model.NewBoolVar("")
        return self._arcs[start, end]

    def _seconds(self, stop: Stop) -> int:
        return self._task.errands[stop[0]].handling[stop[1]]

    def _place(self, stop: Stop) -> str:
        errand = self._task.errands[stop[0]]
        return errand.target if stop[1] else errand.origin

    def _more(self, stop: Stop) -> int:
        size = self._task.errands[stop[0]].size
        return -size if stop[1] else size

    def _route(self) -> None:
        model = self.model
        for robot, start in enumerate(self._task.starts):
            following = (robot + 1) % self._robots
            self._arc(robot, following)
            for stop in self._stops:
                last = self._arc(self._nodes[stop], following)
                model.Add(self._doers[stop] == robot).OnlyEnforceIf(last)
                if stop[1] == 0:
                    first = self._arc(robot, self._nodes[stop])
                    way = self._distances[start][self._place(stop)]
                    model.Add(self._doers[stop] == robot).OnlyEnforceIf(first)
                    model.Add(self._begins[stop] >= way).OnlyEnforceIf(first)
                    model.Add(self._loads[stop] == self._more(stop)).OnlyEnforceIf(first)
        for stop in self._stops:
            for other in self._stops:
                if stop == other or (stop[0] == other[0] and stop[1]):
                    continue
                arc = self._arc(self._nodes[stop], self._nodes[other])
                lasts = self._seconds(stop)
                lasts += self._distances[self._place(stop)][self._place(other)]
                begin = self._begins[stop] + lasts
                load = self._loads[stop] + self._more(other)
                model.Add(self._doers[stop] == self._doers[other]).OnlyEnforceIf(arc)
                model.Add(self._begins[other] >= begin).OnlyEnforceIf(arc)
                model.Add(self._loads[other] == load).OnlyEnforceIf(arc)
        model.AddCircuit([(start, end, arc) for (start, end), arc in self._arcs.items()])

    def _times(self) -> None:
        model, last = self.model, self._last
        cooking = []
        for number, errand in enumerate(self._task.errands):
            picked = self._begins[number, 0] + errand.handling[0]
            put = self._begins[number, 1]
            model.Add(self._doers[number, 0] == self._doers[number, 1])
            model.Add(put >= picked + self._distances[errand.origin][errand.target])
            model.Add(last >= put + errand.handling[1])
            if errand.carried_at_most is not None:
                model.Add(put - picked <= errand.carried_at_most)
            if errand.due is not None:
                late = self._late[number] = self._integer(_HORIZON)
                model.Add(late >= put + errand.handling[1] - errand.due)
            if errand.cooking:
                begin = self._cooked[number] = self._integer(_HORIZON)
                lasts = errand.cooking
                end = begin + lasts
                cooking.append(model.NewIntervalVar(begin, lasts, end, ""))
                model.Add(self._begins[number, 0] >= end)
        if cooking:
            model.AddCumulative(cooking, [1] * len(cooking), self._task.cooks)
        model.Minimize(last + LATE_WEIGHT * sum(self._late.values()))

    def _begin_with(self, hint: Sequence[Act]) -> None:
        routes: Dict[int, List[Stop]] = {robot: [] for robot in range(self._robots)}
        for act in sorted(hint, key=lambda one: one.begin):
            if act.kind == "cook":
                self.model.AddHint(self._cooked[act.errand], act.begin)
                continue
            stop = (act.errand, int(act.kind == "put"))
            robot = int(act.actor[2:-1])
            self.model.AddHint(self._begins[stop], act.begin)
            self.model.AddHint(self._doers[stop], robot)
            routes[robot].append(stop)
        ends = {
            act.errand: act.begin + self._task.errands[act.errand].handling[1]
            for act in hint
            if act.kind == "put"
        }
        self.model.AddHint(self._last, max(ends.values()))
        for number, late in self._late.items():
            self.model.AddHint(late, max(0, ends[number] - (self._task.errands[number].due or 0)))
        used: Set[Tuple[int, int]] = set()
        for robot, stops in routes.items():
            load = 0
            for stop in stops:
                load += self._more(stop)
                self.model.AddHint(self._loads[stop], load)
            line = [robot, *(self._nodes[stop] for stop in stops), (robot + 1) % self._robots]
            used.update(zip(line, line[1:]))
        for key, arc in self._arcs.items():
            self.model.AddHint(arc, int(key in used))


class _Log(cp_model.CpSolverSolutionCallback):
    """Notes when each solution is found."""

    def __init__(self) -> None:
        super().__init__()
        self._began = time.process_time()
        self.found: List[Tuple[float, int]] = []

    def on_solution_callback(self) -> None:
        self.found.append((time.process_time() - self._began, int(self.ObjectiveValue())))


def best_values(task: TimeTask, hint: Sequence[Act], marks: Sequence[float]) -> List[float]:
    """Returns the least value found after some seconds of processor time, infinity without one."""
    log = _Log()
    solver = cp_model.CpSolver()
    solver.parameters.max_time_in_seconds = marks[-1]
    solver.parameters.num_search_workers = _WORKERS
    solver.Solve(TimeModel(task, hint).model, log)
    return [
        min((value for second, value in log.found if second <= mark), default=float("inf"))
        for mark in marks
    ]
