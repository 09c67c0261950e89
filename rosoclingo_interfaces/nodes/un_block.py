#!/usr/bin/env python
from rosclingo.start import starting

with starting():
    from rosoclingo_interfaces.un_block import main

main()
