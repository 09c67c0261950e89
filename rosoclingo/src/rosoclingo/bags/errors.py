"""What can be wrong with a bag, one class each; every message names the bag and the remedy."""

from __future__ import annotations

from rosclingo.errors import RosclingoError


class BagError(RosclingoError):
    """A bag cannot be read, written or replayed."""


class NoBagError(BagError):
    """What was named is no bag: not there, a folder, empty, or another kind of file."""


class BagVersionError(BagError):
    """A bag of a format that is not read, such as version 1.2 or encrypted."""


class DamagedBagError(BagError):
    """So much of a bag is lost that nothing can be read."""


class BagSizeError(BagError):
    """A bag expands to so much more than its size that it was not recorded but made."""


class NoSystemError(BagError):
    """A bag has no run of a rosoclingo node, or not that of the given name."""


class SeveralSystemsError(BagError):
    """A bag has runs of several rosoclingo nodes, and no name chooses."""


class IncompleteBagError(BagError):
    """So much of a run was not recorded that it cannot be compared."""


class BagTypeError(BagError):
    """A topic's messages are of another type or MD5 sum than the system's."""


class BagWriteError(BagError):
    """A bag cannot be written: it exists, or the folder or disk refuses."""
