"""Completion in a ROS graph: of a node that listens to ``~about``, and of bash, without a node."""
