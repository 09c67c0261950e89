"""The ways of a robot that drives: waypoints, cross-track error, and what ends a drive."""
