"""Values of the planning loop, and its ports: solver, environment, recorded outcomes."""
