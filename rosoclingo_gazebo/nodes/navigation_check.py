#!/usr/bin/env python
from rosclingo.start import starting

with starting():
    from rosoclingo_gazebo.navigation.check import main

main()
