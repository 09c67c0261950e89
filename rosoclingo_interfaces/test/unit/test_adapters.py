"""Files of adapters: what they say, each mistake by its line, and what is sent for an action."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Callable, List, Mapping, Tuple

import pytest

from rosclingo.solver.terms import parse_term
from rosoclingo.loop.values.served import ServedGoal
from rosoclingo_interfaces.adapters.adapter_file import (
    AdapterFile,
    read_adapter,
    unknown_answers,
)
from rosoclingo_interfaces.adapters.answer_rules import first_answer
from rosoclingo_interfaces.adapters.field_template import Now, convert
from rosoclingo_interfaces.adapters.term_pattern import TermPattern
from rosoclingo_interfaces.errors import ActionError, EntryError
from rosoclingo_interfaces.observation.transforms import TransformTree

TYPES: Mapping[str, Mapping[str, str]] = {
    "std_msgs/Bool": {"data": "bool"},
    "std_msgs/String": {"data": "string"},
    "std_srvs/TriggerRequest": {},
    "std_srvs/TriggerResponse": {"success": "bool", "message": "string"},
    "std_srvs/EmptyRequest": {},
    "std_srvs/EmptyResponse": {},
    "geometry_msgs/Pose": {
        "position": "geometry_msgs/Point",
        "orientation": "geometry_msgs/Quaternion",
    },
    "geometry_msgs/Point": {"x": "float64", "y": "float64", "z": "float64"},
    "geometry_msgs/Quaternion": {"x": "float64", "y": "float64", "z": "float64", "w": "float64"},
    "std_msgs/Header": {"stamp": "time", "frame_id": "string"},
    "arm_msgs/ReachGoal": {
        "header": "std_msgs/Header", "pose": "geometry_msgs/Pose", "names": "string[]",
        "joints": "float64[3]", "force": "float32", "tries": "uint8", "wait": "duration",
        "points": "geometry_msgs/Point[]", "soft": "bool",
    },
    "arm_msgs/ReachAction": {},
    "arm_msgs/ReachResult": {"code": "int32", "text": "string"},
    "arm_msgs/ReachFeedback": {"part": "float32", "text": "string"},
}  # fmt: skip

WAYPOINTS = "frame: map\nwaypoints:\n  w1: {x: 1, y: 2, theta: 0}\n"
PLACES = """places:
  shelf: {x: 1.5, y: -2, z: 0.75, theta: 3.14159265, joint: 0.1, name: the shelf, grip: 3}
  box(1): {joint: 7}
"""
REACH = "- action: reach(W)\n  actionlib: arm\n  type: arm_msgs/Reach\n"
CALL = "- action: call(N)\n  service: bell\n  type: std_srvs/Trigger\n"
SAY = "- action: say(N)\n  publish: speech\n  type: std_msgs/String\n  fields: {data: '{N}'}\n"

Read = Callable[[str], AdapterFile]


@pytest.fixture
def read(tmp_path: Path) -> Read:
    def read(text: str) -> AdapterFile:
        file = tmp_path / "stack.yaml"
        file.write_text(text)
        (tmp_path / "waypoints.yaml").write_text(WAYPOINTS)
        return read_adapter(file, TYPES.get, TransformTree())

    return read


def served(*goals: Tuple[str, str]) -> List[ServedGoal]:
    return [ServedGoal(7, slot, request, f"id of {slot}", ("a", "b")) for slot, request in goals]


def fill(file: AdapterFile, action: str, *goals: Tuple[str, str]) -> Any:
    one, values = file.find("robot", parse_term(action), lambda: served(*goals))
    return one.fill(values)


def test_all_kinds_of_fields(read: Read) -> None:
    file = read(
        PLACES
        + "actions:\n"
        + REACH
        + """  fields:
    header: {frame_id: map, stamp: "{now}"}
    pose: "{W.pose}"
    names: ["{W.name}", "{{{W}}}", yes, ""]
    joints: ["{W.joint}", 1, .inf]
    force: "{W.joint}"
    tries: "{W.grip}"
    wait: 2.5
    points: [{x: "{W.x}"}, {}]
    soft: on
"""
    )
    made = fill(file, "reach(shelf)")
    assert isinstance(made["header"].pop("stamp"), Now)
    pose = made.pop("pose")
    assert pose["position"] == {"x": 1.5, "y": -2.0, "z": 0.75}
    assert 2 * math.atan2(pose["orientation"]["z"], pose["orientation"]["w"]) == pytest.approx(
        math.pi
    )
    assert made == {
        "header": {"frame_id": "map"}, "names": ["the shelf", "{shelf}", "yes", ""],
        "joints": [0.1, 1.0, math.inf], "force": 0.1, "tries": 3, "wait": 2.5,
        "points": [{"x": 1.5}, {}], "soft": True,
    }  # fmt: skip
    for action, reason in (
        ("reach(box(1))", r"the place box\(1\) in .*stack.yaml has no x and y"),
        ("reach(moon)", r"there is no place moon in .*stack.yaml; there are shelf, box\(1\)"),
        ("reach(shelf,1)", r"no entry of .*stack.yaml fits; there are reach\(W\)"),
    ):
        with pytest.raises(ActionError, match=reason):
            fill(file, action)


def test_a_waypoint_file(read: Read) -> None:
    file = read(
        "places: waypoints.yaml\nactions:\n" + REACH
        + "  fields: {header: {frame_id: '{W.frame}'}, pose: {orientation: '{W.orientation}'}}"
    )  # fmt: skip
    assert fill(file, "reach(w1)") == {
        "header": {"frame_id": "map"}, "pose": {"orientation": {"z": 0.0, "w": 1.0}},
    }  # fmt: skip


def test_arguments_that_do_not_fit(read: Read) -> None:
    file = read("actions:\n" + REACH + "  fields: {tries: '{W}', force: '1{W}', soft: true}")
    assert fill(file, "reach(5)") == {"tries": 5, "force": 15.0, "soft": True}
    assert fill(file, 'reach("5")')["tries"] == 5
    for action in ("reach(256)", "reach(-1)", "reach(a)", "reach(f(5))"):
        with pytest.raises(ActionError, match=r"line 5: fields.tries: expected an integer from 0"):
            fill(file, action)


def test_served_goals(read: Read) -> None:
    """The first entry decides whose request fits; the words are those of the slot's goal."""
    text = "- action: put({})\n  slot: ID\n  request: {}\n  publish: p\n  type: std_msgs/String\n"
    file = read(
        "actions:\n" + text.format("_,ID", "dish(T)") + "  fields: {data: '{T} {goal_id}'}\n"
        + text.format("X,ID", "drink(_)") + "  fields: {data: '{request} {information} {X}'}\n"
    )  # fmt: skip
    goals = (("2", "drink(tea)"), ("1", "dish(t3)"))
    assert fill(file, "put(2,1)", *goals) == {"data": "t3 id of 1"}
    assert fill(file, "put(1,2)", *goals) == {"data": "drink(tea) a b 1"}
    for action, reason in (
        ("put(1,3)", "fits the goal for which it is done: drink"),
        ("put(1,2)", "it names no slot of a goal"),
    ):
        with pytest.raises(ActionError, match=reason):
            fill(file, action, *(goals if "3" in action else ()))
    one = read("actions:\n- {action: 'put(ID,T)', slot: ID, request: 'dish(T)', publish: 'p{T}', "
               "type: std_msgs/String}")  # fmt: skip
    found, values = one.find("robot", parse_term("put(1,t3)"), lambda: served(("1", "dish(t3)")))
    assert found.name(values) == "pt3"
    with pytest.raises(ActionError, match=r"dish\(t4\) in slot 1"):
        fill(one, "put(1,t3)", ("1", "dish(t4)"))


def test_answers(read: Read) -> None:
    file = read(
        "actions:\n" + REACH + "  fields: {names: ['{W}']}\n  answers:\n"
        "  - {state: aborted, field: code, range: {above: 9}, answer: stuck}\n"
        "  - {field: text, pattern: ^late, answer: late(1)}\n"
        + CALL.replace("N", "_") + SAY + "- {action: beep, service: beep, type: std_srvs/Empty}\n"
        "- {action: go, publish: g, type: std_msgs/Bool, within: 5, until: {topic: h, "
        "type: std_msgs/Bool, equals: true}, answers: [{equals: false, answer: no}]}"
    )  # fmt: skip
    reach, call, say, beep, go = (one.rules for one in file.actions)

    def result(code: int = 0, text: str = "") -> SimpleNamespace:
        return SimpleNamespace(code=code, text=text)

    assert first_answer(reach, "succeeded", result()) == "success"
    assert first_answer(reach, "aborted", result()) == "failure"
    assert first_answer(reach, "aborted", result(10)) == "stuck"
    assert first_answer(reach, "succeeded", result(10, "later")) == "late(1)"
    assert first_answer(reach, "preempted", None) == "failure"
    for success, answer in ((True, "success"), (False, "failure")):
        assert first_answer(call, "", SimpleNamespace(success=success, message="")) == answer
    assert first_answer(beep, "", SimpleNamespace()) == first_answer(say, "", None) == "success"
    assert first_answer(go, "", SimpleNamespace(data=True)) == "success"
    assert first_answer(go, "", SimpleNamespace(data=False)) == "no"
    assert file.knows(parse_term("reach(1,2)"))
    assert not file.knows(parse_term("fly(1)"))
    assert not file.knows(parse_term("3"))
    warnings = unknown_answers(file, {"robot": ("failure", "success", "no"), "arm": ("stuck",)})
    assert [warning.partition(" and is")[0].rpartition("answer ")[2] for warning in warnings] == [
        "late(1) of arm,", "no of arm,", "stuck of robot,", "late(1) of robot,",
    ]  # fmt: skip


HEAD = "actions:\n"
ANY = REACH.replace("W", "_")


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("", 1, "the file is empty; it needs the key actions"),
        ("action: []", 1, "unknown key 'action'; there are actuators, leaves_unknown, places, act"),
        ("actuators: [a]", 1, "expected actions, or announce, or both"),
        ("actions: {}", 1, "expected a list with one entry or more"),
        ("actuators: a\nannounce: []", 2, "announce: expected a list with one entry or more"),
        (f"actuators: [A]\n{HEAD}{SAY}", 1, "actuators: 'A' is not a ground term"),
        (f"actuators: [[a]]\n{HEAD}{SAY}", 1, "actuators: expected a list of texts"),
        (f"leaves_unknown: 3\n{HEAD}{SAY}", 1, "leaves_unknown: expected true or false"),
        (f"places: {{a: 3}}\n{HEAD}{SAY}", 1, "a: expected a mapping"),
        (f"places: {{A: {{x: 1}}}}\n{HEAD}{SAY}", 1, "places: a name has to be a term such as c3"),
        (f"places: {{a: {{pose: 1}}}}\n{HEAD}{SAY}", 1, "pose follows from x, y and theta; give"),
        (f"places: {{a: {{x: b}}}}\n{HEAD}{SAY}", 1, "x: expected a number"),
        (f"places: {{a: {{n: }}}}\n{HEAD}{SAY}", 1, "n: expected a number or a text"),
        (f"places: {{a: {{}}, '\"a\"': {{}}}}\n{HEAD}{SAY}", 1, "places: a is there twice; remove"),
        (f"places: ~no_such_user/x\n{HEAD}{SAY}", 1, "places: Could not determine home"),
        (f"places:\n  a:\n    ? {'x' * 9000}\n    :\n{HEAD}{SAY}", 3, "... (9029 characters)"),
        (f"places: no.yaml\n{HEAD}{SAY}", 1, "places: cannot read the waypoint file"),
        (HEAD + "- action: go", 2, "expected one of actionlib, service, publish, not none"),
        (HEAD + SAY + "  service: s", 2, "not service and publish"),
        (HEAD + SAY.replace("type", "kind"), 4, "unknown key 'kind'; there are action, slot"),
        (HEAD + CALL + "  cancel: {}", 5, "unknown key 'cancel'; there are action, slot, request"),
        (HEAD + "- {action: a, publish: b}", 2, "the key type is missing"),
        (HEAD + SAY.replace("say(N)", "'say('"), 2, "action: expected a term such as go(W), not"),
        (HEAD + SAY.replace("say(N)", "3"), 2, "action: expected a term with a name, such as go(W"),
        (HEAD + SAY.replace("say(N)", "Say(N)"), 2, "action: expected a name in lower case"),
        (HEAD + SAY.replace("say(N)", "say"), 5, "fields.data: there is no 'N'; there are actu"),
        (HEAD + SAY.replace("'{N}'", "x"), 2, "N is not used; write _ for an argument that does"),
        (HEAD + SAY.replace("'{N}'", "{N}"), 5, "YAML needs quotes around braces: '{N}'"),
        (HEAD + SAY.replace("'{N}'", "'{N'"), 5, "'{': expected a name in braces, such as {W} or"),
        (HEAD + SAY.replace("'{N}'", "'{N.x}'"), 5, "no place has 'x'; there are no places"),
        (PLACES + HEAD + SAY.replace("'{N}'", "'{N.q}'"), 8, "no place has 'q'; there are x, y"),
        (PLACES + HEAD + SAY.replace("'{N}'", "'{N.pose}'"), 8, "pose is geometry_msgs/Pose, and"),
        (HEAD + SAY.replace("'{N}'", "'{now}'"), 5, "{now} is a time, and string is needed"),
        (HEAD + SAY.replace("'{N}'", "'{request}'"), 5, "name the argument that is the slot"),
        (HEAD + SAY.replace("'{N}'", ""), 5, "fields.data: expected string; write a value, or ''"),
        (HEAD + SAY.replace("data", "date"), 5, "std_msgs/String has no field 'date'; there are:"),
        (HEAD + SAY.replace("{data: '{N}'}", "[1]"), 5, "expected std_msgs/String, not a list"),
        (HEAD + SAY + "  slot: ID", 6, "slot: expected a variable of the action, not 'ID'; there"),
        (HEAD + SAY + "  request: dish(T)", 6, "request: name the argument that is the slot"),
        (HEAD + SAY + "  slot: N\n  request: dish(T)", 7, "T is not used; write _ for an argument"),
        (HEAD + SAY.replace("std_msgs/String", "x/Y"), 4, "there is no type of message 'x/Y' here"),
        (HEAD + CALL.replace("Trigger", "Tigger"), 4, "there is no type of service 'std_srvs/Tig"),
        (HEAD + REACH.replace("Reach", "Grab"), 4, "there is no type of action 'arm_msgs/Grab'"),
        (HEAD + SAY.replace("speech", "'a b'"), 3, "publish: 'a b' is no name of ROS"),
        (HEAD + SAY.replace("speech", "'a{M}'"), 3, "publish: there is no 'M'; there are N, actua"),
        (HEAD + SAY + "  within: -1", 6, "within: expected a number of seconds from 0 on"),
        (HEAD + SAY + "  after_crash: redo", 6, "after_crash: expected one of again, fail, u"),
        (HEAD + SAY + "  answers: [{answer: a}]", 6, "there is no message to decide by; add until"),
        (HEAD + SAY + "  until: {topic: d}", 6, "the key type of until is missing"),
        (HEAD + SAY + "  until: {topic: d, type: std_msgs/Bool}\n  within: 1", 6,
         "until: expected a condition of range, pattern, equals"),
        (HEAD + SAY + "  until: {topic: d, type: std_msgs/Bool, equals: true}", 6,
         "until needs within: after how many seconds the action fails"),
        (HEAD + SAY + "  until: {topic: d, type: std_msgs/Bool, equals: 3}\n  within: 1", 6,
         "field: data of std_msgs/Bool is bool; an integer is needed"),
        (HEAD + SAY + "  until: {topic: d, type: std_msgs/No, equals: 3}\n  within: 1", 6,
         "type: there is no type of message 'std_msgs/No' here"),
        (HEAD + CALL.replace("N", "_") + "  answers: [{answer: 'A'}]", 5, "answer: 'A' is not a"),
        (HEAD + CALL.replace("N", "_") + "  answers: [{answer: a, state: aborted}]", 5,
         "unknown key 'state'; there are field, range"),
        (HEAD + CALL.replace("N", "_") + "  answers: [{answer: a}, {answer: b}]", 5,
         "the answer of line 5 is always given, and that of line 5 never; put the former last"),
        (HEAD + CALL.replace("N", "_") + "  answers: [{field: success, answer: a}]", 5,
         "field: expected one condition of range, pattern, equals with it"),
        (HEAD + CALL.replace("N", "_") + "  answers: [{field: code, equals: 1, answer: a}]", 5,
         "field: code: std_srvs/TriggerResponse has no field code; there are: success, message"),
        (HEAD + CALL.replace("N", "_") + "  answers: [{equals: 1, pattern: a, answer: a}]", 5,
         "expected one condition, not pattern and equals"),
        (HEAD + REACH + "  answers: [{state: lost, answer: a}]", 2, "W is not used"),
        (HEAD + ANY + "  answers: [{state: lost, answer: a}]", 5,
         "state: expected one of succeeded, aborted"),
        (HEAD + ANY + "  progress: text", 5, "progress: field: text of arm_msg"),
        (HEAD + ANY + "  fields: {joints: [1, 2]}", 5, "expected 3 entries, no"),
        (HEAD + ANY + "  fields: {joints: 1}", 5, "fields.joints: expected a list"),
        (HEAD + ANY + "  fields: {tries: 256}", 5, "from 0 to 255 (uint8), not"),
        (HEAD + ANY + "  fields: {tries: 1.5}", 5, "expected an integer from 0"),
        (HEAD + ANY + "  fields: {force: 1.0e+39}", 5, "a number of 32 bits"),
        (HEAD + ANY + "  fields: {force: much}", 5, "expected a number (float32"),
        (HEAD + ANY + "  fields: {soft: 1}", 5, "expected true or false (bool)"),
        (HEAD + ANY + "  fields: {wait: soon}", 5, "expected a number (duration"),
        (HEAD + ANY + "  fields: {wait: 1.0e+10}", 5, "expected seconds (durat"),
        (HEAD + ANY + "  fields: {pose: here}", 5, "expected the fields of geom"),
        (HEAD + REACH + "  fields: {pose: '{W}'}", 5, "{W} is a text or a number, and geometr"),
        (HEAD + REACH + "  fields: {header: {stamp: 'at {W}'}}", 5, "expected time, and 'at {W}'"),
        (PLACES + HEAD + REACH + "  fields: {tries: '{W.name}'}", 8,
         "the name of the place shelf: expected an integer from 0 to 255 (uint8), not 'the shelf'"),
        ("announce:\n- {topic: t, tell: a}", 2, "expected one condition of range, pattern, equals"),
    ],
)  # fmt: skip
def test_each_mistake_is_refused_by_line(
    read: Read, tmp_path: Path, text: str, line: int, message: str
) -> None:
    with pytest.raises(EntryError) as raised:
        read(text)
    said = str(raised.value)
    assert said.startswith(f"{tmp_path / 'stack.yaml'}, line {line}: "), said
    assert message in said


def test_what_a_file_announces(read: Read) -> None:
    file = read("announce:\n- {topic: door, equals: true, tell: open}\n")
    assert [one.terms for one in file.observers] == [("open",)]
    assert file.actions == ()


@pytest.mark.parametrize(
    ("pattern", "term", "bound"),
    [
        ("go(W)", "go(c(4))", {"W": "c(4)"}),
        ("go(W)", 'go("Main hall")', {"W": "Main hall"}),
        ("go(W,W)", "go(a,a)", {"W": "a"}),
        ("go(W,W)", "go(a,b)", None),
        ("go(W,_,_)", "go(a,b,c)", {"W": "a"}),
        ("go(at(X,Y))", "go(at(1,-2))", {"X": "1", "Y": "-2"}),
        ("go((X,Y))", "go((1,2))", {"X": "1", "Y": "2"}),
        ('say("W",v_0)', 'say("W",v_0)', {}),
        ("go(W)", "-go(a)", None),
        ("go(W)", "go(a,b)", None),
        ("go(_W')", "go(a)", None),
        ("stop", "stop", {}),
    ],
)
def test_patterns(pattern: str, term: str, bound: Any) -> None:
    if "'" in pattern:
        with pytest.raises(EntryError):
            TermPattern.parse(pattern)
    else:
        assert TermPattern.parse(pattern).match(parse_term(term)) == bound


def test_every_kind_has_bounds() -> None:
    for kind, text in (("int8", "-128"), ("uint64", str(2**64 - 1)), ("float64", "1e308")):
        assert str(convert(kind, text)) == text.replace("1e308", "1e+308")
    for kind, text in (("int8", "128"), ("uint64", "-1"), ("time", "-1"), ("int32", "\u0661")):
        with pytest.raises(ValueError, match="expected"):
            convert(kind, text)
