#!/usr/bin/env python
import signal

# Until the node can handle it, Ctrl-C ends the process without a word.
signal.signal(signal.SIGINT, signal.SIG_DFL)

from rosoclingo_gazebo.demo.fleet_node import main

main()
