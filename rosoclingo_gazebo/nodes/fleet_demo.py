#!/usr/bin/env python
from rosclingo.start import starting

with starting(numpy=True):
    from rosoclingo_gazebo.demo.fleet_node import main

main()
