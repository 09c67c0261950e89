"""new.py finds its template and the messages' definitions where they are installed.

Needs a sourced workspace, in the install space. The tutorial's test uses it in the devel space.
"""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest


@pytest.mark.install_space
def test_it_finds_what_is_installed(tmp_path: Path) -> None:
    new = ("rosrun", "rosoclingo", "new.py", "my_robot")
    said = subprocess.check_output((*new, "--folder", str(tmp_path)), text=True)
    written = {str(file.relative_to(tmp_path / "my_robot")) for file in tmp_path.rglob("*.*")}
    assert {"encoding/robot.lp", "nodes/robot.py", "test/visits.bag"} <= written
    again = subprocess.run(new, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert again.returncode == 2
    assert again.stderr.startswith("new.py: my_robot exists already")
    assert said.startswith(f"wrote {tmp_path}/my_robot:\n")
