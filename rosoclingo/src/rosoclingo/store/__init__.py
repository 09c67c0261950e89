"""Durable storage of a run, which another process resumes after a crash. Needs no ROS."""
