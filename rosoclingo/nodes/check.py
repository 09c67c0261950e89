#!/usr/bin/env python
from rosclingo.start import starting

with starting():
    from rosoclingo.check.command import main
    from rosoclingo.ros.live import look

main(look)
