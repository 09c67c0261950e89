"""How each program of these packages starts."""

import gc
import signal
from contextlib import contextmanager
from typing import Iterator


@contextmanager
def starting() -> Iterator[None]:
    """Imports what a program needs: Ctrl-C ends the process at once, until the program handles it.

    And nobody looks for garbage among the modules, neither while they come nor later: they are
    there to stay, and that takes a tenth of the processor time of a node's start.
    """
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        gc.enable()
