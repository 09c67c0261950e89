"""Replays a recorded run through the nodes, on a ROS master of its own."""
