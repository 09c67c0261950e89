#!/usr/bin/env python
from rosclingo.start import starting

with starting():
    from rosclingo.ros.node import main

main()
