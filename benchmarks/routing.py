#!/usr/bin/env python3
"""Plans deliveries on a grid by OR-Tools: vehicle routing with guided local search.

Takes the side of the grid, the robots, the seconds, and the requests as JSON, as in [[1,9],[3,2]]:
a package is brought from the first office to the second, one at a time. All robots begin at the
first corridor. Prints when the last robot is through, in steps.
"""

from __future__ import annotations

import json
import sys
from typing import List, Tuple

from ortools.constraint_solver import pywrapcp, routing_enums_pb2

_HORIZON = 10**6  # more than any route takes
_SPAN_WEIGHT = 1000  # of the longest route, beside the sum of all


def corridor(office: int, side: int) -> Tuple[int, int]:
    """Returns where the corridor of an office is."""
    return (office - 1) % side, (office - 1) // side


def steps(begin: int, end: int, side: int) -> int:
    """Returns how many moves it takes from one office to another."""
    if begin == end:
        return 0
    (left, top), (right, bottom) = corridor(begin, side), corridor(end, side)
    return abs(left - right) + abs(top - bottom) + 2


def last_through(side: int, robots: int, seconds: int, requests: List[Tuple[int, int]]) -> int:
    """Returns when the last robot is through by the best plan that is found in some seconds."""
    manager = pywrapcp.RoutingIndexManager(len(requests) + 1, robots, 0)
    model = pywrapcp.RoutingModel(manager)

    def cost(begin: int, end: int) -> int:
        before, task = manager.IndexToNode(begin), manager.IndexToNode(end)
        if task == 0:
            return 0
        origin, destination = requests[task - 1]
        to_origin = sum(corridor(origin, side)) + 1
        if before:
            to_origin = steps(requests[before - 1][1], origin, side)
        return to_origin + steps(origin, destination, side) + 2

    transit = model.RegisterTransitCallback(cost)
    model.SetArcCostEvaluatorOfAllVehicles(transit)
    if robots > 1:
        model.AddDimension(transit, 0, _HORIZON, True, "time")
        model.GetDimensionOrDie("time").SetGlobalSpanCostCoefficient(_SPAN_WEIGHT)
    search = pywrapcp.DefaultRoutingSearchParameters()
    search.first_solution_strategy = routing_enums_pb2.FirstSolutionStrategy.PATH_CHEAPEST_ARC
    search.local_search_metaheuristic = (
        routing_enums_pb2.LocalSearchMetaheuristic.GUIDED_LOCAL_SEARCH
    )
    search.time_limit.FromSeconds(seconds)
    plan = model.SolveWithParameters(search)
    longest = 0
    for vehicle in range(robots):
        place, total = model.Start(vehicle), 0
        while not model.IsEnd(place):
            after = plan.Value(model.NextVar(place))
            total += model.GetArcCostForVehicle(place, after, vehicle)
            place = after
        longest = max(longest, total)
    return longest


if __name__ == "__main__":
    SIDE, ROBOTS, SECONDS = map(int, sys.argv[1:4])
    print(last_through(SIDE, ROBOTS, SECONDS, [(a, b) for a, b in json.loads(sys.argv[4])]))
