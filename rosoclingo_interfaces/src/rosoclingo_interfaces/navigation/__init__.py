"""Navigation of a robot that drives: waypoints, cross-track error, and watchdogs of drives."""
