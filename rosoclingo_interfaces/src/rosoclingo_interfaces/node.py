"""The name by which a robot's program imports :func:`run`, which runs its interface as a node."""

from rosoclingo_interfaces.ros.node import run

__all__ = ["run"]
