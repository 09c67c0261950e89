"""Profiles planning: times, ground instances of each statement, and advice."""
