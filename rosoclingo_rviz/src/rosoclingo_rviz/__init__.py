"""Draws a graph in rviz: blocked ways, the plan ahead, packages and robots."""
