"""Compares two runs, and reports differences on a terminal and as JUnit's XML. Needs no ROS."""
