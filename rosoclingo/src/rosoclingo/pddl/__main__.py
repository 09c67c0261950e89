"""``python3 -m rosoclingo.pddl`` is ``rosrun rosoclingo pddl.py`` without ROS."""

from rosoclingo.pddl.command import main

main()
