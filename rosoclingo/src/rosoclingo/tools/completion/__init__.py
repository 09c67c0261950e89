"""Completion of what users type in bash, from what a running system knows.

:mod:`.shell_line` has the syntax of bash, :mod:`.questions` the words of ``why.py``.
"""
