#!/usr/bin/env python
import os
import sys

from rosclingo.start import starting

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
with starting():
    from commands import ROSCommands

    from rosoclingo.ros.single_node import main

main(ROSCommands)
