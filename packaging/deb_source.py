"""Writes Debian source packages, one for each catkin package: ``scripts/package`` builds them.

    /usr/bin/python3 packaging/deb_source.py --codename trixie --revision 1 FOLDER

Each folder below FOLDER then has a copy of a catkin package, a folder ``debian``, and the libraries
that it brings along. The order in which they are written is printed; any order builds.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import sys
import textwrap
import time
from email.utils import formatdate
from pathlib import Path
from typing import Dict, List

from catkin_pkg.package import Package
from catkin_pkg.topological_order import topological_order

from deb_libraries import Environment, Libraries, LibraryError, read_requirements
from deb_names import (
    CYTHON,
    LIBRARY_KEYS,
    System,
    UnknownKeyError,
    apt_names,
    deb_name,
    recommended,
)

ROOT = Path(__file__).resolve().parents[1]
_ABOUT = "Of ROSoClingo, by which robots that run ROS plan with the answer-set solver clingo. "
_TEMPLATES = Path(__file__).resolve().parent / "debian"


class SourcePackage:
    """A catkin package that becomes a Debian package.

    Attributes:
        package: Its package.xml.
        name: Name of the Debian package.
    """

    def __init__(self, package: Package, ours: List[str], system: System, version: str) -> None:
        """Looks up names.

        Args:
            package: The package.xml, read.
            ours: Names of all catkin packages that are built together.
            system: Where it is to be installed.
            version: Version of the Debian packages.
        """
        self.package = package
        self.name = deb_name(package.name, system)
        self._ours = ours
        self._system = system
        self._version = version

    def build_depends(self) -> List[str]:
        """Returns what building needs, beside debhelper.

        Raises:
            UnknownKeyError: The package.xml names something unknown.
        """
        package = self.package
        return self._names(package.build_depends + package.buildtool_depends, build=True)

    def depends(self, libraries: Libraries) -> List[str]:
        """Returns what running needs.

        Args:
            libraries: What the package brings along.

        Raises:
            UnknownKeyError: The package.xml names something unknown.
        """
        names = self._names(self.package.exec_depends + self.package.build_export_depends)
        names += [name for name in libraries.depends if name not in names]
        if self._is_binary(libraries):
            major, minor = sys.version_info[:2]
            names += [f"python3 (>= {major}.{minor}~)", f"python3 (<< {major}.{minor + 1})"]
            names += ["libc6", "libgcc-s1", "libstdc++6"]
        else:
            names.append("python3")
        return names

    def _is_binary(self, libraries: Libraries) -> bool:
        compiled = any(depend.name == CYTHON for depend in self.package.build_depends)
        return compiled or libraries.binary

    def _names(self, depends: List[object], *, build: bool = False) -> List[str]:
        names: List[str] = []
        for key in dict.fromkeys(str(getattr(depend, "name", depend)) for depend in depends):
            if key in self._ours:
                names.append(f"{deb_name(key, self._system)} (= {self._version})")
            else:
                names += apt_names(key, self._system, build=build)
        return sorted(set(names))

    def write(self, folder: Path, libraries: Libraries, codename: str) -> None:
        """Writes the folder ``debian`` of the source package.

        Args:
            folder: A copy of the catkin package.
            libraries: What the package brings along.
            codename: The release of the distribution.
        """
        package = self.package
        about = textwrap.wrap(_ABOUT + package.description, 78)
        filled = {
            "name": self.name,
            "package": package.name,
            "version": self._version,
            "codename": codename,
            "maintainer": f"{package.maintainers[0].name} <{package.maintainers[0].email}>",
            "homepage": package.urls[0].url,
            "architecture": "any" if self._is_binary(libraries) else "all",
            "compat": "12" if self._system is System.NOETIC else "13",
            "build_depends": ", ".join(self.build_depends()),
            "depends": ", ".join(self.depends(libraries)),
            "recommends": ", ".join(recommended(package.name, self._system)),
            "summary": summary(package.description),
            "description": "\n".join(f" {line}" for line in about),
            "prefix": self._system.value,
            "licences": "\n".join(f"  {name}: {text}" for name, text in libraries.licences.items()),
            "date": formatdate(float(os.environ.get("SOURCE_DATE_EPOCH", time.time()))),
            "libraries": str(libraries.folder),
        }
        debian = folder / "debian"
        (debian / "source").mkdir(parents=True)
        (debian / "source" / "format").write_text("3.0 (native)\n")
        for file in sorted(_TEMPLATES.iterdir()):
            text = file.read_text()
            for field, value in filled.items():
                text = text.replace(f"@{field}@", value)
            lines = [line for line in text.splitlines(True) if not line.endswith(": \n")]
            (debian / file.name.replace("PACKAGE", self.name)).write_text("".join(lines))
        (debian / "rules").chmod(0o755)


def summary(description: str) -> str:
    """Returns the short description of a Debian package: no sentence, and at most 79 characters.

    Args:
        description: That of the package.xml.
    """
    text = description.partition(": ")[0].rstrip(".")
    while len(text) > 79:
        text = text.rpartition(", ")[0]
    text = re.sub("^(A|An|The) ", "", text)
    return text[0].lower() + text[1:]


def requirements_of(package: Package, requirements: Dict[str, str]) -> List[str]:
    """Returns the libraries of PyPI that a package.xml names, with limits of their versions.

    Args:
        package: The package.xml, read.
        requirements: The lines of requirements.txt by library.
    """
    keys = {depend.name for depend in package.exec_depends}
    return [line for name, line in requirements.items() if LIBRARY_KEYS[name] in keys]


def write_all(folder: Path, codename: str, revision: int) -> None:
    """Writes the source packages of all catkin packages of this repository.

    Args:
        folder: Where; each is a folder of the Debian package's name.
        codename: The release of the distribution, such as ``trixie``.
        revision: Distinguishes builds of a version; a later one is higher.

    Raises:
        UnknownKeyError: A package.xml names something unknown.
        LibraryError: A library cannot be installed.
    """
    system = System.NOETIC if codename == "focal" else System.DEBIAN
    requirements = read_requirements(ROOT / "requirements.txt")
    environment = Environment(folder / "environment")
    packages = [(path, package) for path, package in topological_order(str(ROOT)) if path != "."]
    ours = [package.name for _, package in packages]
    for path, package in packages:
        version = f"{package.version}-{revision}{codename}"
        source = SourcePackage(package, ours, system, version)
        target = folder / source.name
        shutil.copytree(ROOT / path, target, ignore=shutil.ignore_patterns("__pycache__", "*.pyc"))
        libraries = environment.install(
            requirements_of(package, requirements), folder / "libraries" / package.name
        )
        source.write(target, libraries, codename)
        print(target)


def main() -> None:
    """Runs the command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--codename", required=True)
    parser.add_argument("--revision", required=True, type=int)
    parser.add_argument("folder", type=Path)
    arguments = parser.parse_args()
    try:
        write_all(arguments.folder.resolve(), arguments.codename, arguments.revision)
    except (UnknownKeyError, LibraryError) as err:
        sys.exit(f"deb_source.py: {err}")


if __name__ == "__main__":
    main()
