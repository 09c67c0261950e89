"""Has Ctrl-C end the process at once, until the program handles it; to be imported first."""

import signal

signal.signal(signal.SIGINT, signal.SIG_DFL)
