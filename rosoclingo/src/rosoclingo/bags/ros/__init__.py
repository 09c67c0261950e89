"""Programs on ROS: the recorder, and the replay of a recorded run through the nodes."""
