"""Kinds of needs and changes of numbers, and of aims; imports nothing, as that would take time."""

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

WAITS = 0
"""A plan has the least sum of the times at which requests are met."""
MAKESPAN = 1
"""It ends as early as possible."""
COST = 2
"""Its actions cost the least."""
