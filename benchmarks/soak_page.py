"""Writes the page of a soak: key figures, violations, and pictures of what was watched over time.

One HTML file that needs nothing else, in the style of report.py's pages. Needs no ROS.
"""

from __future__ import annotations

import html
import io
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Sequence, Tuple

from matplotlib import rc_context
from matplotlib.figure import Figure

import rosoclingo.bags.report
from rosoclingo.drawing import SHARED_FILES
from rosoclingo.drawing.canvas import plain
from soak_records import Incident, Violation
from soak_trends import Sample, Trend
from soak_watch import SoakWatch

_STYLES = (
    SHARED_FILES / "base.css",
    SHARED_FILES / "lanes.css",
    Path(rosoclingo.bags.report.__file__).parent / "html" / "page.css",
)
_OWN_STYLE = (
    "svg { width: 100%; height: auto; } tr.wrong td { color: #b42318; } pre { overflow: auto; }"
)
_HOUR = 3600.0
_INCHES = (11.0, 3.6)
_DOTS_PER_INCH = 150  # of what is no line or text
_MOST_ROWS = 200  # of violations, and of points of a line
_MOST_DETAILS = 10  # violations that come with their events
_LINE = "\n"
_NO_VIOLATION = "none"
_NO_METADATA = dict.fromkeys(("Creator", "Date", "Format", "Type"))


class SoakRun(NamedTuple):
    """A run that has ended.

    Attributes:
        seed: Of all draws.
        robots: How many there were.
        began: When, in simulated seconds.
        seconds: How long it lasted, in simulated time.
        wall: The same, in wall time.
        memory: The lines through the memory of the processes.
        latencies: The lines through the latencies.
        machine: What the figures depend on.
    """

    seed: int
    robots: int
    began: float
    seconds: float
    wall: float
    memory: List[Trend]
    latencies: List[Trend]
    machine: Dict[str, str]


def render_soak(run: SoakRun, watch: SoakWatch) -> str:
    """Returns the page.

    Args:
        run: What was measured.
        watch: What was found.
    """
    title = f"Soak with seed {run.seed}"
    style = "\n".join(file.read_text(encoding="utf-8") for file in _STYLES) + _OWN_STYLE
    policy = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'"
    about = ", ".join(f"{key}: {value}" for key, value in run.machine.items())
    sections = [
        _figures(run, watch),
        _section("Violations", _violations(watch.violations, run.began)),
        _section("Events", _draw_incidents(watch.incidents, run)),
        _section("Memory", _draw_memory(watch.memory, run), _trends(run.memory)),
        _section("Latency", _draw_latencies(watch.latencies.samples, run), _trends(run.latencies)),
        _section(
            "Warnings", _table(("what is said", "held against the robots' log"), _warnings(watch))
        ),
        _section("Counts", _table(("event", "count"), sorted(watch.counts.items()))),
    ]
    return f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>{style}</style>
</head>
<body>
<header>
  <h1>{title}</h1>
  <p id="subtitle">{run.robots} robots in the office; {html.escape(about)}</p>
</header>
<main>
{"".join(sections)}
</main>
</body>
</html>
"""


def clock(seconds: float) -> str:
    """Returns a time of a run, such as ``26:03:05``: hours, minutes and seconds."""
    minutes, rest = divmod(int(seconds), 60)
    return f"{minutes // 60}:{minutes % 60:02}:{rest:02}"


def _figures(run: SoakRun, watch: SoakWatch) -> str:
    counts = watch.counts
    ended = sum(counts[word] for word in ("succeeded", "canceled", "aborted", "rejected"))
    figures = [
        ("simulated", clock(run.seconds), f"{run.seconds / max(run.wall, 1):.1f} in a second"),
        ("wall time", clock(run.wall), ""),
        ("goals", str(counts["asked"]), f"{ended} ended, {counts['succeeded']} succeeded"),
        ("violations", str(counts["violation"]), ""),
        ("nodes killed", str(counts["node killed"]), "by SIGKILL"),
        ("nodes ended", str(counts["node interrupted"]), "by SIGINT"),
        ("ways blocked", str(counts["way blocked"]), ""),
        ("actions failed", str(counts["failure of an action"]), ""),
    ]
    boxes = (
        f"<div><span>{name}</span><b>{value}</b><small>{remark}</small></div>"
        for name, value, remark in figures
    )
    return f'<div id="figures">{"".join(boxes)}</div>'


def _section(title: str, *parts: str) -> str:
    return f"<section><h2>{title}</h2>{''.join(parts)}</section>"


def _table(head: Sequence[str], rows: Sequence[Sequence[object]], kind: str = "") -> str:
    heads = "".join(f"<th>{cell}</th>" for cell in head)
    lines = (
        f'<tr class="{kind}">{"".join(f"<td>{html.escape(str(cell))}</td>" for cell in row)}</tr>'
        for row in rows
    )
    return f'<div class="scroll"><table><tr>{heads}</tr>{"".join(lines)}</table></div>'


def _violations(violations: Sequence[Violation], began: float) -> str:
    if not violations:
        return f"<p>{_NO_VIOLATION}</p>"
    rows = [(clock(one.seconds - began), one.text) for one in violations[:_MOST_ROWS]]
    more = len(violations) - len(rows)
    rest = f"<p>and {more} more</p>" if more else ""
    before = "".join(
        f"<details><summary>the journal before {html.escape(one.text)}</summary>"
        f"<pre>{html.escape(_LINE.join(one.events))}</pre></details>"
        for one in violations[:_MOST_DETAILS]
    )
    return _table(("simulated time", "what"), rows, "wrong") + rest + before


def _warnings(watch: SoakWatch) -> List[Tuple[str, int]]:
    """Returns how many warnings were held against the robots' log; false ones are violations."""
    return sorted(watch.alarms.counts.items())


def _trends(trends: Sequence[Trend]) -> str:
    head = ("", "samples", "median", "largest", "an hour", "rise in the run", "limit")
    rows = [
        (
            one.name,
            one.number,
            *(f"{value:.3g} {one.unit}" for value in (one.median, one.largest)),
            *(f"{value:+.3g} {one.unit}" for value in (one.slope, one.rise)),
            f"{one.limit:.3g} {one.unit}" if one.limit else "not judged",
        )
        for one in trends
    ]
    return _table(head, rows)


def _draw_incidents(incidents: Sequence[Incident], run: SoakRun) -> str:
    kinds = sorted({one.kind for one in incidents}, reverse=True)
    figure, axes = _figure("", run)
    figure.set_figheight(0.6 + 0.24 * max(1, len(kinds)))
    for number, kind in enumerate(kinds):
        times = [(one.seconds - run.began) / _HOUR for one in incidents if one.kind == kind]
        colour = "#b42318" if kind == "violation" else "#2f6feb"
        axes.scatter(times, [number] * len(times), marker="|", s=40, color=colour, rasterized=True)
    axes.set_yticks(range(len(kinds)), [plain(kind) for kind in kinds])
    return _svg(figure)


def _draw_memory(memory: Dict[str, List[Sample]], run: SoakRun) -> str:
    figure, axes = _figure("resident memory, MiB", run)
    for name, samples in sorted(memory.items()):
        axes.plot(*_points(samples, run.began), label=plain(name), linewidth=1.2)
    _finish(axes, bool(memory))
    return _svg(figure)


def _draw_latencies(latencies: Dict[str, List[Sample]], run: SoakRun) -> str:
    figure, axes = _figure("s; slow-down: times", run)
    for name, samples in latencies.items():
        hours = [(one.seconds - run.began) / _HOUR for one in samples]
        values = [max(one.value, 1e-4) for one in samples]
        axes.scatter(hours, values, s=5, label=plain(name), rasterized=True)
    has_samples = any(latencies.values())
    if has_samples:
        axes.set_yscale("log")
    _finish(axes, has_samples)
    return _svg(figure)


def _points(samples: Sequence[Sample], began: float) -> Tuple[List[float], List[float]]:
    few = samples[:: 1 + len(samples) // _MOST_ROWS]
    return [(one.seconds - began) / _HOUR for one in few], [one.value for one in few]


def _figure(label: str, run: SoakRun) -> Tuple[Figure, Any]:
    figure = Figure(figsize=_INCHES, layout="constrained")
    axes = figure.add_subplot()
    axes.set_xlim(0.0, max(run.seconds / _HOUR, 1e-3))
    axes.set(xlabel="simulated time, h", ylabel=label)
    axes.grid(alpha=0.3)
    axes.set_axisbelow(True)
    return figure, axes


def _finish(axes: Any, has_legend: bool) -> None:
    if has_legend:
        axes.legend(frameon=False, fontsize=8, loc="upper left", bbox_to_anchor=(1.0, 1.0))


def _svg(figure: Figure) -> str:
    """Returns a picture as an element of the page."""
    text = io.StringIO()
    with rc_context({"svg.hashsalt": "soak"}):  # the same picture has the same ids
        figure.savefig(text, format="svg", dpi=_DOTS_PER_INCH, metadata=_NO_METADATA)
    return text.getvalue().partition("<svg")[1] + text.getvalue().partition("<svg")[2]
