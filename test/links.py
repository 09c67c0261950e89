"""Looks whether what the documents point to is there, and whether their lines are short.

That is: relative links and their headings, files and modules in commands and in backticks, and the
documents that code cites. ``.venv/bin/python test/links.py`` prints what is missing, and has the
exit status 1 then; it needs neither ROS nor a build. Names with ``my_`` are the reader's own.
"""

from __future__ import annotations

import functools
import re
import shlex
import sys
from pathlib import Path
from typing import Dict, Iterator, List
from urllib.parse import unquote

from readmes import ROOT, Piece, documents, prose, sections

_LINK = re.compile(r"\[[^\]]*\]\(<?([^)\s>]+)>?[^)]*\)")
_URL = re.compile(r"[a-z]+:")
_FIND = re.compile(r"\$\((?:rospack )?find (\w+)\)")
_SET = re.compile(r"([A-Z]+)=(\S+)")
_MODULE = re.compile(r"^(?:from|import) (ros\w+(?:\.\w+)*)", re.MULTILINE)
_OURS = re.compile(r"roso?clingo\w*")
_GENERATED = {"msg", "srv"}  # modules that catkin makes
_SOURCES = {".cfg", ".js", ".launch", ".lp", ".msg", ".py", ".rostest", ".srv", ".txt", ".yaml"}
_CITED = re.compile(r'(?<![*/\w])([\w./-]+\.md)\b(?:, section "([^"]+)")?')
_NAME = re.compile(
    r"`((?!my_)[a-z0-9_.][\w./-]*\.(?:action|launch|lp|md|msg|pgm|py|rostest|rviz|srv|world|xml|yaml))`"
)
_FOLDERS = {"rosrun": "nodes", "roslaunch": "launch", "rostest": "test"}
_LONGEST = 120  # characters of a line
_ROOT = "{root}"  # in a command; a topic may begin like the repository's real path


def broken(root: Path = ROOT) -> List[str]:
    """Returns what is wrong in the documents below a folder, and with what code cites of them."""
    for remembered in (_all_files, anchors, _headings):
        remembered.cache_clear()  # a test may have changed the files
    found = []
    for name in documents(root):
        file = root / name
        found += [f"{name}: {reason}" for reason in _of_document(file, root)]
    for folder in [*_packages(root), root / "test", root / "scripts", root / "benchmarks"]:
        for file in sorted(folder.rglob("*")):
            is_source = file.suffix in _SOURCES or folder.name == "scripts"
            if is_source and file.name != "test_links.py":  # which cites what there is not
                name = file.relative_to(root)
                found += [f"{name}: {reason}" for reason in _of_source(file, folder, root)]
    return found


def _packages(root: Path) -> List[Path]:
    return sorted(file.parent for file in root.glob("*/package.xml"))


def _of_document(file: Path, root: Path) -> Iterator[str]:
    for number, line in enumerate(file.read_text().splitlines(), 1):
        if len(line) > _LONGEST:
            yield f"line {number} has {len(line)} characters, more than {_LONGEST}"
    text = prose(str(file))
    for link in _LINK.findall(re.sub(r"`[^`]*`", "", text)):
        if not _URL.match(link):
            yield from _of_link(unquote(link), file)
    for name in _NAME.findall(text):
        if not (root / name).exists() and not _has_file(name, root):
            yield f"there is no file {name}"
    variables: Dict[str, str] = {}
    for _, pieces in sections(str(file)):
        for piece in pieces:
            if piece.kind in ("command", "variable", "xml"):
                yield from _of_command(piece, variables, root)
            elif piece.kind == "python":
                yield from _of_modules(_MODULE.findall(piece.text), root)


def _has_file(name: str, root: Path) -> bool:
    """Returns whether the repository has a file whose path ends with a name."""
    return any(path.endswith(f"/{name}") for path in _all_files(root))


@functools.lru_cache(maxsize=None)
def _all_files(root: Path) -> List[str]:
    folders = [*_packages(root), *(root / name for name in ("benchmarks", "docs", "test"))]
    return [str(file) for folder in folders for file in folder.rglob("*")]


def _of_link(link: str, file: Path) -> Iterator[str]:
    path, _, anchor = link.partition("#")
    target = file.parent / path if path else file
    if not target.exists():
        yield f"the link {link} leads to no file"
    elif anchor and (target.suffix != ".md" or anchor not in anchors(target)):
        yield f"the link {link} leads to no heading"


@functools.lru_cache(maxsize=None)
def anchors(file: Path) -> List[str]:
    """Returns the anchors of a document's headings, as GitHub makes them."""
    found: List[str] = []
    for heading, _ in sections(str(file)):
        anchor = re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
        again = sum(re.fullmatch(rf"{anchor}(-\d+)?", other) is not None for other in found)
        found.append(f"{anchor}-{again}" if again else anchor)
    return found


def _of_command(piece: Piece, variables: Dict[str, str], root: Path) -> Iterator[str]:
    text = _FIND.sub(lambda found: _folder(found[1]), piece.text)
    for name, value in variables.items():
        text = re.sub(rf"\${name}\b", value, text)
    if piece.kind == "variable":
        variables.update(_SET.findall(text))
    words = _paths(text) if piece.kind == "xml" else shlex.split(text, comments=True)
    for place, word in enumerate(words):
        rest = [other for other in words[place + 1 :] if not other.startswith("-")]
        if word in _FOLDERS and len(rest) > 1 and _OURS.fullmatch(rest[0]):
            if not any((root / rest[0] / _FOLDERS[word]).rglob(rest[1])):
                yield f"`{piece.text}`: {rest[0]} has no {_FOLDERS[word]}/{rest[1]}"
        elif word == "-m" and rest and _OURS.match(rest[0]):
            yield from _of_modules(rest[:1], root)
        elif not _is_there(word, root):
            yield f"`{piece.text}`: there is no {word}"


def _folder(package: str) -> str:
    return f"{_ROOT}/{package}" if _OURS.fullmatch(package) else f"/{package}"


def _paths(xml: str) -> List[str]:
    return re.findall(r"[^\s\"'=]+", xml)


def _is_there(word: str, root: Path) -> bool:
    """Whether a word of a command is no path into the repository, or one that is there.

    A file of a package may lack ``.lp``, as in the manual.
    """
    script = re.fullmatch(r"(?:.*/)?(scripts/[\w-]+)", word)
    path = (script[1] if script else word).partition("::")[0]
    if path.startswith(f"{_ROOT}/"):
        file = path.replace(_ROOT, str(root), 1)
        return Path(file).exists() or Path(f"{file}.lp").exists()
    first, slash, _ = path.partition("/")
    is_type = re.fullmatch(r"\w+/[A-Z]\w+", path)  # of a message
    if is_type or not (first and slash and (root / first).is_dir()) or first.startswith("."):
        return True
    return any(root.glob(path))


def _of_modules(names: List[str], root: Path) -> Iterator[str]:
    for name in names:
        package, *rest = name.split(".")
        if not _OURS.fullmatch(package) or _GENERATED.intersection(rest):
            continue
        path = root.joinpath(package, "src", package, *rest)
        if not (path.with_suffix(".py").exists() or (path / "__init__.py").exists()):
            yield f"there is no module {name}"


def _of_source(file: Path, package: Path, root: Path) -> Iterator[str]:
    """Yields the documents and their sections that a comment or docstring cites wrongly."""
    text = re.sub(r"\s+(?:[#%*]+ )?", " ", file.read_text())
    for name, heading in _CITED.findall(text):
        places = (root / name, package / name, file.parent / name)
        target = next((place for place in places if place.exists()), None)
        if target is None:
            yield f"it cites {name}, which there is not"
        elif heading and heading not in _headings(target):
            yield f'{name} has no section "{heading}"'


@functools.lru_cache(maxsize=None)
def _headings(file: Path) -> List[str]:
    return [title for title, _ in sections(str(file))]


if __name__ == "__main__":
    wrong = broken()
    print("\n".join(wrong) or "the documents are well")
    sys.exit(1 if wrong else 0)
