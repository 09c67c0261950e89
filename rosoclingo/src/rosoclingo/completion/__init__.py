"""Completion of what users type, from what an encoding knows.

:mod:`rosoclingo.completion.encoding` reads an encoding without a run, by :mod:`.grounding`; the
operator's console draws its map, too.
"""
