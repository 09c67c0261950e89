"""Imports planning tasks in PDDL, by Fast Downward's translator: the command ``pddl.py``."""
