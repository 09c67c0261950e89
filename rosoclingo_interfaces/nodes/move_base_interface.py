#!/usr/bin/env python
from rosclingo.start import starting

with starting():
    from rosoclingo_interfaces.navigation.move_base import main

main()
