#!/usr/bin/env python
from rosoclingo.tools.new.command import main

main()
