#!/usr/bin/env python
import rosclingo.start  # noqa: F401 (Ctrl-C ends it at once)
from rosclingo.ros.node import main

main()
