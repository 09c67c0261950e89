"""The README of rosclingo, and the manual's examples."""

from __future__ import annotations

import sys

import pytest
import yaml
from page import TOWER, Page, of
from readmes import check_output


@pytest.mark.costly
@of("README.md", "ROSoClingo")
def test_the_first_example(page: Page) -> None:
    (page.folder / "my_robots.lp").write_text(page.block("prolog"))
    check_output("README.md", "ROSoClingo", page.run("plan.py"))
    page.type("single.launch").wait_for("plans with")
    page.interrupt()


@of("README.md", "The manual's examples")
def test_the_manuals_examples(page: Page) -> None:
    for script in ("start.py", "istart.py"):
        page.type("roscore")
        page.type("run.py")
        said = page.run(script)
        assert "result: sat" in said
        assert said.count("do(arm,") == 14
        page.interrupt()


@pytest.mark.costly
@of("rosclingo/README.md", "rosclingo")
def test_rosclingo(page: Page) -> None:
    page.type("roscore")
    page.type("run.py")
    said = page.run("start.py")
    check_output("rosclingo/README.md", "rosclingo", said)
    assert "'do(arm,pickup(4),1)'" in said
    assert "'do(arm,putdown(3),14)'" in said


@of("rosclingo/README.md", "Your own files")
def test_files(page: Page) -> None:
    page.has(instance_lp=TOWER / "instance.lp", encoding_lp=TOWER / "toh.lp")
    page.type("run.py")
    page.sees("/rosclingo/control")
    page.interrupt()
    page.has(a_lp=TOWER / "instance.lp", b_lp=TOWER / "toh.lp")
    page.type("roslaunch")
    page.sees("/planner/control")


@of("rosclingo/README.md", "Control")
def test_control(page: Page) -> None:
    page.terminals.start("rosrun", "rosclingo", "run.py")
    page.sees("/rosclingo/control")
    result = yaml.safe_load(page.run("rosservice call"))["result"]
    assert "".join(result.splitlines()) == (
        "<return><success>True</success>"
        '<externals><external name="query(1)" value="true"/></externals></return>'
    )


@pytest.mark.costly
@of("rosclingo/README.md", "Difference constraints")
def test_difference_constraints(page: Page) -> None:
    page.type("roscore")
    page.type("run.py")
    said = page.run("istart.py")
    assert "solving with horizon 21\n##### result\nresult: sat\n" in said
    assert "'dl(begin(join),17)'" in said
    assert said.count(",knife)") == 1


@of("rosclingo/README.md", "Use it from Python")
def test_use_it_from_python(page: Page) -> None:
    (page.folder / "a.lp").write_text(
        "#program query(t). #external query(t). {a(t)}. :- query(t), not a(t). #show a/1."
    )
    page.terminals.start("rosrun", "rosclingo", "run.py", "-f", str(page.folder / "a.lp"))
    (page.folder / "example.py").write_text(page.block("python"))
    said = page.terminals.run(sys.executable, str(page.folder / "example.py"))
    assert said.wait() == 0, said.output
    assert "a(3)" in said.output
