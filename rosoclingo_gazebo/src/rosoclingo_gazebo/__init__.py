"""The manual's office: checks before its start, and the demos."""

import rosclingo  # noqa: F401 (finds the libraries that our Debian packages bring along)
