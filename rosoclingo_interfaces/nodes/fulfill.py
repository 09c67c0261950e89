#!/usr/bin/env python
from rosclingo.start import starting

with starting():
    from rosoclingo_interfaces.fulfill import main

main()
