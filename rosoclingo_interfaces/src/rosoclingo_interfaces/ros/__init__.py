"""ROS nodes that execute actions or announce blocked paths, and a client of move_base."""
