"""Harness for benchmarks of ROS nodes: a ROS system of their own, samples, a table of ratios."""

from __future__ import annotations

import json
import math
import os
import platform
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import time
import xmlrpc.client
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple, Type, TypeVar

import actionlib
import clingo
import rosgraph
import rospy

from rosclingo.ros.local_master import LocalMaster

RESULTS = Path(__file__).resolve().parent / "results"

_START_SECONDS = 30.0
_POLL_SECONDS = 0.05
_Returned = TypeVar("_Returned")


class HarnessError(Exception):
    """A process of the benchmark did not start or ended by itself."""


class RosSystem:
    """A ROS master on a port of its own, and nodes; leaving the context ends what was started here.

    Entering it sets ROS's environment variables for this process too, so call
    ``rospy.init_node`` inside. Output and logs of the processes go to a temporary folder.
    """

    def __init__(self) -> None:
        self._folder = Path()
        self._before: Dict[str, Optional[str]] = {}

    def __enter__(self) -> RosSystem:
        """Starts the master and what ``roscore`` starts beside it, and waits for them.

        Raises:
            RosclingoError: They did not start.
        """
        # As Ctrl-C does, so that no process is left behind.
        signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))
        self._folder = Path(tempfile.mkdtemp(prefix="ros-benchmark-"))
        self._master = LocalMaster(self._folder)
        environment = {**self._master.environment(), "ROS_HOME": str(self._folder)}
        changed = {name for name, value in environment.items() if os.environ.get(name) != value}
        self._before = {name: os.environ.get(name) for name in [*changed, "ROS_IP"]}
        os.environ.update(environment)
        os.environ.pop("ROS_IP", None)
        try:
            self._master.__enter__()
            self.rosrun("rosout", "rosout", name="rosout")
        except BaseException:
            self._close()
            raise
        return self

    def __exit__(self, kind: Optional[Type[BaseException]], *_: object) -> None:
        """Ends the processes, the last one first, and shows their output if there was an error."""
        if kind is not None and issubclass(kind, Exception):
            for name, process in self._master.processes.items():
                print(f"--- output of {name}\n{process.output}", file=sys.stderr)
        self._close()

    def rosrun(self, package: str, executable: str, *arguments: str, name: str) -> int:
        """Starts a node and waits until the master knows it.

        Returns:
            The process id of the node itself, which is not always that of rosrun.

        Raises:
            HarnessError: It did not start.
        """
        self.start(name, ["rosrun", package, executable, *arguments, f"__name:={name}"])
        return self.node_pid(name)

    def start(self, name: str, command: Sequence[str]) -> subprocess.Popen[bytes]:
        """Starts a process that is ended with this system, and returns it.

        Args:
            name: What to call it in messages.
            command: Program and arguments.
        """
        return self._master.start(name, command).process

    def output(self, name: str) -> str:
        """Returns the last lines that a process has printed."""
        return self._master.processes[name].last_lines

    def end(self, name: str) -> None:
        """Ends a process that :meth:`start` or :meth:`rosrun` started, and waits for it."""
        self._master.end(name)

    def kill(self, name: str) -> None:
        """Kills such a process by SIGKILL."""
        self._master.kill(name)

    def node_pid(self, name: str) -> int:
        """Waits for a node that :meth:`start` started and returns the process id it says.

        Raises:
            HarnessError: It did not come, or is no process of this machine.
        """
        master = rosgraph.Master("/benchmark")
        found: List[int] = []

        def answers() -> bool:
            try:
                node = xmlrpc.client.ServerProxy(master.lookupNode(f"/{name}"))
                found.append(int(node.getPid("/benchmark")[2]))  # type: ignore[index,arg-type]
            except (rosgraph.MasterException, OSError):
                return False
            return True

        self._wait(name, answers)
        return found[-1]

    def wait_until_hears(self, node: str, publisher: str) -> None:
        """Waits until a node has a connection for each topic of another one that it subscribes to.

        Args:
            node: Who hears, such as ``/recorder``.
            publisher: The name of who publishes, which :meth:`start` or :meth:`rosrun` started.

        Raises:
            HarnessError: It does not come to that.
        """
        master = rosgraph.Master("/benchmark")

        def hears() -> bool:
            try:
                publishers, subscribers, _ = master.getSystemState()
                address = master.lookupNode(f"/{publisher}")
                reply: Any = xmlrpc.client.ServerProxy(address).getBusInfo("/benchmark")
            except (rosgraph.MasterException, OSError):
                return False
            wanted = {topic for topic, nodes in subscribers if node in nodes}
            wanted &= {topic for topic, nodes in publishers if f"/{publisher}" in nodes}
            heard = {one[4] for one in reply[2] if one[1] == node and one[2] == "o"}
            return bool(wanted) and wanted <= heard

        self._wait(publisher, hears)

    def _wait(self, name: str, ready: Callable[[], bool]) -> None:
        process = self._master.processes[name].process
        end = time.monotonic() + _START_SECONDS
        while not ready():
            if process.poll() is not None:
                raise HarnessError(f"{name} ended with status {process.returncode}")
            if time.monotonic() > end:
                raise HarnessError(f"{name} did not start within {_START_SECONDS:.0f} s")
            time.sleep(_POLL_SECONDS)

    def _close(self) -> None:
        self._master.close()
        for name, value in self._before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
        shutil.rmtree(self._folder, ignore_errors=True)


def measure(name: str, run: Callable[[RosSystem, Path, Report], object]) -> int:
    """Runs a benchmark in a ROS system, with a ROS node of its own, and prints the table.

    Args:
        name: The benchmark's name.
        run: Measures, and adds rows to the report; the folder is for its files.

    Returns:
        The exit status: 1 says that a limit is missed.
    """
    report = Report(name)
    with RosSystem() as system, tempfile.TemporaryDirectory() as folder:
        rospy.init_node("benchmark", disable_signals=True)
        try:
            run(system, Path(folder), report)
        finally:
            rospy.signal_shutdown("measured")
    return report.finish()


class Measurements:
    """The measurements of a benchmark in a ROS system.

    Attributes:
        system: Where the nodes run.
        folder: Where files are written.
        report: Where the rows go.
    """

    def __init__(self, system: RosSystem, folder: Path, report: Report) -> None:
        """Measures nothing yet."""
        self.system = system
        self.folder = folder
        self.report = report


def wait_for_node(client: actionlib.ActionClient, *topics: Any) -> None:
    """Waits until a node with an action is there.

    Args:
        client: The action's client.
        topics: Publishers and subscribers that are to be connected, too.

    Raises:
        HarnessError: It did not come.
    """
    end = time.monotonic() + _START_SECONDS
    while not (
        client.wait_for_server(rospy.Duration(nsecs=1))
        and all(topic.get_num_connections() for topic in topics)
    ):
        if time.monotonic() > end:
            raise HarnessError("the node did not start")
        time.sleep(_POLL_SECONDS)


def resident_mebibytes(pid: int) -> float:
    """Returns the memory of a process that is in RAM (VmRSS)."""
    status = Path(f"/proc/{pid}/status").read_text()
    return float(status.split("VmRSS:")[1].split()[0]) / 1024


def processor_seconds(pid: int) -> float:
    """Returns the processor time that a process has used so far."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


@dataclass(frozen=True)
class Samples:
    """Values of one quantity, measured again and again.

    Attributes:
        unit: Such as ``ms``.
        values: In the order in which they were measured; at least one.
    """

    unit: str
    values: Tuple[float, ...]

    @property
    def median(self) -> float:
        """The value in the middle."""
        return statistics.median(self.values)

    @property
    def percentile99(self) -> float:
        """The smallest value that at least 99 of 100 values do not exceed."""
        return sorted(self.values)[math.ceil(0.99 * len(self.values)) - 1]

    def __truediv__(self, divisor: float) -> Samples:
        return Samples(self.unit, tuple(value / divisor for value in self.values))


def milliseconds(call: Callable[[], _Returned]) -> Tuple[float, _Returned]:
    """Calls a function and returns how long it took, and what it returned."""
    begin = time.perf_counter()
    returned = call()
    return (time.perf_counter() - begin) * 1e3, returned


def side_by_side(
    count: int, warm_up: int, *calls: Callable[[], object], pause: float = 0.0
) -> List[Samples]:
    """Measures calls in turn, so that what else the machine does meets all of them alike.

    Args:
        count: Number of samples of each call.
        warm_up: Number of rounds before them that do not count.
        calls: What to measure.
        pause: Seconds between two rounds.

    Returns:
        The times of each call.
    """
    values: List[List[float]] = [[] for _ in calls]
    for round_ in range(warm_up + count):
        for call, times in zip(calls, values):
            duration, _ = milliseconds(call)
            if round_ >= warm_up:
                times.append(duration)
        if pause:
            time.sleep(pause)
    return [Samples("ms", tuple(times)) for times in values]


@dataclass(frozen=True)
class Row:
    """A line of the table.

    Attributes:
        name: What was measured.
        base: Without ROS: in process, or another tool; None if that has no meaning here.
        ros: Through ROS; None if ROS has no part in it. One of ``base`` and ``ros`` is there.
        compared: What ``value`` is, such as ``median - median``; "" if nothing is compared.
        value: The difference or ratio.
        unit: Of ``value`` and ``limit``.
        limit: What ``value`` must not exceed; None for information only.
    """

    name: str
    base: Optional[Samples]
    ros: Optional[Samples]
    compared: str = ""
    value: Optional[float] = None
    unit: str = "ms"
    limit: Optional[float] = None

    @property
    def met(self) -> bool:
        """Whether the value is within the limit; true without a limit."""
        return self.limit is None or (self.value is not None and self.value <= self.limit)

    @property
    def verdict(self) -> str:
        """``met``, ``MISSED`` or, without a limit, ``information``."""
        return "information" if self.limit is None else "met" if self.met else "MISSED"


class Report:
    """The rows of a benchmark; says each as soon as it is there."""

    def __init__(self, name: str) -> None:
        """Starts an empty table.

        Args:
            name: The benchmark's name, and that of its file.
        """
        self.name = name
        self.machine = describe_machine()
        self.rows: List[Row] = []

    def add(self, row: Row) -> None:
        """Appends a row and prints it in short."""
        self.rows.append(row)
        compared = "" if row.value is None else f"{row.compared} = {_number(row.value, row.unit)}"
        limit = "" if row.limit is None else f"limit {_number(row.limit, row.unit)}"
        where = "through ROS" if row.ros else "without ROS"
        median = _figures(row.ros or row.base)[1]
        parts = (f"{row.name}: {median} {where}", compared, limit, row.verdict)
        print(*filter(None, parts), sep="; ", flush=True)

    @property
    def missed(self) -> List[str]:
        """The names of the rows whose limit is missed."""
        return [row.name for row in self.rows if not row.met]

    def table(self) -> str:
        """Returns the machine and the rows as text."""
        lines: List[Tuple[str, ...]] = [
            ("", "", "without ROS", "", "through ROS", "", "", "", "", ""),
            ("measurement", "samples", *("median", "p99") * 2, "compared", "value", "limit", ""),
        ]
        for row in self.rows:
            samples = _figures(row.ros or row.base)[0]
            base, ros = _figures(row.base)[1:], _figures(row.ros)[1:]
            value, limit = (_number(x, row.unit) for x in (row.value, row.limit))
            lines.append((row.name, samples, *base, *ros, row.compared, value, limit, row.verdict))
        widths = [max(map(len, column)) for column in zip(*lines)]
        rows = ("  ".join(map(str.ljust, line, widths)).rstrip() for line in lines)
        machine = (f"{key}: {value}" for key, value in self.machine.items())
        return "\n".join([*machine, "", *rows])

    def finish(self) -> int:
        """Prints the table, writes its numbers and all samples as JSON, and says what is missed.

        Returns:
            The exit status: 0, or 1 if a limit is missed.
        """
        RESULTS.mkdir(exist_ok=True)
        content = {
            "name": self.name,
            "finished": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
            "machine": self.machine,
            "missed": self.missed,
            "rows": [
                {
                    **asdict(row),
                    "base": _summary(row.base),
                    "ros": _summary(row.ros),
                    "verdict": row.verdict,
                }
                for row in self.rows
            ],
        }
        file = RESULTS / f"{self.name}.json"
        file.write_text(json.dumps(content, indent=1) + "\n")
        print(f"\n{self.table()}\n\nwritten to {os.path.relpath(file)}")
        if self.missed:
            print("limit missed:", ", ".join(self.missed))
        return 1 if self.missed else 0


def describe_machine() -> Dict[str, str]:
    """Returns what the figures depend on: the processor and the versions."""
    cpu = Path("/proc/cpuinfo").read_text()
    models = [line.partition(":")[2].strip() for line in cpu.splitlines() if "model name" in line]
    return {
        "processor": models[0] if models else platform.machine(),
        "cores": str(len(os.sched_getaffinity(0))),
        "load before": f"{os.getloadavg()[0]:.1f}",
        "kernel": platform.release(),
        "Python": platform.python_version(),
        "clingo": clingo.__version__,
        "ROS": f"{os.environ.get('ROS_DISTRO', 'unknown')}, rospy {_rospy_version()}",
    }


def _rospy_version() -> str:
    """Asks the package's manifest, because the module does not say."""
    try:
        command = ["rosversion", "rospy"]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return "of unknown version"


def _figures(samples: Optional[Samples]) -> Tuple[str, str, str]:
    if samples is None:
        return ("-", "-", "-")
    count = str(len(samples.values))
    return (
        count,
        _number(samples.median, samples.unit),
        _number(samples.percentile99, samples.unit),
    )


def _number(value: Optional[float], unit: str) -> str:
    return "-" if value is None else f"{value:.2f} {unit}"


def _summary(samples: Optional[Samples]) -> Optional[Dict[str, Any]]:
    if samples is None:
        return None
    return {
        "samples": len(samples.values),
        "unit": samples.unit,
        "median": samples.median,
        "percentile99": samples.percentile99,
        "values": [round(value, 4) for value in samples.values],
    }
