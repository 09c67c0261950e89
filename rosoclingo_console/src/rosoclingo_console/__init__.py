"""An operator's console in the browser: sees what systems do, and says what they may do."""

import rosclingo  # noqa: F401 (finds the libraries that our Debian packages bring along)
