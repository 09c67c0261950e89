#!/usr/bin/env python
from rosoclingo.tools.pddl.command import main

main()
