#!/usr/bin/env python
import signal

# Python could not handle Ctrl-C before a search is over.
signal.signal(signal.SIGINT, signal.SIG_DFL)

from rosoclingo.check.command import main
from rosoclingo.ros.live import look

main(look)
