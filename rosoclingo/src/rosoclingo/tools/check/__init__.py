"""Checks an encoding before anything runs: static analysis, examples and random runs.

:mod:`.static` reads the encoding, and :mod:`.model` what it tells the library for actions.
:mod:`.examples` plans what its author expects. :mod:`.search` makes random runs, at which
:mod:`.invariants` and :mod:`.twins` look, and shrinks one in which something is wrong. :mod:`.live`
compares with a running system. :mod:`.command` is the command ``check.py`` (docs/check.md).
"""
