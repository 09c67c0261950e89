#!/usr/bin/env python
import signal

# Python could not handle Ctrl-C before a search is over.
signal.signal(signal.SIGINT, signal.SIG_DFL)

from rosoclingo.desk.plan import main

main()
