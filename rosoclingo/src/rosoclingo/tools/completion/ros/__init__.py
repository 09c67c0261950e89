"""Completion in a ROS graph, without a node of its own."""
