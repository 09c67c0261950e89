"""YAML that is wrong in any way is told by PyYAML's error, within little time and memory."""

from __future__ import annotations

import time
from typing import Any, List

import pytest
import yaml

from rosclingo import strict_yaml
from rosclingo.strict_yaml import Texts, compose, load

SECONDS = 10.0  # of processor time; it takes a hundredth of that
LEVELS = "abcdefghijkl"
BOMB = "a: &a [x, x]\n" + "".join(
    f"{name}: &{name} [{', '.join([f'*{before}'] * 8)}]\n"
    for before, name in zip(LEVELS, LEVELS[1:])
)


def test_values_as_pyyaml_has_them() -> None:
    text = "a: &x {b: [1, 2.5, yes, ~, 2001-02-03]}\nc: {<<: *x, d: 0x1f}\ne: *x\n"
    assert load(text) == yaml.safe_load(text)
    assert load("{1: yes, 2: [0x1f]}", Texts) == {"1": "yes", "2": ["0x1f"]}
    assert load("") is None
    assert compose("") is None


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ("!!int x", "x is no int; correct it"),
        ("!!int ''", " is no int; correct it"),
        ("!!float x", "x is no float; correct it"),
        ("!!bool x", "x is no bool; correct it"),
        ("!!timestamp x", "x is no timestamp; correct it"),
        ("2001-99-99", "2001-99-99 is no timestamp; correct it"),
        ("9" * 30, "9999 .*too large a number|9999.* is too large a number"),
        ("9" * 5000, "9999.* is no int; correct it|9999.* is too large a number"),
        ("{x: 1, x: 2}", "x is there twice; remove or rename one"),
        (
            f"? {'x' * 9000}\n  : 1\n  ? {'x' * 9000}\n  : 2",
            r"xxx\.\.\. \(9000 characters\) is there twice",
        ),
        ("{[x]: 1}", "expected a name, and no list or mapping"),
        (f"*{'x' * 9000}", r"found undefined alias 'xxx"),
        ("[x", "expected ',' or ']'"),
        ("&x [*x]", "it holds itself by an alias; write it without"),
        ("&x {a: {b: *x}}", "it holds itself by an alias; write it without"),
        (r'"\U00110000"', "correct it"),
        (r'"\UFFFFFFFF"', "correct it"),
    ],
)
def test_what_is_wrong_is_told_with_its_line(value: str, message: str) -> None:
    with pytest.raises(yaml.YAMLError, match=rf"^line [234]: .*({message})") as caught:
        load(f"- 1\n- {value}")
    assert len(str(caught.value)) < 300


@pytest.mark.parametrize("read", [load, compose])
def test_aliases_do_not_fill_the_memory(read: Any) -> None:
    with pytest.raises(yaml.YAMLError, match=r"line .: aliases make more than 200000 values of it"):
        read(BOMB)
    with pytest.raises(yaml.YAMLError, match="aliases make more than 200000 values of it"):
        read(BOMB.replace("[x, x]", "{x: 1}").replace("[", "{<<: [").replace("]", "]}"))


@pytest.mark.parametrize("read", [load, compose])
@pytest.mark.parametrize("opening", ["[", "{", "- ", "? ", "{a: ", "[[1],"])
def test_deep_nesting_ends_soon(read: Any, opening: str) -> None:
    began = time.process_time()
    with pytest.raises(yaml.YAMLError, match="line 2: it is nested too deeply"):
        read("- a\n- " + opening * 50_000)
    assert time.process_time() - began < SECONDS


@pytest.mark.parametrize("read", [load, compose])
def test_aliases_do_not_nest_deeper(read: Any) -> None:
    levels = [f"&a{n} {'[' * 40}*a{n - 1}{']' * 40}" for n in range(1, 40)]
    with pytest.raises(yaml.YAMLError, match=r"line 1: it is nested too deeply, in 50 levels"):
        read(f"[&a0 x, {', '.join(levels)}]")
    assert read("[&a [[[[x]]]], [[[[*a]]]]]") is not None


def test_a_version_of_many_digits() -> None:
    with pytest.raises(yaml.YAMLError, match=r"line 1: .*correct it"):
        load(f"%YAML 1.{'9' * 5000}\n---\nx")


def test_indentation_nests_as_brackets_do() -> None:
    lines: List[str] = [f"{' ' * depth}a:" for depth in range(100)]
    with pytest.raises(yaml.YAMLError, match=r"line 5.: it is nested too deeply, in 50 levels"):
        load("\n".join(lines))
    deep: Any = load("[" * 40 + "]" * 40)
    for _ in range(39):
        (deep,) = deep
    assert deep == []


def test_many_names_take_little_time() -> None:
    began = time.process_time()
    names = 2000
    assert len(load("".join(f"a{number}: 1\n" for number in range(names)))) == names
    assert time.process_time() - began < SECONDS


def test_it_leaves_pyyaml_as_it_was() -> None:
    assert yaml.safe_load("a: 1\na: 2") == {"a": 2}
    assert strict_yaml.ScalarValues is not yaml.SafeLoader
