"""Libraries of PyPI that the Debian packages bring along, in a folder that only we import from.

pip installs what the apt packages of this machine lack, one catkin package after the other, into a
virtual environment that sees apt's packages and nothing else. What an installation adds belongs to
that package.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Dict, List, Sequence, Set

_APT = "/usr/lib/python3/dist-packages"
# What the libraries need of apt, and their licences. Run by the environment's Python, whose pip
# reads requirements.
_INSPECT = f"""
import importlib.metadata as metadata, json, sys
from pip._vendor.packaging.requirements import Requirement

def plain(name):
    return name.lower().replace("_", "-")

folder, found, apt = sys.argv[1], [], set()
for one in metadata.distributions(path=[folder]):
    for text in one.requires or ():
        needed = Requirement(text)
        if needed.marker and not needed.marker.evaluate({{"extra": ""}}):
            continue
        for other in metadata.distributions(name=needed.name, path=[{_APT!r}]):
            if not list(metadata.distributions(name=needed.name, path=[folder])):
                apt.add(str(other._path))
    name, about = one.metadata["Name"], one.metadata
    license = about.get("License-Expression") or (about.get("License") or "").split("\\n")[0]
    classifiers = [text for text in about.get_all("Classifier", []) if text[:7] == "License"]
    license = license or (classifiers and classifiers[0].split(" :: ")[-1]) or "unknown"
    found.append((plain(name), one.version, license.strip()))
print(json.dumps([sorted(found), sorted(apt)]))
"""


class LibraryError(Exception):
    """The libraries cannot be installed; the message has what was said."""


@dataclass(frozen=True)
class Libraries:
    """The libraries that a package brings along.

    Attributes:
        folder: Has the files, as a folder ``site-packages`` has them.
        licences: Name and version of each library, with its licence.
        depends: The apt packages that the libraries import.
        binary: Whether files among them are of a processor and a version of Python.
    """

    folder: Path
    licences: Dict[str, str]
    depends: List[str]
    binary: bool


def read_requirements(file: Path) -> Dict[str, str]:
    """Returns the lines of a file of requirements, by the name of the library.

    Args:
        file: As ``pip install -r`` reads it, without options.
    """
    lines = re.findall(r"^(\w[\w-]*)(.*)$", file.read_text(), re.MULTILINE)
    return {name: name + limits.strip() for name, limits in lines}


class Environment:
    """A virtual environment into which libraries are installed, package after package."""

    def __init__(self, folder: Path) -> None:
        """Makes the environment.

        Args:
            folder: Where; what is there is removed.
        """
        _run(["/usr/bin/python3", "-m", "venv", "--clear", str(folder)])
        self._python = str(folder / "bin" / "python")
        (self._site,) = folder.glob("lib/python3*/site-packages")
        (self._site / "apt.pth").write_text(_APT + "\n")
        self._known = _files(self._site)

    def install(self, requirements: Sequence[str], folder: Path) -> Libraries:
        """Installs what apt lacks, and copies what is new.

        Args:
            requirements: Libraries with limits of their versions.
            folder: Where the copies go; it is made if there are some.

        Raises:
            LibraryError: pip failed.
        """
        if requirements:
            _run([self._python, "-m", "pip", "install", "--quiet", "--no-compile", *requirements])
        new = _files(self._site) - self._known
        self._known |= new
        for name in sorted(new):
            target = folder / name
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(self._site / name, target)
            target.chmod(0o644)  # rosrun and completion look for executables
        licences, metadata = json.loads(_run([self._python, "-c", _INSPECT, str(folder)]))
        return Libraries(
            folder,
            {f"{name} {version}": licence for name, version, licence in licences},
            sorted({_run(["dpkg", "-S", path]).split(":")[0] for path in metadata}),
            any(".so" in Path(name).suffixes for name in new),
        )


def _files(folder: Path) -> Set[str]:
    return {
        str(file.relative_to(folder))
        for file in folder.rglob("*")
        if file.is_file() and "__pycache__" not in file.parts
    }


def _run(command: Sequence[str]) -> str:
    ended = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603
    if ended.returncode:
        raise LibraryError(f"{' '.join(command[:4])} failed: {ended.stdout}{ended.stderr}")
    return ended.stdout
