"""A map with what goes on in it, as shapes: for rviz, and for pictures of plans. Needs no ROS."""
