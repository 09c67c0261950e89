"""Fault injection: a schedule of faults, read from a file, and their effects on the robots."""
