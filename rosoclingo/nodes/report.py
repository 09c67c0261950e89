#!/usr/bin/env python
from rosclingo.start import starting

with starting():
    from rosoclingo.bags.report.command import main

main()
