"""Completion of what users type, from what a running system and its encoding know.

:mod:`rosoclingo.completion.encoding` reads an encoding without a run, by :mod:`.grounding`; the
operator's console draws its map, too. :mod:`.shell_line` has the syntax of bash, :mod:`.questions`
the words of ``why.py``.
"""
