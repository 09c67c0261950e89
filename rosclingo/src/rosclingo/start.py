"""Prepares a process: Ctrl-C ends it, and Python looks for garbage less often.

To be imported first. Ctrl-C ends it at once, until the program handles it.
"""

import gc
import signal

signal.signal(signal.SIGINT, signal.SIG_DFL)

# By default, Python looks for garbage after every 700 new objects. What is imported and parsed
# stays, and a tenth of the time of a short process went into looking at it.
gc.set_threshold(20_000)
