"""Generates maps, models and facts from the description of a building."""
