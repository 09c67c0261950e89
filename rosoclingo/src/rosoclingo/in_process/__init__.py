"""The whole system in one process and thread, without ROS: for commands and tests.

:mod:`.parts` builds a loop from a mode and encodings, :mod:`.system` runs it in a world where all
actions succeed, and :mod:`.simulation` in one with a clock, failures and scheduled inputs.
"""
