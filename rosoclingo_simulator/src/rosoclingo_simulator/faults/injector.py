"""Fault injector: lets the scheduled faults happen to simulated robots and their world."""

from __future__ import annotations

from contextlib import suppress
from typing import Dict, List, Mapping

from rosoclingo_simulator.errors import FaultError, ObstacleError
from rosoclingo_simulator.faults.battery import Battery
from rosoclingo_simulator.faults.kinds import BatteryModel, ClosedDoor, FaultPlan, WrongPose
from rosoclingo_simulator.faults.schedule import FaultState, RobotCondition, fault_states
from rosoclingo_simulator.navigation.estimator import PoseEstimator
from rosoclingo_simulator.navigation.simulation import Simulation
from rosoclingo_simulator.physics.faulty import Disturbance, FaultyPhysics
from rosoclingo_simulator.physics.obstacles import Obstacles
from rosoclingo_simulator.physics.occupancy import OccupancyMap
from rosoclingo_simulator.physics.physics import ROBOT_RADIUS, Pose, normal_angle

_EMPTY = Disturbance(left_stuck=True, right_stuck=True)  # motors without power


class FaultInjector:
    """Changes robots so that they can have faults, and gives them these. One thread uses it.

    Attributes:
        states: Of the faults, in the order of the file.
        batteries: By the names of the robots; only of those that have one.
    """

    def __init__(
        self,
        plan: FaultPlan,
        robots: Mapping[str, Simulation],
        world: OccupancyMap,
        obstacles: Obstacles,
    ) -> None:
        """Puts the robots on physics that can be disturbed, and gives them a localisation.

        Args:
            plan: The faults.
            robots: The robots by their names, before the first step.
            world: Where the walls are.
            obstacles: What closes doors.

        Raises:
            FaultError: A fault cannot happen in this world; the message says which one.
        """
        self.states = fault_states(plan, list(robots))
        self._obstacles = obstacles
        self._simulations = robots
        self._bodies: Dict[str, FaultyPhysics] = {}
        self._estimators: Dict[str, PoseEstimator] = {}
        self.batteries: Dict[str, Battery] = {}
        self._driven = dict.fromkeys(robots, 0.0)
        self._time = 0.0
        for state in self.states:
            self._check(state, world)
        for index, (name, simulation) in enumerate(robots.items()):
            body = FaultyPhysics(simulation.physics, (plan.seed, index))
            self._bodies[name] = body
            self._estimators[name] = PoseEstimator(body)
            simulation.physics, simulation.estimator = body, self._estimators[name]

    def _check(self, state: FaultState, world: OccupancyMap) -> None:
        effect, where = state.fault.effect, state.fault.where
        if isinstance(effect, BatteryModel):
            (robot,) = state.robots
            if robot in self.batteries:
                raise FaultError(f"{where}: {robot or 'the robot'} has a battery already; leave it")
            self.batteries[robot] = Battery(effect)
        elif isinstance(effect, ClosedDoor):
            for name, place in effect.ends:
                if world.clearance(place.x, place.y) == 0:
                    raise FaultError(
                        f"{where}: between: {name} is in a wall or outside of the map; choose "
                        "places on free floor"
                    )
            try:
                self._obstacles.check(*effect.ends)
            except ObstacleError as err:
                raise FaultError(f"{where}: between: {err}") from err
        elif isinstance(effect, WrongPose) and effect.carried_to is not None:
            x, y = effect.carried_to.x, effect.carried_to.y
            if world.clearance(x, y) < ROBOT_RADIUS:
                raise FaultError(
                    f"{where}: carried_to: ({x:g}, {y:g}) is in a wall or outside of the map; "
                    "choose a place where the robot can stand"
                )

    def update(self) -> List[FaultState]:
        """Begins and ends faults after a step of all robots.

        Returns:
            Those that have begun or ended, in this order: first what has ended.
        """
        time = next(iter(self._simulations.values())).time
        seconds, self._time = time - self._time, time
        conditions = {name: self._condition(name, seconds) for name in self._simulations}
        changed = [state for state in self.states if state.is_over(time, conditions)]
        for state in changed:
            state.end(time)
            self._end(state)
        for state in [one for one in self.states if one.is_due(time, seconds, conditions)]:
            if self._begin(state):
                state.begin(time)
                changed.append(state)
            else:
                state.postpone(time)
        if changed:
            for name, body in self._bodies.items():
                body.disturbance = self._disturbance(name)
        return changed

    def _condition(self, name: str, seconds: float) -> RobotCondition:
        body, battery = self._bodies[name], self.batteries.get(name)
        metres, self._driven[name] = body.metres - self._driven[name], body.metres
        if battery is not None:
            battery.update(seconds, metres, body.pose)
        return RobotCondition(
            body.pose,
            metres,
            lost=self._estimators[name].lost,
            empty=battery is not None and battery.empty,
        )

    def _begin(self, state: FaultState) -> bool:
        """Begins a fault's effect on poses and doors; returns false if it has to wait."""
        effect = state.fault.effect
        if isinstance(effect, ClosedDoor):
            try:
                self._obstacles.block(*effect.ends)
            except ObstacleError:
                return False  # a robot stands there
        elif isinstance(effect, WrongPose):
            return self._mislead(state.robots[0], effect)
        return True

    def _mislead(self, name: str, effect: WrongPose) -> bool:
        body, estimator = self._bodies[name], self._estimators[name]
        place, by, pose = effect.carried_to, effect.by, estimator.pose
        if place is not None:
            others = [other.pose for other in self._bodies.values() if other is not body]
            if any(place.distance(other) < 2 * ROBOT_RADIUS for other in others):
                return False
            estimator.lose(pose, unsure=effect.lost)
            body.reset(place)
        elif by is not None:
            jumped = Pose(pose.x + by.x, pose.y + by.y, normal_angle(pose.theta + by.theta))
            estimator.lose(jumped, unsure=effect.lost)
        return True

    def _end(self, state: FaultState) -> None:
        """Ends a fault's effect on poses and doors, unless another fault has the same."""
        effect = state.fault.effect
        others = [one for one in self.states if one.active]
        if isinstance(effect, ClosedDoor):
            doors = [one.fault.effect for one in others if isinstance(one.fault.effect, ClosedDoor)]
            if any(set(door.ends) == set(effect.ends) for door in doors):
                return
            with suppress(ObstacleError):  # it was opened meanwhile
                self._obstacles.unblock(*effect.ends)
        elif isinstance(effect, WrongPose) and not any(
            isinstance(one.fault.effect, WrongPose) and one.robots == state.robots for one in others
        ):
            self._estimators[state.robots[0]].find()

    def _disturbance(self, name: str) -> Disturbance:
        """Returns the sum of all that disturbs a robot now."""
        total = Disturbance()
        for state in self.states:
            if state.active and name in state.robots:
                effect = state.fault.effect
                if isinstance(effect, Disturbance):
                    total += effect
                elif isinstance(effect, BatteryModel):
                    total += _EMPTY
        return total
