#!/usr/bin/env python
from rosclingo.start import starting

with starting(numpy=True):
    from rosoclingo_gazebo.demo.node import main

main()
