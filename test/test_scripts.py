"""What the scripts refuse, and what they install."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path
from typing import Callable, List, Tuple

import pytest
import yaml
from parts import NUMBER

ROOT = Path(__file__).resolve().parents[1]


@pytest.mark.parametrize(
    ("command", "pieces"),
    [
        (
            ("setup", "--tests"),
            ["usage: scripts/setup [--no-recommended | --test | --bench | --docs]"],
        ),
        (("test", "unit"), ["'unit'", "system whole browser"]),
        (("test", "--again", "units"), ["--again needs a number"]),
        (("test", "--part", "7", "units"), ["--part needs a number from 1 to 6"]),
        (("test", "--all"), ["'--all'", "--again N, --full, --part N"]),
        (("fuzz", "nowhere"), ["there is no door 'nowhere'", "control, assumptions"]),
        (("docs", "--help"), ["usage: scripts/docs [FOLDER | --check]"]),
        (("docs", str(ROOT / "docs")), ["/docs' has something else than a site"]),
        (("in-chroot", "trixie"), ["usage: scripts/in-chroot [--keep FOLDER] SUITE COMMAND..."]),
        (
            ("in-chroot", "--keep", "/no/folder", "trixie", "true"),
            ["'/no/folder'", "make it first"],
        ),
        (("package", "--help"), ["usage: scripts/package [--revision N] [FOLDER] | --check SUITE"]),
        (("package", "--revision", "a"), ["--revision needs a number"]),
        (("package", "--check", "sid"), ["--check needs one of the suites bookworm and trixie"]),
        (("in-chroot", "sarge", "true"), ["'sarge'", "bookworm, trixie, focal"]),
    ],
)
def test_what_is_refused(command: Tuple[str, ...], pieces: List[str]) -> None:
    ended = subprocess.run(
        [ROOT / "scripts" / command[0], *command[1:]], capture_output=True, text=True, check=False
    )
    assert ended.returncode == 1
    for piece in pieces:
        assert piece in ended.stderr


@pytest.fixture
def part_of_a_run(tmp_path: Path) -> Callable[..., str]:
    """Says which part of the costly tests scripts/test runs; it installs and tests nothing."""
    (tmp_path / "scripts").mkdir()
    for name, text in (
        ("test", (ROOT / "scripts" / "test").read_text()),
        ("lib.sh", (ROOT / "scripts" / "lib.sh").read_text()),
        ("setup", '#!/bin/sh\necho "part:$PART"\nexit 3\n'),
    ):
        (tmp_path / "scripts" / name).write_text(text)
        (tmp_path / "scripts" / name).chmod(0o755)
    (tmp_path / "test").mkdir()
    shutil.copy(ROOT / "test" / "parts.py", tmp_path / "test")

    def run(*options: str, **environment: str) -> str:
        without = {name: value for name, value in os.environ.items() if name != "FULL"}
        ended = subprocess.run(
            [tmp_path / "scripts" / "test", *options],
            env={**without, "GIT_CEILING_DIRECTORIES": str(tmp_path.parent), **environment},
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert ended.returncode == 3, ended.stderr
        return ended.stdout.strip()

    return run


def test_which_part_of_the_costly_tests_runs(part_of_a_run: Callable[..., str]) -> None:
    assert part_of_a_run() == "part:", "there is no history"
    assert part_of_a_run(PART="2") == "part:"
    assert part_of_a_run("--part", "3", "--again", "2", "units") == "part:3"
    assert part_of_a_run("--full", "lint") == part_of_a_run(FULL="1") == "part:"
    assert part_of_a_run("--part", "2", FULL="1") == "part:2"


@pytest.mark.skipif(shutil.which("git") is None, reason="git is not installed")
def test_a_commit_has_its_part(part_of_a_run: Callable[..., str], tmp_path: Path) -> None:
    git = ("git", "-C", str(tmp_path), "-c", "user.name=a", "-c", "user.email=a@localhost")
    subprocess.run([*git, "init", "--quiet"], check=True)
    for number in range(1, 8):
        subprocess.run([*git, "commit", "--quiet", "--allow-empty", "-m", "Change"], check=True)
        assert part_of_a_run() == f"part:{number % NUMBER + 1}"


SCRIPT_COMMANDS = """
quietly() { true; }
say() { true; }
source_ros() { true; }
"""


def typed(folder: Path, script: str, *words: str) -> subprocess.CompletedProcess[str]:
    """Runs a script where nothing is installed or built, to see what it types."""
    (folder / "scripts").mkdir()
    for name, text in (
        (script, (ROOT / "scripts" / script).read_text()),
        ("lib.sh", SCRIPT_COMMANDS),
        ("setup", "#!/bin/sh"),
        ("python", '#!/bin/sh\necho "$@"'),
    ):
        (folder / "scripts" / name).write_text(text + "\n")
        (folder / "scripts" / name).chmod(0o755)
    path = f"{folder / 'scripts'}:{os.environ['PATH']}"
    return subprocess.run(
        [folder / "scripts" / script, *words],
        capture_output=True, text=True, check=False, env={**os.environ, "PATH": path},
    )  # fmt: skip


@pytest.mark.parametrize(
    ("words", "pieces"),
    [
        ([], ["mailbot_robot.launch", " demo.py", "/demo"]),
        (["there"], ["_output:=", "/there"]),
        (["--kill=7"], ["mailbot_robot.launch", "/demo/run.store", "_kill:=7"]),
        (["--kill"], ["_kill:="]),
        (["--carried"], ["causes:=true faults:=", "/config/carried.yaml", "_story:=carried"]),
        (["--robots", "3"], ["mailbot_fleet.launch robots:=3", "fleet_demo.py _robots:=3"]),
    ],
)
def test_what_the_demo_types(words: List[str], pieces: List[str], tmp_path: Path) -> None:
    ended = typed(tmp_path, "demo", *words)
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout.startswith("-m rosclingo.ros.local_master roslaunch rosoclingo_gazebo ")
    for piece in pieces:
        assert piece in ended.stdout


@pytest.mark.parametrize(
    "words", [["--robots"], ["--robots", "5"], ["--carried", "--kill=1"], ["--robot"]]
)
def test_what_the_demo_refuses(words: List[str], tmp_path: Path) -> None:
    ended = typed(tmp_path, "demo", *words)
    assert ended.returncode == 2
    assert "[--kill[=SEED] | --robots N | --carried] [FOLDER]" in ended.stderr


def test_what_the_soak_types(tmp_path: Path) -> None:
    ended = typed(tmp_path, "soak", "0.5", "7", "--wall")
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout.endswith("/benchmarks/soak.py 0.5 7 --wall\n")


@pytest.mark.parametrize("words", [[], ["--wall"]])
def test_what_the_soak_refuses(words: List[str], tmp_path: Path) -> None:
    ended = typed(tmp_path, "soak", *words)
    assert ended.returncode == 2
    assert "HOURS [SEED] [--wall]" in ended.stderr


@pytest.mark.skipif(
    "ID=ubuntu" in Path("/etc/os-release").read_text(), reason="it can be made here"
)
def test_a_suite_of_another_distribution() -> None:
    ended = subprocess.run(
        [ROOT / "scripts/in-chroot", "focal", "true"], capture_output=True, text=True, check=False
    )
    assert ended.returncode == 1
    assert "focal is a suite of ubuntu, but the apt sources of this machine" in ended.stderr


@pytest.mark.parametrize("library", ["clingo", "rosbags"])
def test_who_lives_in_private_parts_has_limits(library: str) -> None:
    text = (ROOT / "requirements.txt").read_text()
    assert re.search(rf"^{library}>=[0-9.]+,<[0-9.]+$", text, re.MULTILINE)


def test_rosdep_installs_what_is_required() -> None:
    """It names no versions: rosdep looks for what it has installed by the text that is here."""
    files = [ROOT / f"requirements{kind}.txt" for kind in ("", "-recommended", "-test")]
    text = "".join(file.read_text() for file in files)
    required = re.findall(r"^\w[\w-]*", text, re.MULTILINE)
    keys = yaml.safe_load((ROOT / "rosdep.yaml").read_text())
    rules = [rule for key in keys.values() for rule in key.values() if isinstance(rule, dict)]
    libraries = {name for rule in rules for name in rule["pip"]["packages"]}
    assert libraries == {"clingo", "clingo-dl", "mujoco", "rosbags"}
    assert libraries <= set(required)
