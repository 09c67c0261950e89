#!/usr/bin/env python
import os
import sys

import rosclingo.start  # noqa: F401 (Ctrl-C ends it at once)
from rosoclingo.ros.node import main

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from commands import ROSCommands

main(ROSCommands)
