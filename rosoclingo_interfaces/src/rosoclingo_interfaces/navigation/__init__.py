"""The action go of a robot that drives, by move_base."""
