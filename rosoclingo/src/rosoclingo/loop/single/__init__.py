"""The one-node system: the paper's Algorithm 1, and three dialects. Needs no ROS."""
