"""The READMEs of the simulator and of rosoclingo_gazebo."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
import yaml
from page import Page, of
from readmes import check_output, section

REQUEST = "o9 o14 box_of_chocolate\n"


@pytest.mark.costly
@of("rosoclingo_gazebo/README.md", "rosoclingo_gazebo")
def test_gazebo(page: Page) -> None:
    office = page.type("mailbot_robot.launch")
    client = page.type("mailbot.py", lines=REQUEST)
    client.wait_for("step 2 of")
    assert "mailbot: go(c6): success" in office.output
    check_output("rosoclingo_gazebo/README.md", "rosoclingo_gazebo", client.output)


@pytest.mark.costly
@of("rosoclingo_gazebo/README.md", "mailbot_scenario.launch")
def test_scenario(page: Page) -> None:
    page.type("mailbot_scenario.launch")
    page.sees("/simulator")
    page.type("run-1.0.py")
    robot = page.type("mailbot_interfaces.launch")
    page.type("mailbot.py", lines=REQUEST).wait_for("step 1 of")
    robot.wait_for("mailbot: go(c6)")


def has_navigation(page: Page) -> bool:
    return page.terminals.run("rospack", "find", "move_base").wait() == 0


@pytest.mark.costly
@of("docs/navigation.md", "On the simulator")
def test_real_navigation(page: Page) -> None:
    page.type("localisation:=false")
    page.sees("/simulator")
    started = page.type("real_navigation.launch")
    if has_navigation(page):
        page.sees("/move_base")
    else:
        assert started.wait() == 1


@pytest.mark.costly
@of("docs/navigation.md", "Real navigation")
def test_what_real_navigation_needs(page: Page) -> None:
    """It says the commands that the document has, too."""
    has_stack = has_navigation(page)
    started = page.type("real_navigation.launch")
    checked = page.type("navigation_check.py")
    if has_stack:
        page.sees("/map_server")
        assert checked.wait() == 0
        return
    build = [piece.text for piece in section("docs/navigation.md", "On Debian")]
    for missing in (started, checked):
        assert missing.wait() == 1
        assert "packages are missing" in missing.output
        said = " ".join(missing.output.replace("\\\n", " ").split())
        for command in build[: build.index("source devel/setup.bash")]:
            assert " ".join(command.replace("\\\n", " ").split()) in said


@pytest.mark.costly
@of("rosoclingo_gazebo/README.md", "A fleet")
def test_a_fleet(page: Page) -> None:
    page.type("mailbot_fleet.launch")
    for robot in ("mailbot", "mailbot2", "mailbot3"):
        page.sees(f"/move_base_interface_{robot}")
        page.sees(f"/{robot}/move_base/goal")
    page.sees("/rosoclingo/goal")


@pytest.mark.costly
@of("rosoclingo_gazebo/README.md", "Systems of their own")
def test_systems_of_their_own(page: Page) -> None:
    offices = {}
    for robot in ("robot1", "robot2"):
        offices[robot] = page.type(f"frame_prefix:={robot}")
        page.sees(f"/{robot}/simulator")
    for robot in offices:
        page.type(f"ROS_NAMESPACE={robot}", lines=REQUEST).wait_for("step 2 of")
    for office in offices.values():
        assert "mailbot: go(c6): success" in office.output


@of("rosoclingo_simulator/README.md", "Several robots")
def test_several_robots(page: Page) -> None:
    page.type("fleet:=")
    for robot in ("robot1", "robot2"):
        page.sees(f"/{robot}/move_base/goal")


@pytest.mark.costly
@of("rosoclingo_simulator/README.md", "Several systems")
def test_several_systems(page: Page) -> None:
    for robot in ("robot1", "robot2"):
        page.type(f"frame_prefix:={robot}")
        page.sees(f"/{robot}/simulator")


@of("rosoclingo_simulator/README.md", "The office, and a world of your own")
def test_world(page: Page) -> None:
    page.run("generate_world.py")
    house(page, page.block("yaml"))


def house(page: Page, description: str) -> Path:
    """Makes the world that the README describes, and returns its folder."""
    (page.folder / "house.yaml").write_text(description)
    made = page.terminals.run(
        "rosrun", "rosoclingo_simulator", "generate_world.py", str(page.folder / "house.yaml"),
        "--output", str(page.folder / "house"),
    )  # fmt: skip
    assert made.wait() == 0, made.output
    return page.folder / "house"


@pytest.mark.costly
@of("rosoclingo_simulator/README.md", "rosoclingo_simulator")
def test_simulator(page: Page) -> None:
    page.type("embedded.launch")
    page.sees("/simulator/obstacle")
    said = page.run("/simulator/obstacle")
    check_output("rosoclingo_simulator/README.md", "rosoclingo_simulator", said)
    page.interrupt()
    pieces = section("rosoclingo_simulator/README.md", "The office, and a world of your own")
    made = house(page, next(piece.text for piece in pieces if piece.kind == "yaml"))
    for kind, name in (("map", "floor.yaml"), ("waypoints", "places.yaml")):
        (found,) = [file for file in made.rglob("*.yaml") if holds(file, kind)]
        shutil.copy(found, page.folder / name)
    for picture in made.rglob("*.pgm"):
        shutil.copy(picture, page.folder)
    page.type("simulator.py")
    page.hears("/map")


def holds(file: Path, kind: str) -> bool:
    return {"map": "image", "waypoints": "frame"}[kind] in yaml.safe_load(file.read_text())


@pytest.mark.costly
@of("rosoclingo_simulator/README.md", "Obstacles")
def test_obstacles(page: Page) -> None:
    page.terminals.start("roslaunch", "rosoclingo_simulator", "embedded.launch", "speed:=10")
    page.sees("/simulator/obstacle")
    for word in ("block c4 c5", "unblock c4 c5"):
        assert yaml.safe_load(page.run(word))["success"]


@of("rosoclingo_simulator/README.md", "Faults")
def test_faults(page: Page) -> None:
    (page.folder / "faults.yaml").write_text(page.block("yaml"))
    office = page.type("embedded.launch")
    office.wait_for("fault 1 (slip) begins")
    said = yaml.safe_load(page.run("/simulator/faults").split("---")[0])
    (fault,) = yaml.safe_load(said["data"])["faults"]
    assert (fault["fault"], fault["begun"]) == ("slip", [2.0])


@of("rosoclingo_simulator/README.md", "MuJoCo physics and camera")
def test_mujoco(page: Page) -> None:
    page.type("physics:=mujoco")
    page.hears("/map")
