"""The command that installs an optional library."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from rosclingo.libraries import install_command

SOURCE = Path(__file__).resolve().parents[2] / "src"


def test_the_command_is_of_this_interpreter() -> None:
    command = install_command("mujoco>=3.1")
    assert command.startswith(f"{sys.executable} -m pip install 'mujoco>=3.1'")
    is_environment = sys.prefix != sys.base_prefix
    assert not (is_environment and "--break" in command)


def test_debian_s_own_interpreter_is_told_what_its_pip_wants(tmp_path: Path) -> None:
    """As it is where apt manages the packages, and not in a virtual environment."""
    program = (
        "import os, sys; os.__file__ = sys.argv[1]; sys.base_prefix = sys.prefix\n"
        "from rosclingo.libraries import install_command; print(install_command('mujoco>=3.1'))"
    )

    def said() -> str:
        return subprocess.check_output(
            [sys.executable, "-c", program, str(tmp_path / "os.py")],
            env={"PYTHONPATH": str(SOURCE)}, text=True,
        )  # fmt: skip

    assert said().endswith("-m pip install 'mujoco>=3.1'\n")
    (tmp_path / "EXTERNALLY-MANAGED").touch()
    assert said().endswith("-m pip install 'mujoco>=3.1' --user --break-system-packages\n")
