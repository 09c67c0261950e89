"""Start-up of all programs of these packages."""

import gc
import signal
import sys
from contextlib import contextmanager
from types import ModuleType
from typing import Any, Iterator

_CONDITION = "catkin_pkg.condition"


@contextmanager
def starting(*, numpy: bool = False) -> Iterator[None]:
    """A context for a program's imports: Ctrl-C ends the process at once, until it is handled.

    And nobody looks for garbage among the modules, neither while they come nor later: they are
    there to stay, and that takes a tenth of the processor time of a node's start.

    rospy imports catkin's parser of conditions in ``package.xml``, which takes as long again, and a
    node needs no package. It is imported when a condition is evaluated.

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
    lazy = ModuleType(_CONDITION)
    lazy.evaluate_condition = _evaluate_condition  # type: ignore[attr-defined]
    sys.modules.setdefault(_CONDITION, lazy)
    try:
        yield
    finally:
        _drop_lazy()
        if is_hidden and not sys.modules.get("numpy"):
            sys.modules.pop("numpy", None)
        gc.freeze()
        gc.enable()


def _evaluate_condition(*arguments: Any) -> Any:
    """Stands in for catkin's function of this name, which it imports when it is called."""
    _drop_lazy()
    from catkin_pkg.condition import evaluate_condition  # noqa: PLC0415 (takes 10 ms)

    return evaluate_condition(*arguments)


def _drop_lazy() -> None:
    """Makes the next import of catkin's parser load the module itself."""
    module = sys.modules.get(_CONDITION)
    if getattr(module, "evaluate_condition", None) is _evaluate_condition:
        del sys.modules[_CONDITION]
