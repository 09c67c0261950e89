#!/usr/bin/env python
import rosclingo.start  # noqa: F401 (Ctrl-C ends it at once)
from rosoclingo_interfaces.ros.adapter import main

main()
