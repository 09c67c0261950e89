"""``python3 -m rosoclingo.tools.new`` is ``rosrun rosoclingo new.py`` without ROS."""

from rosoclingo.tools.new.command import main

main()
