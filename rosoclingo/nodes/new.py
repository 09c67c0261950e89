#!/usr/bin/env python
from rosoclingo.scaffold.command import main

main()
