"""clingo behind a ROS service and an action.

Only :mod:`rosclingo.node` and :mod:`rosclingo.client` need ROS; everything else runs, and is
tested, without it.
"""
