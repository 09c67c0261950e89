#!/usr/bin/env python
from rosclingo.start import starting

with starting():
    from rosoclingo_rviz.node import main

main()
