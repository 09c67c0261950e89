"""The planner: what it is told, how it searches for plans, and how it improves them."""
