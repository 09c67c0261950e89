"""Says what is different in two runs, on a terminal and as JUnit's XML. Needs no ROS."""
