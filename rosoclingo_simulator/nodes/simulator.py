#!/usr/bin/env python
from rosclingo.start import starting

with starting(numpy=True):
    from rosoclingo_simulator.simulator.node import main

main()
