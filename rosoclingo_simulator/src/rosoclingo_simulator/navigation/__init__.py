"""Robots that drive, step by step, as with move_base: costmap, paths, right of way."""
