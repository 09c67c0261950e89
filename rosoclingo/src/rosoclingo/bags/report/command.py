"""Shows a recorded run as an HTML page and as a picture. Needs no ROS."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import NoReturn, Optional, Sequence

from rosclingo.errors import RosclingoError
from rosclingo.terminal import lines, say
from rosoclingo.bags.read.reader import read_recording
from rosoclingo.bags.report.page import render
from rosoclingo.bags.report.statistics import compute
from rosoclingo.drawing.errors import picture_errors


def main(arguments: Optional[Sequence[str]] = None) -> NoReturn:
    """Writes the report and ends the process.

    Args:
        arguments: The command line without the program's name; by default that of the process.

    The exit status is 0, or 2 if the bag cannot be read or the report cannot be written.
    """
    parser = argparse.ArgumentParser(
        prog="report.py",
        description="Shows a recorded run as an HTML page, and as a picture.",
        allow_abbrev=False,
    )
    parser.add_argument("bag", type=Path, metavar="BAG", help="what record.py has written")
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="FILE.html",
        help="the page; by default next to the bag",
    )
    parser.add_argument("--png", type=Path, metavar="FILE.png", help="also draw a picture")
    parser.add_argument("--name", metavar="NODE", help="which rosoclingo, if the bag has several")
    chosen = parser.parse_args(arguments)
    try:
        _report(
            chosen.bag, chosen.output or chosen.bag.with_suffix(".html"), chosen.png, chosen.name
        )
    except (RosclingoError, OSError) as err:
        say("report.py", str(err))
        sys.exit(2)
    except Exception as err:  # a bag is anybody's, and 1 is not among the exit statuses
        say("report.py", f"{chosen.bag}: internal error: {err!r}")
        sys.exit(2)
    sys.exit(0)


def _report(bag: Path, page: Path, picture: Optional[Path], name: Optional[str]) -> None:
    recording = read_recording(bag, name)
    statistics = compute(recording)
    for remark in recording.remarks:
        say("report.py", f"{bag}: {remark}")
    page.write_text(render(recording, statistics, bag), encoding="utf-8")
    print(lines(f"wrote {page}"))
    if picture is not None:
        with picture_errors(picture):
            # It takes a second, and who wants no picture need not have matplotlib.
            from rosoclingo.bags.report.picture import draw  # noqa: PLC0415 (see above)

            draw(statistics, f"{bag.name}: {recording.name}", picture)
        print(lines(f"wrote {picture}"))
