#!/usr/bin/env python
from rosclingo.start import starting

with starting():
    from rosoclingo.bags.replay.command import main

main()
