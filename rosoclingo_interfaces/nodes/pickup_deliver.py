#!/usr/bin/env python
from rosclingo.start import starting

with starting():
    from rosoclingo_interfaces.pickup_deliver import main

main()
