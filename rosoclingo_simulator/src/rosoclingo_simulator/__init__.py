"""An office in one description, and a simulator of a robot in it."""
