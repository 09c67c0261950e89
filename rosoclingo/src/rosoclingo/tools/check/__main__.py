"""``python3 -m rosoclingo.tools.check`` is ``check.py`` without ROS."""

from __future__ import annotations

import signal

from rosoclingo.tools.check.command import main

# Python could not handle Ctrl-C before a search is over.
signal.signal(signal.SIGINT, signal.SIG_DFL)
main()
