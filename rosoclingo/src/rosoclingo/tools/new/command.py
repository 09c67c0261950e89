"""Writes a package for a robot of one's own: the command ``new.py``."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import NoReturn, Optional, Sequence

from rosclingo.errors import RosclingoError
from rosclingo.terminal import say
from rosoclingo.tools.new.package import write

_PROGRAM = "new.py"
_EPILOG = """\
The package is complete: it builds, runs, and passes its test. Its README.md says what to change.
Exit status: 0, or 2 if the package cannot be written; then nothing is."""


def main(arguments: Optional[Sequence[str]] = None) -> NoReturn:
    """Runs the command and ends the process.

    Args:
        arguments: The command line without the program's name; by default that of the process.

    The exit status is 0, 2 if the package cannot be written, or 130 after Ctrl-C.
    """
    parser = argparse.ArgumentParser(
        prog=_PROGRAM,
        description="Writes a package for a robot of your own, that plans with clingo.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("name", metavar="NAME", help="the package's name, such as my_robot")
    parser.add_argument("--folder", type=Path, default=Path(), metavar="DIR",
        help="where its folder is made, such as src of a workspace; by default here")  # fmt: skip
    chosen = parser.parse_args(arguments)
    package = chosen.folder.expanduser() / chosen.name
    try:
        files = write(chosen.name, package.parent)
    except RosclingoError as err:
        say(_PROGRAM, str(err))
        sys.exit(2)
    except KeyboardInterrupt:
        sys.exit(130)
    print(f"wrote {package}:")
    for file in files:
        print(f"    {file}")
    print("what to do next is in", package / "README.md")
    sys.exit(0)
