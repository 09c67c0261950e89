"""Kinds of needs and changes of numbers; a module without imports, which would take their time."""

TAKES = 0
"""The action takes the amount; so much has to be there before."""
ADDS = 1
"""The action adds the amount; level and amount together are at most the limit before."""
BECOMES = 2
"""The number has the amount afterwards, whatever else the action takes or adds."""
NEEDS_LEAST = 3
"""The level before is at least the amount."""
NEEDS_MOST = 4
"""The level before is at most the amount."""
