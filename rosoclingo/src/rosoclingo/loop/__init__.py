"""The planning loop, its state, and what comes in and goes out. Needs no ROS."""
