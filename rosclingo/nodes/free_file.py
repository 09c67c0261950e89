#!/usr/bin/env python
import sys

from rosclingo.start import starting

with starting():
    from rosclingo.free_file import main

main(sys.argv)
