"""The solver node, its client, and what all our nodes need of ROS."""
