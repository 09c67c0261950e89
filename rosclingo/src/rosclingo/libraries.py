"""Libraries of PyPI: those that the Debian packages bring along, and those that are optional.

The Debian packages install libraries that apt lacks, such as clingo, in
``lib/rosclingo/site-packages`` below their prefix, where no interpreter looks. Whoever imports
``rosclingo``, or another of our packages, can import them from then on, and no other code finds
them. In a workspace there is no such folder, and nothing happens.
"""

import os
import sys

__all__ = ["add_private_libraries", "install_command"]


def add_private_libraries(module: str = __file__) -> None:
    """Puts the private folder on ``sys.path``, if there is one, before all installed libraries.

    It comes right after the folder of the script, so that neither an older version of apt's nor one
    that the user has installed is taken for ours.

    Args:
        module: A module in the folder ``rosclingo`` of ``lib/python3/dist-packages``.
    """
    prefix = os.path.abspath(module)
    for _ in ("module", "rosclingo", "dist-packages", "python3"):
        prefix = os.path.dirname(prefix)
    folder = os.path.join(prefix, "rosclingo", "site-packages")
    if folder not in sys.path and os.path.isdir(folder):
        sys.path.insert(1, folder)


def install_command(requirement: str) -> str:
    """Returns the command that installs a library for the interpreter that runs.

    Args:
        requirement: The library and its version, as pip takes it.
    """
    # Debian's pip adds to apt's Python only what is forced upon it.
    managed = os.path.join(os.path.dirname(os.__file__), "EXTERNALLY-MANAGED")
    is_apts = sys.prefix == sys.base_prefix and os.path.exists(managed)
    options = " --user --break-system-packages" if is_apts else ""
    return f"{sys.executable} -m pip install '{requirement}'{options}"
