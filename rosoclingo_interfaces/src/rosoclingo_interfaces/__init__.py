"""Nodes that do the actions of a plan."""
