"""Reads a bag, also a damaged one, into a :class:`.model.Recording`. Needs no ROS."""
