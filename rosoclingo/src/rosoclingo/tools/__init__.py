"""Commands for authors of encodings: plan, check, import, profile, begin a package.

Each is a folder: :mod:`.plan` is ``plan.py``, with the figures of :mod:`.profile`; :mod:`.check` is
``check.py``, :mod:`.pddl` ``pddl.py``, :mod:`.new` ``new.py``.
"""
