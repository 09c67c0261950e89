"""Draws a map with robots, packages and plans as shapes, for rviz and pictures. Needs no ROS."""
