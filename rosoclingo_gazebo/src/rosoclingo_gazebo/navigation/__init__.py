"""Support for ROS's own navigation in the office."""
