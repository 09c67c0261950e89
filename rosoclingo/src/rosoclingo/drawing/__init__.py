"""Draws a map with robots, packages and plans as shapes, for rviz and pictures. Needs no ROS.

Its folder ``page/`` has the scripts by which the pages of report.py and console.py draw time lines.
"""

from pathlib import Path

SHARED_FILES = Path(__file__).resolve().parent / "page"
"""The folder with the scripts and styles that the pages share, as ES modules."""
