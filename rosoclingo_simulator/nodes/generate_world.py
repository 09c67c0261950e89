#!/usr/bin/env python
import signal

# Ctrl-C ends the process without a word.
signal.signal(signal.SIGINT, signal.SIG_DFL)

from rosoclingo_simulator.world.generate import main

main()
