"""Analyses encodings without running them, and the command lines of nodes that run them.

:mod:`.about` decodes how a node was started, from its ``~about``; :mod:`.unpack` writes its files
to a :mod:`.folder`, and :mod:`.started_with` compares them. :mod:`.alphabet` asks a planner which
events an encoding declares, :mod:`.graph` reads its map, and :mod:`.known` has both read in a
process of its own, :mod:`.grounding`, for commands and pages.
"""
