"""Validates the actions of mailbots without a solver."""
