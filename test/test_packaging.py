"""Debian packages: names, dependencies, and libraries that only our code finds."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import List

import pytest
import yaml
from catkin_pkg.package import Package, parse_package

from deb_libraries import Libraries, read_requirements
from deb_names import LIBRARY_KEYS, System, UnknownKeyError, apt_names, deb_name, recommended
from deb_source import SourcePackage, requirements_of, summary

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = [parse_package(str(file)) for file in sorted(ROOT.glob("*/package.xml"))]
NAMES = [package.name for package in PACKAGES]
REQUIREMENTS = read_requirements(ROOT / "requirements.txt")
NONE = Libraries(Path("none"), {}, [], False)


def source_of(package: Package, system: System = System.DEBIAN) -> SourcePackage:
    return SourcePackage(package, NAMES, system, "1.2.3-1trixie")


def bare(names: List[str]) -> List[str]:
    """Returns names without versions, and without our own packages."""
    found = [name.split(" ")[0] for name in names]
    return [name for name in found if not re.match(r"(ros-noetic-)?roso?clingo", name)]


def test_names() -> None:
    assert deb_name("rosoclingo_interfaces", System.DEBIAN) == "rosoclingo-interfaces"
    assert deb_name("rosoclingo_interfaces", System.NOETIC) == "ros-noetic-rosoclingo-interfaces"
    assert apt_names("std_msgs", System.DEBIAN) == ["ros-std-msgs", "python3-std-msgs"]
    assert apt_names("std_msgs", System.DEBIAN, build=True) == ["ros-std-msgs", "libstd-msgs-dev"]
    assert apt_names("std_msgs", System.NOETIC) == ["ros-noetic-std-msgs"]
    assert apt_names("python3-clingo-pip", System.DEBIAN) == []
    with pytest.raises(UnknownKeyError, match=r"'tf9': add it to .*deb_names\.py"):
        apt_names("tf9", System.DEBIAN)


def test_packages_of_one_build_belong_together() -> None:
    (package,) = (package for package in PACKAGES if package.name == "rosoclingo_console")
    depends = source_of(package).depends(NONE)
    assert {"rosclingo (= 1.2.3-1trixie)", "rosoclingo (= 1.2.3-1trixie)"} <= set(depends)


@pytest.mark.skipif(shutil.which("dpkg-query") is None, reason="there is no dpkg")
@pytest.mark.skipif(Path("/opt/ros/noetic").exists(), reason="the names are those of Debian")
@pytest.mark.parametrize("package", PACKAGES, ids=NAMES)
def test_setup_installs_what_a_package_depends_on(package: Package) -> None:
    """With --test, for rviz: directly, or because what it installs depends on that."""
    source = source_of(package)
    names = bare(source.depends(NONE) + source.build_depends())
    ended = subprocess.run(
        ["dpkg-query", "-W", "-f", "${Package} ${db:Status-Status}\n", *names],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    there = {line.split()[0] for line in ended.stdout.splitlines() if line.endswith(" installed")}
    assert set(names) <= there, ended.stderr


@pytest.mark.parametrize("package", PACKAGES, ids=NAMES)
def test_names_of_noetic(package: Package) -> None:
    """They are those that scripts/setup installs there, or that ros-base depends on."""
    text = (ROOT / "scripts" / "lib.sh").read_text()
    source = source_of(package, System.NOETIC)
    names = bare(source.depends(NONE) + source.build_depends())
    base = {
        "catkin", "genpy", "rosbash", "rosgraph", "roslaunch", "roslib", "rosmaster", "rospy"
    }  # fmt: skip
    for name in names:
        if name.startswith("ros-noetic-") and name[len("ros-noetic-") :] not in base:
            assert re.search(rf"\s{name}[\s\\)]", text), name


def test_compiled_modules_are_of_a_processor_and_a_version_of_python() -> None:
    (package,) = (package for package in PACKAGES if package.name == "rosoclingo")
    source = source_of(package)
    assert {"cython3", "python3-dev"} <= set(source.build_depends())
    assert any(name.startswith("python3 (<< ") for name in source.depends(NONE))


def test_each_library_has_a_package() -> None:
    assert set(LIBRARY_KEYS) == set(REQUIREMENTS)
    required = {name for package in PACKAGES for name in requirements_of(package, REQUIREMENTS)}
    assert required == set(REQUIREMENTS.values())


def test_keys_that_pip_installs_have_a_library() -> None:
    rules = yaml.safe_load((ROOT / "rosdep.yaml").read_text())
    ours = {key for key in LIBRARY_KEYS.values() if key.endswith("-pip")}
    named = {str(dep) for package in PACKAGES for dep in package.exec_depends}
    assert ours <= set(rules)
    assert {key for key in named if key.endswith("-pip")} == ours


def test_what_bloom_needs() -> None:
    """They have the same version, and each a line that says what it is."""
    assert len({package.version for package in PACKAGES}) == 1
    for package in PACKAGES:
        assert package.licenses == ["BSD-3-Clause"]
        assert package.maintainers
        assert [url.type for url in package.urls] == ["website"]
        assert re.match(r"Changelog for package", "".join(_changelog(package)[1:2])), package.name


def _changelog(package: Package) -> List[str]:
    file = Path(package.filename).parent / "CHANGELOG.rst"
    return file.read_text().splitlines()


def test_the_debian_folder(tmp_path: Path) -> None:
    (package,) = (package for package in PACKAGES if package.name == "rosoclingo_interfaces")
    libraries = Libraries(Path("/libs"), {"a 1": "MIT"}, ["python3-lz4"], True)
    source_of(package).write(tmp_path, libraries, "trixie")
    texts = {file.name: file.read_text() for file in (tmp_path / "debian").glob("*.*")}
    assert {"rosoclingo-interfaces.docs", "rosoclingo-interfaces.lintian-overrides"} <= set(texts)
    control = (tmp_path / "debian" / "control").read_text()
    assert "\nPackage: rosoclingo-interfaces\nArchitecture: any\n" in control
    python = f"python3 (<< 3.{sys.version_info.minor + 1})"
    for name in (python, "python3-lz4", "python3-move-base-msgs", "rosclingo (= 1.2.3-1trixie)"):
        assert f", {name}," in control
    assert "Recommends: \n" not in control
    changelog = (tmp_path / "debian" / "changelog").read_text()
    assert changelog.startswith("rosoclingo-interfaces (1.2.3-1trixie) trixie; urgency=")
    assert "\n  a 1: MIT\n" in (tmp_path / "debian" / "copyright").read_text()
    for file in (tmp_path / "debian").iterdir():
        assert file.is_dir() or not re.search(r"@\w+@", file.read_text()), file
    assert os.access(tmp_path / "debian" / "rules", os.X_OK)


@pytest.mark.parametrize("package", PACKAGES, ids=NAMES)
def test_a_short_description(package: Package) -> None:
    short = summary(package.description)
    assert 10 < len(short) < 80
    assert not short.endswith(".")


def test_recommended() -> None:
    assert "python3-rostopic" in recommended("rosclingo", System.DEBIAN)
    assert "ros-noetic-rostopic" in recommended("rosclingo", System.NOETIC)
    assert recommended("rosoclingo_rviz", System.DEBIAN) == []
    for package in ("rosoclingo", "rosoclingo_gazebo"):
        assert recommended(package, System.DEBIAN) == ["python3-matplotlib"]
        assert recommended(package, System.NOETIC) == []


@pytest.mark.parametrize("package", PACKAGES, ids=NAMES)
def test_what_is_recommended_is_not_needed(package: Package) -> None:
    needed = {str(dep) for dep in package.exec_depends}
    assert not needed & {"python3-matplotlib", "python3-mujoco-pip"}
    optional = read_requirements(ROOT / "requirements-recommended.txt")
    assert set(optional) == {"matplotlib", "mujoco"}
    assert not set(optional) & set(REQUIREMENTS)


@pytest.fixture
def installed(tmp_path: Path) -> Path:
    """The folder of modules below a prefix, which has a library that only we are to find."""
    modules = tmp_path / "lib" / "python3" / "dist-packages"
    for package in ("rosclingo", "rosoclingo_interfaces"):
        source = ROOT / package / "src" / package
        (modules / package).mkdir(parents=True)
        for name in ("__init__.py", "libraries.py"):
            if (source / name).exists():
                shutil.copy(source / name, modules / package)
    private = tmp_path / "lib" / "rosclingo" / "site-packages"
    private.mkdir(parents=True)
    (private / "hidden.py").write_text("")
    (private / "both.py").write_text("OURS = True\n")
    (modules / "both.py").write_text("OURS = False\n")
    return modules


@pytest.mark.parametrize(
    ("program", "works"),
    [
        ("import hidden", False),
        ("import rosclingo, hidden", True),
        ("import rosoclingo_interfaces, hidden", True),
        ("import rosclingo, both; assert both.OURS", True),
        ("import both; assert not both.OURS", True),
        ("import rosclingo as r, sys; r.add_private_libraries(); "
         "assert sum('site-packages' in path for path in sys.path) == 1", True),
    ],
)  # fmt: skip
def test_who_finds_private_libraries(installed: Path, program: str, works: bool) -> None:
    ended = subprocess.run(
        [sys.executable, "-S", "-c", program],
        env={"PYTHONPATH": str(installed)}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (ended.returncode == 0) == works, ended.stderr


@pytest.mark.parametrize("package", PACKAGES, ids=NAMES)
def test_who_imports_a_library_finds_it(package: Package) -> None:
    """Its own modules may come before any of rosclingo's."""
    folder = Path(package.filename).parent / "src" / package.name
    modules = {name.lower() for name in REQUIREMENTS} | {"pil", "skimage"}
    imported = re.compile(r"^\s*(?:import|from) (\w+)", re.MULTILINE)
    used = {
        word.lower() for file in folder.rglob("*.py") for word in imported.findall(file.read_text())
    }
    begins = (folder / "__init__.py").read_text()
    assert not used & modules or "import rosclingo" in begins or "from rosclingo" in begins
