"""The command ``plan.py``: plans and simulates encodings in one process. Needs no ROS."""
