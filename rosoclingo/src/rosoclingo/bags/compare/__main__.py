"""``python3 -m rosoclingo.bags.compare`` is ``rosrun rosoclingo compare.py`` without ROS."""

from rosoclingo.bags.compare.command import main

main()
