#!/usr/bin/env python
from rosclingo.start import starting

with starting():
    from rosoclingo.bags.record.recorder import main

main()
