"""A folder for the files of an encoding, which does not outlast its process for long.

>>> folder = Folder()
>>> folder.path.is_dir()
True
>>> folder.remove()
>>> folder.path.exists()
False
"""

from __future__ import annotations

import atexit
import contextlib
import fcntl
import os
import shutil
import tempfile
import time
from pathlib import Path

_PREFIX = "rosoclingo_why_"
_SECONDS_TO_LOCK = 10.0  # an older folder that is not locked is of a process that was killed


class Folder:
    """A temporary folder of this process; each new one removes those of dead processes.

    Attributes:
        path: The folder.
    """

    def __init__(self) -> None:
        for path in Path(tempfile.gettempdir()).glob(f"{_PREFIX}*"):
            with contextlib.suppress(OSError):  # it is another user's, or its process lives
                if time.time() - path.stat().st_mtime > _SECONDS_TO_LOCK:
                    os.close(_lock(path))
                    shutil.rmtree(path, ignore_errors=True)
        self.path = Path(tempfile.mkdtemp(prefix=_PREFIX))
        self._descriptor = _lock(self.path)  # as long as this process lives
        atexit.register(self.remove)

    def remove(self) -> None:
        """Removes it; may be called twice."""
        atexit.unregister(self.remove)
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1
        shutil.rmtree(self.path, ignore_errors=True)


def _lock(folder: Path) -> int:
    """Locks a folder until this process ends or closes what is returned.

    Raises:
        OSError: Another process has locked it.
    """
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(descriptor)
        raise
    return descriptor
