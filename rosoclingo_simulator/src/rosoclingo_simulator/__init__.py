"""An office in one description, and a simulator of a robot in it."""

import rosclingo  # noqa: F401 (finds the libraries that our Debian packages bring along)
