"""The mode: the controller's solver, which decides on the next command, and its commands."""
