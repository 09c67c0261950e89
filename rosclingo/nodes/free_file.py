#!/usr/bin/env python
import sys

import rosclingo.start  # noqa: F401 (Ctrl-C ends it at once)
from rosclingo.free_file import main

main(sys.argv)
