"""The report as one HTML page that needs nothing else. Needs no ROS."""

from __future__ import annotations

import base64
import dataclasses
import hashlib
import json
import math
import re
import shlex
from collections import Counter
from pathlib import Path
from typing import Any, Dict, List, Sequence, Tuple

from rosoclingo.bags.model import Recording
from rosoclingo.bags.report.rows import COLOURS, LEGEND, Lane, charts, rows
from rosoclingo.bags.report.run import Statistics
from rosoclingo.drawing import SHARED_FILES

_FOLDER = Path(__file__).resolve().parent / "html"
_SCRIPTS = (  # each after those that it imports
    *(SHARED_FILES / name for name in ("elements.js", "times.js", "lanes.js")),
    *(_FOLDER / name for name in ("data.js", "timeline.js", "tables.js")),
)
_STYLES = (SHARED_FILES / "base.css", SHARED_FILES / "lanes.css", _FOLDER / "page.css")
_MODULE = re.compile(r"^(?:import [^;]*;\n|export )", re.MULTILINE)
_HASH_DIGITS = 8  # of a file's SHA-256
_DECIMALS = 4  # of seconds
_MARK = re.compile("@([A-Z_]+)@")


def render(recording: Recording, statistics: Statistics, file: Path) -> str:
    """Returns the page.

    What comes from the bag stands in it only as JSON without any of HTML's special characters, and
    its policy lets nothing run but its own script.

    Args:
        recording: What was recorded.
        statistics: What happened in it.
        file: The bag.
    """
    style = _joined(_STYLES)
    script = _MODULE.sub("", _joined(_SCRIPTS))  # what they import is in the same script
    parts = {
        "STYLE": style,
        "STYLE_HASH": _digest(style),
        "SCRIPT": script,
        "SCRIPT_HASH": _digest(script),
        "DATA": _embedded(data(recording, statistics, file)),
    }
    return _MARK.sub(lambda match: parts[match.group(1)], _joined([_FOLDER / "page.html"]))


def data(recording: Recording, statistics: Statistics, file: Path) -> Dict[str, Any]:
    """Returns the data that the page's script draws, as JSON can hold it.

    Args:
        recording: What was recorded.
        statistics: What happened in it.
        file: The bag.
    """
    tables = {
        name: _table(getattr(statistics, name))
        for name in (
            "goals",
            "actions",
            "messages",
            "searches",
            "changes",
            "answers",
            "restarts",
            "holds",
            "beliefs",
        )
    }
    return {
        "title": file.name,
        "subtitle": f"a run of {recording.name}",
        "remarks": list(recording.remarks),
        "figures": [list(figure) for figure in figures(recording, statistics)],
        "programs": _programs(recording),
        "began": round(statistics.began, _DECIMALS),
        "ended": round(statistics.ended, _DECIMALS),
        "until": round(statistics.until, _DECIMALS),
        **tables,
        "actions": _table((*statistics.actions, *statistics.planned)),
        "lanes": [_lane(row) for row in rows(statistics)],
        "charts": [_named(chart) for chart in charts(statistics)],
        "steps": [_plain(step.began) for step in statistics.steps],
        "legend": LEGEND,
        "colours": COLOURS,
    }


def figures(recording: Recording, statistics: Statistics) -> List[Tuple[str, str, str]]:
    """Returns the key figures: for each its name, its value, and a remark."""
    run = statistics
    seconds = [search.duration for search in run.searches]
    answers = Counter(action.answer for action in run.actions)
    dropped = sum(bool(message.dropped) for message in run.messages)
    interrupted = sum(step.interrupted for step in run.steps)
    restarts = Counter(one.node for one in run.restarts)
    outcomes = Counter(goal.outcome for goal in run.goals)
    kind = "with a journal" if recording.has_journal else "without a journal: made from the topics"
    return [
        ("duration", _duration(run.ended - run.began), run.end and f"the loop ended: {run.end}"),
        ("goals", str(len(run.goals)), _counts(outcomes)),
        (
            "steps",
            str(max(0, len(run.steps) - 1)),
            f"planned up to step {max((step.horizon for step in run.steps), default=0)}",
        ),
        (
            "actions",
            str(len(run.actions)),
            f"{answers['failure']} failed, {answers['']} without an answer",
        ),
        ("plans", str(run.plans), f"{len(run.changes)} changed what was planned"),
        (
            "searches",
            str(len(seconds)),
            f"{sum(seconds):.3g} s together, {max(seconds, default=0):.3g} s the longest, "
            f"{interrupted} interrupted",
        ),
        ("messages", str(run.received), f"{dropped} dropped"),
        *([("restarts", str(len(run.restarts)), _counts(restarts))] if restarts else []),
        ("bag", _size(recording.size), f"{len(recording.entries)} events, {kind}"),
    ]


def _programs(recording: Recording) -> List[Dict[str, Any]]:
    return [
        {
            "node": program.node,
            "role": _role(recording, program.node),
            "command": shlex.join(
                [
                    *("rosrun", *program.program.split(), *program.arguments),
                    *(
                        f"_{name}:={json.dumps(value)}"
                        for name, value in program.parameters.items()
                    ),
                ]
            ),
            "files": [[path, sha[:_HASH_DIGITS]] for path, sha in program.digests().items()],
            "versions": ", ".join(f"{name} {text}" for name, text in program.versions.items()),
        }
        for program in recording.programs.values()
    ]


def _role(recording: Recording, node: str) -> str:
    """Returns the role of a node in the planning loop, such as ``controller``."""
    loop = recording.programs.get(recording.name)
    solvers = loop.solvers if loop is not None else {}
    return next((role for role, name in solvers.items() if name == node), "")


def _table(rows: Sequence[Any]) -> Dict[str, Any]:
    """Returns values of one class as a table: their attributes' names need to stand there once."""
    names = [field.name for field in dataclasses.fields(rows[0])] if rows else []
    return {"names": names, "rows": [_plain(row) for row in rows]}


def _lane(row: Lane) -> Dict[str, Any]:
    """Returns a row with numbers of colours, since it may have many bars."""
    numbers = {name: number for number, name in enumerate(COLOURS)}
    return {
        **_named(row),
        "bars": [[*_plain(bar[:-1]), numbers.get(bar.colour, numbers["none"])] for bar in row.bars],
    }


def _named(value: Any) -> Dict[str, Any]:
    return {name: _plain(part) for name, part in value._asdict().items()}


def _plain(value: Any) -> Any:
    if dataclasses.is_dataclass(value):
        return [_plain(getattr(value, field.name)) for field in dataclasses.fields(value)]
    if isinstance(value, (list, tuple)):
        return [_plain(part) for part in value]
    if isinstance(value, float):
        return round(value, _DECIMALS) if math.isfinite(value) else 0.0  # JSON has no other
    return value


def _embedded(value: Any) -> str:
    """Returns JSON that is safe inside of a script element, whatever is in its texts."""
    text = json.dumps(value, separators=(",", ":"))  # and so in ASCII
    return text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e")


def _digest(text: str) -> str:
    return base64.b64encode(hashlib.sha256(text.encode("utf-8")).digest()).decode("ascii")


def _joined(files: Sequence[Path]) -> str:
    return "\n".join(file.read_text(encoding="utf-8") for file in files)


def _counts(numbers: Counter[str]) -> str:
    return ", ".join(f"{number} {word}" for word, number in numbers.most_common())


def _duration(seconds: float) -> str:
    minutes, rest = divmod(seconds, 60)
    hours, minutes = divmod(int(minutes), 60)
    if hours:
        return f"{hours} h {minutes} min"
    return f"{minutes} min {rest:.0f} s" if minutes else f"{rest:.1f} s"


def _size(size: int) -> str:
    if size < 1024:
        return f"{size} B"
    return f"{size / 1024:.1f} KiB" if size < 1024**2 else f"{size / 1024**2:.1f} MiB"
