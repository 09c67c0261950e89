"""Records runs in bags, replays them through the nodes, and shows them.

Only recording and replaying need ROS; reading, comparing and reporting run without it.
"""
