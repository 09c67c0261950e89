#!/usr/bin/env python
from rosclingo.start import starting

with starting(numpy=True):
    from rosoclingo_simulator.world.generate import main

main()
