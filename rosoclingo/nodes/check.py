#!/usr/bin/env python
import rosclingo.start  # noqa: F401 (Ctrl-C ends it at once)
from rosoclingo.ros.live import look
from rosoclingo.tools.check.command import main

main(look)
