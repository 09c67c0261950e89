#!/usr/bin/env python
import os
import sys

from rosclingo.start import starting

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
with starting():
    from rosoclingo.ros.single_node import main
with starting(numpy=True):  # which a user's commands may need
    from commands import ROSCommands

main(ROSCommands)
