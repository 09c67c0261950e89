#!/usr/bin/env python
import os
import signal
import sys

# Until the node can handle it, Ctrl-C ends the process without a word.
signal.signal(signal.SIGINT, signal.SIG_DFL)
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

from commands import ROSCommands

from rosoclingo.ros.node import main

main(ROSCommands)
