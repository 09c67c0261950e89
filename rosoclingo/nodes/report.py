#!/usr/bin/env python
import signal

# Until Python can handle it, Ctrl-C ends the process without a word.
signal.signal(signal.SIGINT, signal.SIG_DFL)

from rosoclingo.bags.report.command import main

main()
