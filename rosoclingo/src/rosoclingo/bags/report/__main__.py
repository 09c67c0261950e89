"""``python3 -m rosoclingo.bags.report`` is ``rosrun rosoclingo report.py`` without ROS."""

from rosoclingo.bags.report.command import main

main()
