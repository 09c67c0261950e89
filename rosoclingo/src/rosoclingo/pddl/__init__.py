"""Imports planning tasks in PDDL, by Fast Downward's translator. Needs no ROS."""
