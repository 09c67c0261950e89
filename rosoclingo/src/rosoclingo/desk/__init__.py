"""The planning system in one process, to try encodings at the desk. Needs no ROS."""
