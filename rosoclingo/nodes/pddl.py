#!/usr/bin/env python
from rosoclingo.pddl.command import main

main()
