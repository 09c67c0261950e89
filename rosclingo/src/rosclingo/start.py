"""How each program of these packages starts."""

import gc
import signal
import sys
from contextlib import contextmanager
from typing import Iterator


@contextmanager
def starting(*, numpy: bool = False) -> Iterator[None]:
    """Imports what a program needs: Ctrl-C ends the process at once, until the program handles it.

    And nobody looks for garbage among the modules, neither while they come nor later: they are
    there to stay, and that takes a tenth of the processor time of a node's start.

    Args:
        numpy: Whether the program needs NumPy. Else ROS's messages do not get it, which import it
            to name NumPy's numbers rightly in the error about a message with a wrong value, and
            would take a fifth of the start and 15 MB of memory. Who imports it later has it.
    """
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    gc.disable()
    is_hidden = not numpy and "numpy" not in sys.modules
    if is_hidden:
        sys.modules["numpy"] = None  # type: ignore[assignment]
    try:
        yield
    finally:
        if is_hidden and not sys.modules.get("numpy"):
            sys.modules.pop("numpy", None)
        gc.freeze()
        gc.enable()
