"""``python3 -m rosoclingo.scaffold`` is ``rosrun rosoclingo new.py`` without ROS."""

from rosoclingo.scaffold.command import main

main()
