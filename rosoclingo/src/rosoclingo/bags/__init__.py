"""Records runs in bags, replays them through the nodes, and shows them.

Only the ROS halves of recording and replaying need ROS; reading, comparing and reporting run
without it.
"""
