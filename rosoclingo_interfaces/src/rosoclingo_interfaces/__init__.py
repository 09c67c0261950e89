"""Interfaces: nodes that execute the actions of a plan."""

import rosclingo  # noqa: F401 (finds the libraries that our Debian packages bring along)
