"""The planner: the events it knows, its searches for plans, and their improvement."""
