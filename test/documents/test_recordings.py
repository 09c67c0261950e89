"""Bags: recording, replays, reports, and bags as tests."""

from __future__ import annotations

import shutil
import xml.etree.ElementTree as ET

import pytest
from page import BAGS, Page, has_libraries, of
from readmes import check_output
from typist import pipe
from waiting import wait_for


def rostest(page: Page) -> None:
    """Makes a package of a block that is a line for rostest, and runs it."""
    package = page.folder / "my_package"
    (package / "test").mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>my_package</name></package>")
    shutil.copy(page.folder / "run.bag", package / "test")
    launch = f"<launch>{page.block('xml')}</launch>"
    assert ET.fromstring(launch)[0].attrib["type"] == "replay.py"
    (package / "test" / "run.test").write_text(launch)
    page.terminals.environment["ROS_PACKAGE_PATH"] += f":{page.folder}"
    results = page.folder / "results"
    page.terminals.environment["ROS_TEST_RESULTS_DIR"] = str(results)
    tested = page.terminals.run("rostest", "my_package", "run.test")
    assert tested.wait() == 0, tested.output
    (file,) = results.rglob("rosunit-*.xml")
    suite = ET.parse(file).getroot()
    assert (suite.get("failures"), suite.get("errors")) == ("0", "0")


@pytest.mark.costly
@of("docs/bags.md", "Regression bags")
def test_regression_bags(page: Page) -> None:
    recorded = page.type("roslaunch")
    journal = ("/rosoclingo", "/rosoclingo/journal")
    wait_for(lambda: "/recorder" in page.terminals.receivers(*journal))
    client, typist = pipe(
        page.terminals, page.folder, "rosrun", "rosoclingo_examples", "mailbot_manual.py"
    )
    typist.type("1 3\n")
    typist.close()
    assert client.wait() == 0, client.output
    recorded.interrupt()
    recorded.wait()
    page.has(yesterday_bag=page.folder / "run.bag", today_bag=page.folder / "run.bag")
    assert "no difference" in page.run("replay.py")
    rostest(page)
    assert "no difference" in page.run("compare.py")


@pytest.mark.costly
@of("docs/bags.md", "record.py")
def test_record(page: Page) -> None:
    page.type("record.py").wait_for("recording /rosoclingo in")
    page.interrupt()
    page.type("record:=run.bag").wait_for(f"{page.folder}/run.bag")


@pytest.mark.costly
@of("docs/bags.md", "rosbag play")
def test_rosbag_play(page: Page) -> None:
    page.has(run_bag=BAGS / "mailbot_dynamic_recording.bag")
    started = page.terminals.start("roslaunch", "rosoclingo_examples", "mailbot_dynamic.launch")
    page.hears("/rosoclingo/about")
    page.run("rosbag play")
    started.wait_for("mailbot: go(")


@pytest.mark.costly
@of("docs/bags.md", "replay.py")
def test_replay(page: Page) -> None:
    page.has(run_bag=BAGS / "mailbot_dynamic_recording.bag")
    assert "no difference" in page.run("replay.py")

    assert ET.fromstring(page.block("xml")).attrib["type"] == "replay.py"


@of("docs/bags.md", "compare.py")
def test_compare(page: Page) -> None:
    page.has(
        yesterday_bag=BAGS / "scenario1_recording.bag", today_bag=BAGS / "scenario2_recording.bag"
    )
    has_libraries(page)
    for word in ("rosrun", "python3 -m"):
        compared = page.type(word)
        assert compared.wait() == 1, compared.output
        check_output("docs/bags.md", "compare.py", compared.output)


@of("docs/bags.md", "report.py")
def test_report(page: Page) -> None:
    page.has(run_bag=BAGS / "scenario1_single.bag")
    has_libraries(page)
    for word in ("rosrun", "python3 -m"):
        page.run(word)
        report = page.folder / "run.html"
        assert "</html>" in report.read_text()
        report.unlink()
