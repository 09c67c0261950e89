"""Profiles planning: times, atoms by predicate, and ground instances by statement."""
