"""What rviz shows of a graph: blocked ways, the plan ahead, packages and robots."""
