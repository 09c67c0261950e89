"""Publishes the health of a node's parts on ``/diagnostics``, in a thread of its own."""

from __future__ import annotations

import socket
import threading
from functools import partial
from typing import Callable, Dict, Sequence, Tuple

import rospy
from diagnostic_updater import DiagnosticStatusWrapper, Updater

from rosclingo.errors import report
from rosclingo.health import PERIOD_SECONDS, SLOW_SECONDS, Health
from rosclingo.ros import parameters
from rosclingo.ros.init import on_shutdown


def read_parameters() -> Tuple[float, float]:
    """Reads ``~diagnostics_period`` and ``~slow_seconds``.

    Returns:
        How often a node reports its health, in seconds of the wall clock, and after how many a
        request, a search or a decision is slow; 0 for never.

    Raises:
        ParameterError: One of them is wrong.
    """
    return (
        parameters.number("diagnostics_period", PERIOD_SECONDS, what="seconds"),
        parameters.number("slow_seconds", SLOW_SECONDS, what="seconds"),
    )


class DiagnosticsPublisher:
    """Publishes what a function returns, again and again.

    The clock is the wall clock, so that it is seen that a node lives whose simulator stands still.
    Thread-safe. ``_lock`` is held while the function is called and its values are published;
    nothing else is locked meanwhile, but what the function locks itself.
    """

    def __init__(self, healths: Callable[[], Sequence[Health]], period: float) -> None:
        """Opens the topic, unless the period is 0.

        Args:
            healths: Returns the health of each part of the node; called in a thread of this class
                and in those that call :meth:`publish`. Its names may come, and do not go.
            period: How often it is published, in seconds of the wall clock; 0 for never.
        """
        self._healths = healths
        self._period = period
        self._lock = threading.Lock()
        self._last: Dict[str, Health] = {}
        self._ended = threading.Event()
        if period > 0:
            self._updater = Updater()
            self._updater.setHardwareID(socket.gethostname())

    def start(self) -> None:
        """Publishes from now on, until the node is shut down."""
        if self._period > 0:
            threading.Thread(target=self._run, name="diagnostics", daemon=True).start()
            on_shutdown(self._ended.set)

    def _run(self) -> None:
        self.publish()
        while not self._ended.wait(self._period):
            self.publish()

    def publish(self) -> None:
        """Publishes now, as when something has happened that is to be known at once."""
        if self._period == 0:
            return
        with self._lock:
            try:
                self._publish()
            except Exception as err:  # a bug in a report must not end all reports
                if not rospy.core.is_shutdown_requested():
                    report(err, "while publishing diagnostics")

    def _publish(self) -> None:
        healths = self._healths()
        new = [one.name for one in healths if one.name not in self._last]
        self._last.update((one.name, one) for one in healths)
        for name in new:  # of which the updater says that it starts
            self._updater.add(name, partial(self._fill, name))
        self._updater.force_update()

    def _fill(self, name: str, status: DiagnosticStatusWrapper) -> DiagnosticStatusWrapper:
        health = self._last[name]
        status.summary(int(health.level), health.message)
        for key, value in health.values:
            status.add(key, value)
        return status
