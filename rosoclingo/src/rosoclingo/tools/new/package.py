"""The files of a package for a robot of one's own, made of the folder ``template``.

A file of the template ends in ``.in``, which the file of the package does not. ``@name@`` in it is
the package's name, and ``@line@`` the line above and below the title of a change log, as with
CMake's ``configure_file``.
"""

from __future__ import annotations

import re
import shutil
import string
from pathlib import Path
from typing import Dict, Iterator, List, Optional

from rosclingo.errors import RosclingoError
from rosclingo.solver.options import Options, parse_options
from rosoclingo.in_process.inputs import read_input
from rosoclingo.in_process.parts import find_mode, make_parts
from rosoclingo.in_process.shared import shared
from rosoclingo.in_process.simulation import SimulatedSystem
from rosoclingo.tools.plan.bag import write_bag

ENCODING = "encoding/robot.lp"
"""The planner's encoding, in a package."""

LIBRARY = "rosoclingo_aspprograms", "lib/actions.lp"
"""The package of the library that plans with the encoding, and the library's path in it."""

BAG = "test/visits.bag"
"""The run that the package's test replays."""

_NAME = re.compile(r"[a-z][a-z0-9_]+", re.ASCII)
_SUFFIX = ".in"
_MANIFEST = "package.xml"

# The run in the bag, and what the launch file starts. All its plans are the only shortest ones, so
# that another version of clingo finds them, too.
_MODE = "dynamic.incremental.dyn_reset"
_MODE_OPTIONS = ("-c", "steps=20", "-c", "r=5")
_RUN = [("0", "goal:visit(kitchen)"), ("2", "goal:visit(dock)")]


class PackageError(RosclingoError):
    """A package cannot be written; the message says why and what to do."""


class _Text(string.Template):
    """A text with ``@placeholder@``."""

    pattern = r"@(?:(?P<named>[a-z]+)@|(?P<escaped>(?!))|(?P<braced>(?!))|(?P<invalid>(?!)))"  # type: ignore[assignment] # the base class has it compiled


def render(name: str) -> Dict[str, str]:
    """Returns the texts of a package's files by their paths in it, without the bag."""
    title = f"Changelog for package {name}"
    values = {"name": name, "line": "^" * len(title)}
    template = shared() / "template"
    return {
        file.relative_to(template).as_posix()[: -len(_SUFFIX)]: _Text(
            file.read_text(encoding="utf-8")
        ).substitute(values)
        for file in sorted(template.rglob(f"*{_SUFFIX}"))
    }


def write(name: str, folder: Path) -> List[str]:
    """Writes a package into a folder of its name, which is removed if that fails.

    Args:
        name: Name of the package.
        folder: Where the package's folder is made, such as ``src`` of a workspace.

    Returns:
        The paths of its files in it.

    Raises:
        PackageError: The name is none for a package or taken, or the folder is not good for one.
    """
    _check_name(name)
    package = folder / name
    _check_place(package)
    files = render(name)
    find_library()
    try:
        package.mkdir()
    except OSError as err:
        raise _refused(package, err) from err
    try:
        for path, text in files.items():
            file = package / path
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text, encoding="utf-8")
            if text.startswith("#!"):
                file.chmod(file.stat().st_mode | 0o111)
        _simulate(package)
    except BaseException as err:
        shutil.rmtree(package)
        if isinstance(err, OSError):
            raise _refused(package, err) from err
        raise
    return sorted([*files, BAG])


def _simulate(package: Path) -> None:
    """Simulates the run that the test is to replay."""
    planner = Options((find_library(), str((package / ENCODING).resolve())))
    parts = make_parts(_MODE, planner, _MODE_OPTIONS)
    run = SimulatedSystem(parts.loop, [read_input(text, step) for step, text in _RUN])
    failure = run.run()
    if failure is not None:
        raise failure
    controller = parse_options(["-f", find_mode(_MODE), *_MODE_OPTIONS])
    solvers = {"controller": controller, "planner": planner}
    write_bag(package / BAG, run, solvers)


def find_library() -> str:
    """Returns the path of the library, in the package beside this one, or where ROS has it.

    Raises:
        PackageError: It is not there.
    """
    name, file = LIBRARY
    for folder in (str(shared().resolve().parent / name), *_packages(name)):
        if Path(folder, file).is_file():
            return str(Path(folder, file))
    raise PackageError(
        f"there is no {file} of the package {name}, with which the encoding plans; install that "
        "package, or source a workspace that has it"
    )


def _check_name(name: str) -> None:
    if not _NAME.fullmatch(name):
        better = re.sub(r"\W|[^\x00-\x7f]", "_", name.strip().lower()).strip("_")
        hint = f"; did you mean {better!r}?" if _NAME.fullmatch(better) else ", such as my_robot"
        raise PackageError(
            f"{name!r} is no name of a ROS package: it needs a lower-case letter, and after it "
            f"lower-case letters, digits or underscores, at least one{hint}"
        )
    taken = next(_packages(name), None)
    if taken is not None:
        raise PackageError(
            f"there is a package {name} already, in {taken}: catkin builds no two of a name; "
            "choose another one"
        )


def _packages(name: str) -> Iterator[str]:
    """Yields where ROS has a package of a name, if ROS is there."""
    try:
        import rospkg  # noqa: PLC0415 (it is ROS's)
    except ImportError:
        return
    try:
        yield rospkg.RosPack().get_path(name)
    except rospkg.ResourceNotFound:
        return


def _check_place(package: Path) -> None:
    folder = package.parent
    if not folder.is_dir():
        raise PackageError(
            f"there is no folder {folder}; make it with mkdir -p {folder}, or name another one "
            "with --folder"
        )
    if package.exists() or package.is_symlink():
        raise PackageError(
            f"{package} exists already, and nothing in it was changed; choose another name, or "
            "another folder with --folder"
        )
    outer = _package_around(folder.resolve())
    if outer is not None:
        raise PackageError(
            f"{folder} is in the package {outer}, and catkin looks for none in there; name another "
            "folder with --folder, such as src of your workspace"
        )


def _package_around(folder: Path) -> Optional[Path]:
    return next((one for one in (folder, *folder.parents) if (one / _MANIFEST).is_file()), None)


def _refused(package: Path, err: OSError) -> PackageError:
    return PackageError(
        f"{err.filename or package}: {err.strerror}; name a folder with --folder that can be "
        "written to"
    )
