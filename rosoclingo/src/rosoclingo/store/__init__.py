"""What a run is saved in, so that it goes on when its process has died. Needs no ROS."""
