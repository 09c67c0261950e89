#!/usr/bin/env python
from rosclingo.start import starting

with starting():
    from rosoclingo.desk.plan import main

main()
