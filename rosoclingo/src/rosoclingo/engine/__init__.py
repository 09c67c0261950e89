"""A search for plans of our own, compiled by Cython, in a process of its own.

The task is in :mod:`.flat`, the process in :mod:`.process` with :mod:`.worker`. The search is in
:mod:`.search`, with :mod:`.states` and :mod:`.relaxation`; :mod:`.improving` finds better plans,
with :mod:`.timing` and :mod:`.regression`. Tasks that count seconds get plans by :mod:`.insertion`,
with :mod:`.chains` and :mod:`.scheduling`. CMake has these nine compiled. Uncompiled, they run as
they are, slowly, and need Cython.
"""

import os
import sys

# The devel space has only compiled modules here, and they go first.
__path__ = [
    folder
    for folder in (os.path.join(path, "engine") for path in sys.modules["rosoclingo"].__path__)
    if os.path.isdir(folder)
]
