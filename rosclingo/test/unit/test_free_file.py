"""A file that exists is refused, with the name of one that is free."""

from __future__ import annotations

from pathlib import Path

import pytest

from rosclingo.free_file import main, refusal


def test_the_next_free_name(tmp_path: Path) -> None:
    bag = tmp_path / "run.bag"
    assert not refusal(bag)
    bag.touch()
    (tmp_path / "run-2.bag").symlink_to("nowhere")
    assert "such as run-3.bag," in refusal(bag)


def test_a_folder_that_is_not_there(tmp_path: Path) -> None:
    assert "its folder is not there" in refusal(tmp_path / "no" / "run.bag")


def test_the_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    for status in (0, 1):
        with pytest.raises(SystemExit) as ended:
            main(["free_file.py", "~/run.bag"])
        assert ended.value.code == status
        (tmp_path / "run.bag").touch()
    said = capsys.readouterr()
    assert said.out == f"{tmp_path}/run.bag\n"
    assert "not overwritten" in said.err
