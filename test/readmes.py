"""What the documents print, by section and in order: commands and other blocks."""

from __future__ import annotations

import os
import re
import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import Iterator, List, Tuple

ROOT = Path(__file__).resolve().parents[1]
_NOT_OURS = {"build", "devel", "install", "demo", "site"}  # what building and running leave behind

PROGRAMS = (
    "catkin_create_pkg", "catkin_make", "cd", "chmod", "echo", "export", "git", "kill", "mkdir",
    "pip", "printf", "python", "python3", "rosbag", "roscore", "roslaunch", "rosnode", "rosparam",
    "rosrun", "rosservice", "rostest", "rostopic", "source", "sudo", "touch",
)  # fmt: skip
_COMMAND = re.compile(
    rf"(?:[A-Z_]+=\w+ )*(?:{'|'.join(PROGRAMS)}|[\w./]*/?scripts/[\w-]+|test/bags/\w+"
    r"|\.venv/bin/\w+)(?:\s|$)"
)
_VARIABLE = re.compile(r"[A-Z]+=\$")
_BLOCK = re.compile(r"((?:^\0\w+\n)?(?:^    .*\n(?:\n+(?=    ))?)+)", re.MULTILINE)


@dataclass(frozen=True)
class Piece:
    """One thing that a README prints.

    Attributes:
        kind: ``command``, ``variable``, ``output``, or the language of a block such as ``python``.
        text: Its text, without indentation.
    """

    kind: str
    text: str


def sections(readme: str) -> Iterator[Tuple[str, List[Piece]]]:
    """Yields each heading of a README with what is printed below it."""
    parts = re.split(r"^#+ (.+)$", _with_fences((ROOT / readme).read_text()), flags=re.MULTILINE)
    for heading, text in zip(parts[1::2], parts[2::2]):
        yield heading.strip(), list(_pieces(text))


def documents(root: Path = ROOT) -> List[str]:
    """Returns all Markdown files below a folder, but for what building leaves there."""
    found = []
    for folder, folders, files in os.walk(root):
        left_out = _NOT_OURS if Path(folder) == root else ()
        folders[:] = [name for name in folders if name[0] != "." and name not in left_out]
        found += [os.path.relpath(os.path.join(folder, name), root) for name in files]
    return sorted(name for name in found if name.endswith(".md"))


DOCUMENTS = documents()


def prose(readme: str) -> str:
    """Returns a text without its blocks."""
    return "".join(_BLOCK.split(_with_fences((ROOT / readme).read_text()))[::2])


def section(readme: str, heading: str) -> List[Piece]:
    """Returns what is printed below a heading."""
    return dict(sections(readme))[heading]


def rows(readme: str, heading: str) -> List[List[str]]:
    """Returns the cells of the tables below a heading, without those of the tables' heads."""
    text = re.split(rf"^#+ {re.escape(heading)}$", (ROOT / readme).read_text(), flags=re.M)[1]
    lines = re.split(r"^#+ ", text, flags=re.MULTILINE)[0].splitlines()
    heads = {number - 1 for number, line in enumerate(lines) if line.startswith("|---")}
    return [
        [cell.strip() for cell in line.strip("|").split(" | ")]
        for number, line in enumerate(lines)
        if line.startswith("| ") and number not in heads
    ]


def check_output(readme: str, heading: str, said: str) -> None:
    """Checks that a program has said what a section shows: these lines, in this order.

    There may be other lines between them. What depends on time has a decimal point, so that digits
    around one do not count, and neither do spaces.
    """
    lines = iter([_comparable(line) for line in said.splitlines()])
    shown = [piece.text for piece in section(readme, heading) if piece.kind == "output"]
    assert shown, f"{readme}, {heading}: no output"
    for line in "".join(shown).splitlines():
        assert any(_comparable(line) == other for other in lines), f"{line!r} is not in {said}"


def _comparable(line: str) -> str:
    return " ".join(re.sub(r"-?\d+\.\d+", "#", line).split())


def _with_fences(text: str) -> str:
    """Returns a text whose fenced blocks are indented, with the language in a line before it."""

    def indented(block: re.Match[str]) -> str:
        return f"\0{block[1]}\n" + re.sub("^", "    ", block[2], flags=re.MULTILINE)

    return re.sub(r"^```(\w+)\n(.*?)\n```$", indented, text, flags=re.MULTILINE | re.DOTALL)


def _pieces(text: str) -> Iterator[Piece]:
    for part in _BLOCK.split(text):
        if part.startswith(("\0", "    ")):
            language = part[1 : part.index("\n")] if part.startswith("\0") else ""
            block = re.sub("^    ", "", part.partition("\n")[2] if language else part, flags=re.M)
            yield from [Piece(language, block)] if language else _indented(block)
        else:
            yield from _inline(part)


def _inline(text: str) -> Iterator[Piece]:
    for code in re.findall(r"`([^`]+)`", text):
        line = " ".join(code.split())
        if _VARIABLE.match(line):
            yield Piece("variable", line)
        elif _COMMAND.match(line) and " " in line and not re.fullmatch(r"rosbag \w+", line):
            yield Piece("command", line)


def _indented(block: str) -> Iterator[Piece]:
    if block.startswith("<"):
        yield Piece("xml", block)
    elif block.startswith(("from ", "import ")):
        yield Piece("python", block)
    elif not _is_command(block):
        yield Piece("output", block)
    else:
        lines = block.splitlines()
        while lines:
            line = lines.pop(0)
            while lines and not _is_complete(line):
                line += "\n" + lines.pop(0)
            assert _is_command(line), f"neither a command nor a block of something else: {line}"
            is_variable = _VARIABLE.match(line) or line.startswith("export ")
            yield Piece("variable" if is_variable else "command", re.sub(r"^\$ ", "", line))


def _is_command(line: str) -> bool:
    return bool(_COMMAND.match(line.replace("$ ", "", 1)) or _VARIABLE.match(line))


def _is_complete(line: str) -> bool:
    try:
        shlex.split(line)
    except ValueError:
        return False
    return not line.endswith("\\")


if __name__ == "__main__":
    for name in DOCUMENTS:
        for title, printed in sections(name):
            for piece in printed:
                print(f"{name} | {title} | {piece.kind} | {piece.text}")
