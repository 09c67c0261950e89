"""Shows a recorded run as an HTML page and as a picture. Needs no ROS."""
