"""The command ``plan.py``: plans and simulates encodings at the desk. Needs no ROS."""
