#!/usr/bin/env python
from rosclingo.start import starting

with starting():
    from rosoclingo_examples.session import main

main("mailbot_manual", with_object=False)
