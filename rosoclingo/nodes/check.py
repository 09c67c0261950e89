#!/usr/bin/env python
import rosclingo.start  # noqa: F401 (Ctrl-C ends it at once)
from rosoclingo.check.command import main
from rosoclingo.ros.live import look

main(look)
