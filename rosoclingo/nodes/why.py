#!/usr/bin/env python
from rosclingo.start import starting

with starting():
    from rosoclingo.ros.why_command import main

main()
