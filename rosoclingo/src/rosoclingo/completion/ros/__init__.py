"""Completion in a ROS graph, by a node that listens to ``~about``."""
