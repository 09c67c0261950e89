"""The planning loop: its state, inputs and outputs. Needs no ROS."""
