"""Draws a map with robots, packages and plans as shapes, for rviz and pictures. Needs no ROS.

Its folder ``page/`` has the scripts by which the pages of report.py and console.py draw time lines;
:mod:`.holds` makes bars for them of what an operator held.
"""
