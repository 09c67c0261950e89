"""The web server: the page, its live channel, and requests of operators. Needs no ROS."""
