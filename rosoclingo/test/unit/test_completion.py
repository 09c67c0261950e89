"""Requests and messages of an encoding, read by another process."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import List

from waiting import wait_for

from rosclingo.solver.about import about
from rosclingo.solver.engine import Engine
from rosclingo.solver.options import parse_options
from rosclingo.solver.programs import Program
from rosoclingo.encodings.about import Launched
from rosoclingo.encodings.known import read_encoding


def launched(file: Path) -> Launched:
    """How a planner says that it was started."""
    arguments = ["-f", str(file)]
    engine = Engine(parse_options(arguments))
    said = about("rosclingo run.py", arguments, engine.program)
    return Launched.decode("/planner", said)


def test_hostile_names_of_an_encoding(tmp_path: Path) -> None:
    text = """#program base. rslot(1). text("$(touch x)"; "it's"; "a b").
        #program state(t). #external event(1,say(T),t) : text(T).
        #external event((info;goal),heard(T),t) : text(T). #external event(info,passed,t).
        #program query(t). #external query(t)."""
    file = tmp_path / "hostile.lp"
    file.write_text(text)
    known = read_encoding(launched(file))
    texts = ('"$(touch x)"', '"it\'s"', '"a b"')
    assert set(known.requests) == {f"say({text})" for text in texts}
    assert set(known.messages) == {f"{who}:heard({t})" for t in texts for who in ("info", "(goal)")}


def test_the_process_that_reads_ends_with_whoever_has_started_it(tmp_path: Path) -> None:
    file = tmp_path / "slow.lp"
    file.write_text(
        "a :- X = 1..100000, Y = 1..100000, X*Y < 0.\n#program query(t). #external query(t)."
    )
    program = (
        "import sys; from rosoclingo.encodings.about import Launched\n"
        "from rosoclingo.encodings.known import read_encoding\n"
        "read_encoding(Launched.decode('/planner', sys.argv[1]))"
    )
    loaded = Program(texts={str(file): file.read_text()}, named=[str(file)])
    text = about("rosclingo run.py", ["-f", str(file)], loaded)
    with subprocess.Popen([sys.executable, "-c", program, text]) as reader:
        wait_for(lambda: any(map(grounds, children(reader.pid))))
        (process,) = children(reader.pid)
        reader.kill()
    wait_for(lambda: not grounds(process))


def children(pid: int) -> List[int]:
    """Returns the processes that a process has started."""
    return list(map(int, Path(f"/proc/{pid}/task/{pid}/children").read_text().split()))


def grounds(pid: int) -> bool:
    """Tells if a process runs that reads an encoding, and has its limit."""
    try:
        limits = Path(f"/proc/{pid}/limits").read_text()
        return (
            "encodings.grounding" in Path(f"/proc/{pid}/cmdline").read_text()
            and re.search(r"Max cpu time +60 ", limits) is not None
        )
    except OSError:
        return False
