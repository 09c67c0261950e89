"""Publishes the faults of the robots, and the states of their batteries."""

from __future__ import annotations

import json
import math
from typing import Sequence

import rospy
from sensor_msgs.msg import BatteryState
from std_msgs.msg import String

from rosclingo.ros.low_latency import publisher
from rosoclingo_simulator.faults.battery import Battery
from rosoclingo_simulator.faults.injector import FaultInjector
from rosoclingo_simulator.faults.schedule import FaultState, report_faults
from rosoclingo_simulator.ros.messages import RobotNames

_BATTERY_SECONDS = 1.0  # of simulated time, from one message about a battery to the next
_ROUNDING = 1e-6  # seconds, what times may be off


class FaultPublisher:
    """Injects faults and tells of them. The simulation's thread uses it."""

    def __init__(self, injector: FaultInjector, names: Sequence[RobotNames]) -> None:
        """Opens the topics, and says that there is no fault yet.

        Args:
            injector: Lets faults happen.
            names: Those of the robots.
        """
        self._injector = injector
        self._due = 0.0
        self._faults = publisher("~faults", String, latch=True)
        self._batteries = [
            (name, publisher(name.topic("battery_state"), BatteryState, latch=True))
            for name in names
            if name.robot in injector.batteries
        ]
        self._publish(0.0)

    def update(self, time: float, stamp: rospy.Time) -> None:
        """Begins and ends faults after a step.

        Args:
            time: Simulated seconds since the start.
            stamp: What the clock says.
        """
        changed = self._injector.update()
        for state in changed:
            rospy.logwarn("%s", _text(state))
        if changed:
            self._publish(time)
        if time >= self._due - _ROUNDING:
            self._due = time + _BATTERY_SECONDS
            for name, topic in self._batteries:
                message = battery_message(self._injector.batteries[name.robot])
                message.header.stamp = stamp
                message.header.frame_id = name.base
                topic.publish(message)

    def _publish(self, time: float) -> None:
        told = {"time": round(time, 3), "faults": report_faults(self._injector.states)}
        self._faults.publish(json.dumps(told))


def battery_message(battery: Battery) -> BatteryState:
    """Returns the state of a battery; what is not simulated is not a number, as usual."""
    message = BatteryState(present=True, voltage=math.nan, current=math.nan)
    message.temperature = math.nan
    message.percentage = battery.level
    message.capacity = message.design_capacity = battery.model.capacity
    message.charge = battery.level * battery.model.capacity
    message.power_supply_technology = BatteryState.POWER_SUPPLY_TECHNOLOGY_LION
    message.power_supply_health = BatteryState.POWER_SUPPLY_HEALTH_GOOD
    if battery.level == 0:
        message.power_supply_health = BatteryState.POWER_SUPPLY_HEALTH_DEAD
    message.power_supply_status = BatteryState.POWER_SUPPLY_STATUS_DISCHARGING
    if battery.charging:
        full = battery.level == 1
        message.power_supply_status = (
            BatteryState.POWER_SUPPLY_STATUS_FULL
            if full
            else BatteryState.POWER_SUPPLY_STATUS_CHARGING
        )
    return message


def _text(state: FaultState) -> str:
    """Returns a sentence for the log."""
    fault = state.fault
    robot = f" of {state.robots[0]}" if len(state.robots) == 1 and state.robots[0] else ""
    change = "begins" if state.active else "ends"
    return f"fault {fault.number} ({fault.kind}){robot} {change}"
