"""``python3 -m rosoclingo.tools.pddl`` is ``rosrun rosoclingo pddl.py`` without ROS."""

from rosoclingo.tools.pddl.command import main

main()
