"""Records the bags of this folder: ``test/bags/record [NAME...]``."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Callable, Dict, List, NamedTuple

import rospy
from driver import TIMEOUT, Driver

from rosclingo.ros.local_master import LocalMaster

HERE = Path(__file__).resolve().parent
ROUTES = {
    1: "c6 c5 o9 pickup(1) c5 c6 open1 c1 c2 c3 o14 deliver(1)",
    2: "c6 c5 o9 pickup(1) c5 c6 c5 c4 c3 o14 deliver(1)",
    3: "c6 c5 c4 c6 open1 c1 c2 o2 pickup(2) c2 c1 o3 deliver(2) c1 c2 c3 c4 o7 pickup(1) "
    "c4 o11 deliver(1)",
}


class Case(NamedTuple):
    """A run: what ``roslaunch`` starts, and what happens."""

    launch: List[str]
    script: Callable[[Driver], None]


def see_plan(driver: Driver) -> None:
    """Has the plan of a static mode published."""
    driver.see_plan()


def deliver(driver: Driver) -> None:
    """Has the mailbot deliver, with failures, a second request that is cancelled, and a third."""
    driver.goal("bring(1,3)")
    driver.answer("success", "success", "success", "failure", "success")  # a way is blocked
    driver.goal("bring(2,4)")
    driver.answer("success")
    driver.cancel(2)
    driver.finish()
    driver.goal("bring(4,1)")
    driver.finish()


def visit(driver: Driver) -> None:
    """Has the robot on a line visit cells, with a failure and a cancel, and with a closed cell."""
    driver.goal("visit(3)")
    driver.goal("visit(5)")
    driver.answer("success", "failure")
    driver.cancel(2)
    driver.finish()
    driver.message("info", "close(5)")
    driver.goal("visit(1)")
    driver.finish()


def visit_in_time(driver: Driver) -> None:
    """As the horizon is fixed, a gate holds the time until the goals are there."""
    driver.goal("visit(3)")
    driver.goal("visit(1)")
    driver.goal("visit(2)")
    driver.cancel(3)
    driver.message("gate", "success")
    driver.answer("failure", "success")
    driver.finish()


def scenario(number: int) -> Callable[[Driver], None]:
    """Returns what happens in one of the paper's scenarios."""
    route = [word if "(" in word else f"go({word})" for word in ROUTES[number].split()]

    def script(driver: Driver) -> None:
        if number in (1, 2):
            driver.message("info", "blocked(c3,c4)")
        driver.goal("bring(o7,o11)" if number == 3 else "bring(o9,o14)")
        for place in range(1, len(route) + 1):
            driver.wait()
            if number == 3 and place == 1:
                driver.goal("bring(o2,o3)")
            if number == 2 and place == 6:
                driver.message("info", "unblocked(c3,c4)")
            driver.answer("failure" if number == 3 and place == 3 else "success")
        driver.finish()
        assert driver.actions == route, driver.actions

    return script


def _launch(package: str, file: str, **arguments: str) -> List[str]:
    return [package, f"{file}.launch", *(f"{name}:={value}" for name, value in arguments.items())]


def cases() -> Dict[str, Case]:
    """Returns all runs by the names of their bags."""
    office, grid = (_mailbot(f"instances/graph_{name}") for name in ("wg", "bench"))
    mailbot, line = _mailbot("mailbot"), _path("rosoclingo", "example/line")
    runs = {}
    for kind, steps in (("fixed", "14"), ("incremental", "20")):
        mode = f"static.{kind}.recording"
        for name, file in (("blocks_world", "blocks_world"), ("mailbot", "mailbot_static")):
            launch = _launch("rosoclingo_examples", file, mode=mode, steps=steps)
            runs[f"{name}_static_{kind}"] = Case(launch, see_plan)
    runs["line_dynamic_fixed"] = Case(
        _launch(
            "rosoclingo", "rosoclingo", mode="dynamic.fixed.recording", steps="12",
            encoding=f"{line}.lp", options="-c with_gate=1 -c slots=3",
        ),
        visit_in_time,
    )  # fmt: skip
    for kind in ("recording", "reset", "dyn_reset"):
        runs[f"mailbot_dynamic_{kind}"] = Case(
            _launch(
                "rosoclingo", "rosoclingo", mode=f"dynamic.incremental.{kind}", steps="100",
                encoding=f"{grid} {mailbot}", options="-c slots=2 -c x=2 -c y=2",
            ),
            deliver,
        )  # fmt: skip
    for dialect in ("", "_1.0", "_paper"):
        launch = _launch("rosoclingo", "single", encoding=f"{line}{dialect}.lp")
        runs[f"line_single{dialect or '_2.0'}"] = Case(launch, visit)
    for number in ROUTES:
        for kind in ("recording", "dyn_reset"):
            launch = _launch(
                "rosoclingo_examples", "mailbot_office", mode=f"dynamic.incremental.{kind}"
            )
            runs[f"scenario{number}_{kind}"] = Case(launch, scenario(number))
        launch = _launch(
            "rosoclingo", "single", encoding=f"{office} {mailbot}", options="-c slots=3"
        )
        runs[f"scenario{number}_single"] = Case(launch, scenario(number))
    return runs


def record(name: str, case: Case) -> None:
    """Records a run in the bag of this name, in place of the one that is there."""
    bag = HERE / f"{name}.bag"
    with tempfile.TemporaryDirectory() as folder:
        new = Path(folder) / bag.name
        with LocalMaster(Path(folder)) as master:
            system = master.start("system", ["roslaunch", *case.launch, f"record:={new}"])
            command = [sys.executable, __file__, "--drive", name]
            status = subprocess.run(
                command, check=False, env=master.environment(), timeout=5 * TIMEOUT
            ).returncode
        if status or not new.exists():
            sys.exit(f"{name} could not be recorded:\n{system.output}")
        subprocess.run(["rosbag", "compress", "--bz2", "--quiet", str(new)], check=True)
        bag.write_bytes(new.read_bytes())
    print(f"{bag.name}: {bag.stat().st_size} bytes", flush=True)


def drive(case: Case) -> None:
    """Does what happens in a run, as a node of its own."""
    rospy.init_node("driver")
    case.script(Driver())


def _path(package: str, file: str) -> str:
    found = subprocess.check_output(["rospack", "find", package], text=True).strip()
    return f"{found}/{file}"


def _mailbot(file: str) -> str:
    return _path("rosoclingo_aspprograms", f"mailbot/{file}.lp")


def main() -> None:
    """Records the bags that the command line names, or all."""
    runs, names = cases(), sys.argv[1:]
    if names[:1] == ["--drive"]:
        drive(runs[names[1]])
        return
    unknown = set(names).difference(runs)
    if unknown:
        sys.exit(f"no bag {', '.join(sorted(unknown))}; there are {', '.join(runs)}")
    for name in names or runs:
        record(name, runs[name])


if __name__ == "__main__":
    main()
