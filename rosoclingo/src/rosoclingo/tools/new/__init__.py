"""Writes a package for a robot of one's own. Needs no ROS."""
