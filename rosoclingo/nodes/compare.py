#!/usr/bin/env python
from rosclingo.start import starting

with starting():
    from rosoclingo.bags.compare.command import main

main()
