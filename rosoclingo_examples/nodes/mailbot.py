#!/usr/bin/env python
import rosclingo.start  # noqa: F401 (Ctrl-C ends it at once)
from rosoclingo_examples.ros.session import main

main("mailbot", with_object=True)
