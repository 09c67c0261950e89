"""Errors of bags, each of whose messages names the bag and the remedy."""

from __future__ import annotations

from rosclingo.errors import RosclingoError


class BagError(RosclingoError):
    """A bag cannot be read, written or replayed."""


class NoBagError(BagError):
    """A path leads to no bag: it does not exist, or is a folder, empty or another kind of file."""


class BagVersionError(BagError):
    """A bag of a format that is not read, such as version 1.2 or encrypted."""


class DamagedBagError(BagError):
    """A bag is damaged so much that nothing can be read."""


class BagSizeError(BagError):
    """A bag expands to so much more than its size that it is taken for a decompression bomb."""


class NoSystemError(BagError):
    """A bag has no run of a rosoclingo node, or not that of the given name."""


class SeveralSystemsError(BagError):
    """A bag has runs of several rosoclingo nodes, and no name chooses."""


class IncompleteBagError(BagError):
    """A recording lacks so much of its run that it cannot be compared."""


class BagTypeError(BagError):
    """A topic's messages are of another type or MD5 sum than the system's."""


class ReplayError(BagError):
    """A bag cannot be replayed; the message says why and what to do."""


class BagWriteError(BagError):
    """A bag cannot be written: it exists, or the folder or disk refuses."""
