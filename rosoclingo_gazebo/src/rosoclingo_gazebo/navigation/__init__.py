"""ROS's own navigation with the office: what it needs."""
