"""What the graph's markers show, from messages to shapes."""

from __future__ import annotations

from pathlib import Path
from typing import Dict, List, Tuple

import pytest

from rosclingo.errors import TermError
from rosoclingo.drawing.shapes import DELIVERED, PACKAGE, Shape, draw
from rosoclingo.drawing.situation import MapSituation, Package
from rosoclingo.encodings.graph import Graph, GraphError, read_graph
from rosoclingo_rviz.ros.messages import MarkerFileError, marker_array, read_markers

REPOSITORY = Path(__file__).resolve().parents[3]
INSTANCE = REPOSITORY / "rosoclingo_aspprograms" / "mailbot" / "instances" / "graph_wg.lp"

# A line of three waypoints, four metres apart.
GRAPH = Graph(
    {"a": (0.0, 0.0), "b": (4.0, 0.0), "c": (8.0, 0.0)}, (("a", "b"), ("b", "c")), {"r": "a"}
)


@pytest.fixture
def situation() -> MapSituation:
    return MapSituation(GRAPH)


def act(situation: MapSituation, action: str, answer: str = "success") -> None:
    situation.begin_action("r", action)
    situation.hear("r", answer)


def drawn(situation: MapSituation, group: str) -> List[Shape]:
    return [shape for shape in draw(GRAPH, situation) if shape.group == group]


def texts(situation: MapSituation, group: str) -> List[str]:
    return [shape.text for shape in drawn(situation, group) if shape.kind == "text"]


def places(situation: MapSituation) -> List[Tuple[str, str]]:
    """Returns for each package its label, and its place or robot."""
    return [(package.label, package.place or package.robot) for package in situation.packages]


def instance(folder: Path, text: str) -> List[str]:
    path = folder / "graph.lp"
    path.write_text(text)
    return [str(path)]


@pytest.mark.parametrize(
    "wrong",
    [
        "header: {stamp: -1}", "header: {stamp: {secs: -1}}", "lifetime: {secs: .inf}",
        "color: {r: 1.0e+300}", "id: 3000000000", "id: x", "nothing: 1",
    ],
)  # fmt: skip
def test_markers_that_no_message_holds(tmp_path: Path, wrong: str) -> None:
    file = tmp_path / "markers.yaml"
    file.write_text("markers: [{ns: walls, id: 3}]")
    assert [marker.id for marker in read_markers(str(file))] == [3]
    file.write_text(f"markers: [{{{wrong}}}]")
    with pytest.raises(MarkerFileError, match=r"is no visualization_msgs/MarkerArray: "):
        read_markers(str(file))


def test_progress_is_written_behind_the_robot(situation: MapSituation) -> None:
    assert not situation.set_progress(7, 0.5)  # whose that is comes later
    situation.set_numbers({7: "r", 8: "door"})
    assert situation.set_progress(7, 0.5)
    assert not situation.set_progress(7, 0.5)
    assert not any(situation.set_progress(7, unknown) for unknown in (-1.0, 2.0, float("nan")))
    assert not situation.set_progress(8, 0.5)  # it is no robot
    (shape,) = drawn(situation, "progress")
    assert (shape.text, shape.robot) == ("50%", "r")
    situation.set_numbers({9: "r"})
    assert not drawn(situation, "progress")


def test_the_office_has_all_that_the_instance_says() -> None:
    graph = read_graph([str(INSTANCE)])
    assert graph.places["open1"] == (7.0, -8.0)
    assert len(graph.places) == len(graph.edges) == 23
    assert graph.starts == {"mailbot": "open1"}


def test_an_instance_may_have_rules_and_several_files(tmp_path: Path) -> None:
    files = instance(
        tmp_path,
        "connection(c(I),c(I+1)) :- I=1..2. connection(c(2),c(1)). start(r,c(1)).",
    )
    more = tmp_path / "more.lp"
    more.write_text("position(c(I),10*I,-5) :- I=1..3.")
    graph = read_graph([*files, str(more)])
    assert graph.places == {"c(1)": (1.0, -0.5), "c(2)": (2.0, -0.5), "c(3)": (3.0, -0.5)}
    assert graph.edges == (("c(1)", "c(2)"), ("c(2)", "c(3)"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("connection(a,b). position(a,1,2).", r"no coordinates of b; add facts position\(b,X,Y\)"),
        ("connection(1..9,0).", r"no coordinates of 0, 1, 2, 3, 4, \.\.\.; add facts"),
        ("connection(a,a). position(a,1,2). position(a,1,3).", "a has another position, too"),
        ("connection(a,a). position(a,x,2).", "expected two integers, decimetres"),
        ("start(r,a).", r"there is no connection\(V,W\); name the file of an instance"),
        ("connection(a,b", "graph.lp:.*: error: syntax error"),
    ],
)
def test_an_instance_that_cannot_be_drawn(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(GraphError, match=message) as raised:
        read_graph(instance(tmp_path, text))
    assert "graph.lp" in str(raised.value)


def test_a_file_that_is_not_there() -> None:
    with pytest.raises(GraphError, match=r"there is no file none.lp; check the path"):
        read_graph(["none.lp"])


def test_the_graph_is_drawn_with_names(situation: MapSituation) -> None:
    assert texts(situation, "names") == ["a", "b", "c"]
    (ways,) = drawn(situation, "ways")
    assert [point[:2] for point in ways.points] == [(0, 0), (4, 0), (4, 0), (8, 0)]
    (robot,) = drawn(situation, "robots")
    assert robot.robot == "r"
    assert not drawn(situation, "blocked ways")


def test_a_way_that_is_said_to_be_blocked_is_red_until_it_is_free(
    situation: MapSituation,
) -> None:
    situation.hear("info", "blocked(b,a)")
    (blocked,) = drawn(situation, "blocked ways")
    assert [point[:2] for point in blocked.points] == [(0, 0), (4, 0)]
    assert len(drawn(situation, "ways")[0].points) == 2
    situation.hear("info", "unblocked(a,b)")
    assert not drawn(situation, "blocked ways")
    situation.hear("someone", "blocked(a,b)")
    situation.hear("info", "blocked(a,nowhere)")
    assert not drawn(situation, "blocked ways")


def test_a_way_that_a_robot_has_gone_is_free(situation: MapSituation) -> None:
    situation.hear("info", "blocked(a,b)")
    act(situation, "go(b)")
    assert situation.positions == {"r": "b"}
    assert not situation.blocked


def test_a_way_where_the_robot_fails_is_blocked(situation: MapSituation) -> None:
    act(situation, "go(b)")
    act(situation, "go(c)", "failure")
    assert situation.positions == {"r": "b"}
    assert situation.blocked == {frozenset("bc")}
    act(situation, "pickup(1)", "failure")
    assert situation.blocked == {frozenset("bc")}


def test_a_robot_that_is_said_to_be_elsewhere_is_there(situation: MapSituation) -> None:
    situation.begin_action("r", "go(b)")
    for said in ("at(r,c)", "at(r,nowhere)", "at(door,a)", "at(r)"):
        situation.hear("info", said)
    assert situation.positions == {"r": "c"}
    situation.hear("r", "failure")  # on the way that it was to go
    assert situation.positions == {"r": "c"}
    assert situation.blocked == {frozenset("ab")}


def test_an_answer_that_overtakes_its_action_counts(situation: MapSituation) -> None:
    situation.hear("r", "success")
    situation.begin_action("r", "go(b)")
    assert situation.positions == {"r": "b"}
    situation.begin_action("r", "go(c)")
    assert situation.positions == {"r": "b"}


def test_what_others_say_is_no_answer(situation: MapSituation) -> None:
    situation.begin_action("r", "go(b)")
    situation.hear("arm", "success")
    situation.hear("r", "battery(low)")
    assert situation.positions == {"r": "a"}
    situation.begin_action("arm", "no term (")
    assert situation.positions == {"r": "a"}


def test_the_plan_shows_its_steps_on_both_sides_of_a_way(situation: MapSituation) -> None:
    situation.set_plan(
        ["do(r,go(b),3)", "do(r,pickup(1),4)", "do(r,go(a),5)", "do(r,go(b),7)", "do(r,go(c),8)"]
    )
    arrows = [tuple(point[0] for point in shape.points) for shape in drawn(situation, "plan")]
    assert arrows == [(0, 4), (4, 0), (4, 8)]
    steps = {shape.text: shape.points[0] for shape in drawn(situation, "plan's steps")}
    assert set(steps) == {"3 7", "5", "8", "4 pickup(1)"}
    assert steps["3 7"][1] < 0 < steps["5"][1]  # each to the right of its direction
    assert steps["4 pickup(1)"][0] == pytest.approx(4, abs=2)
    situation.set_plan([])
    assert not drawn(situation, "plan")


def test_a_static_modes_plan_is_shown(situation: MapSituation) -> None:
    situation.begin_action("solver", "[do(r,go(b),1),do(r,go(c),2)]")
    assert len(drawn(situation, "plan")) == 2
    situation.begin_action("solver", "[]")
    assert not drawn(situation, "plan")


def test_the_plan_goes_on_where_the_robot_is(situation: MapSituation) -> None:
    situation.set_plan(["do(r,go(b),1)", "do(r,go(c),2)", "do(other,go(a),2)", "do(r,go(x),3)"])
    act(situation, "go(b)")
    (arrow,) = drawn(situation, "plan")
    assert [point[0] for point in arrow.points] == [4, 8]


def test_what_was_done_is_not_ahead_any_more(situation: MapSituation) -> None:
    situation.set_plan(["do(r,pickup(1),1)", "do(r,go(b),2)", "do(r,pickup(1),3)"])
    act(situation, "pickup(1)")
    assert [step.number for step in situation.steps] == [2, 3]


def test_a_package_is_carried_and_delivered(situation: MapSituation) -> None:
    situation.begin_goal("goal", "bring(a,c)")
    situation.begin_goal("another goal", "clean(b)")
    assert places(situation) == [("a to c", "a")]
    act(situation, "pickup(1)")
    assert places(situation) == [("a to c", "r")]
    assert not drawn(situation, "packages")
    box, text = drawn(situation, "carried packages")
    assert (box.robot, text.robot, text.text) == ("r", "r", "a to c")
    assert box.points[0][2] > drawn(situation, "robots")[0].height
    act(situation, "go(b)")
    act(situation, "go(c)")
    act(situation, "deliver(1)")
    assert drawn(situation, "packages")[0].colour == PACKAGE
    situation.end_goal("goal", succeeded=True)
    box, _ = drawn(situation, "packages")
    assert box.colour == DELIVERED
    assert box.points[0][0] == pytest.approx(8, abs=1)


@pytest.mark.parametrize("text", ["bring(a,c,urgent)", "bring(a,c,by(60))"])
def test_a_package_that_is_due(situation: MapSituation, text: str) -> None:
    situation.begin_goal("goal", text)
    assert places(situation) == [("a to c", "a")]
    act(situation, "pickup(1)")
    assert places(situation) == [("a to c", "r")]
    act(situation, "go(b)")
    act(situation, "go(c)")
    act(situation, "deliver(1)")
    situation.end_goal("goal", succeeded=True)
    assert places(situation) == [("a to c", "c")]


def test_no_marker_changes_whether_it_moves_along(situation: MapSituation) -> None:
    locked: Dict[Tuple[str, int], bool] = {}

    def show() -> None:
        message = marker_array(draw(GRAPH, situation), [], "map", lambda robot: robot)
        for marker in message.markers[1:]:  # the first one takes all away, which does not help rviz
            assert locked.setdefault((marker.ns, marker.id), marker.frame_locked) == (
                marker.frame_locked
            ), f"{marker.ns} {marker.id}"

    for goal in ("first", "second"):
        situation.begin_goal(goal, "bring(a,c)")
        show()
    for action in ("pickup(1)", "pickup(2)", "go(b)", "go(c)", "deliver(2)", "deliver(1)"):
        act(situation, action)
        show()
    for goal in ("first", "second"):
        situation.end_goal(goal, succeeded=True)
        show()
    assert {True, False} == set(locked.values())


def test_a_goal_that_ends_before_the_last_answer_is_heard(situation: MapSituation) -> None:
    situation.begin_goal("goal", "bring(a,c)")
    act(situation, "pickup(1)")
    situation.end_goal("goal", succeeded=True)
    act(situation, "deliver(1)")
    assert places(situation) == [("a to c", "c")]


def test_a_canceled_package_goes_back_and_vanishes(situation: MapSituation) -> None:
    situation.begin_goal("goal", "bring(a,c)")
    act(situation, "pickup(1)")
    act(situation, "go(b)")
    act(situation, "go(a)")
    act(situation, "deliver(1)")
    assert places(situation) == [("a to c", "a")]
    situation.end_goal("goal", succeeded=False)
    assert places(situation) == []


def test_of_two_packages_at_a_place_the_plan_tells_which(situation: MapSituation) -> None:
    situation.begin_goal("first", "bring(a,c)")
    situation.begin_goal("second", "bring(a,b)")
    situation.set_plan(["do(r,pickup(2),1)", "do(r,go(b),2)", "do(r,deliver(2),3)"])
    act(situation, "pickup(2)")
    assert places(situation) == [("a to c", "a"), ("a to b", "r")]


def test_the_papers_actions_name_origin_and_destination(situation: MapSituation) -> None:
    situation.begin_goal("first", "bring(a,c)")
    situation.begin_goal("second", "bring(a,b)")
    act(situation, "pickup(a,b)")
    assert places(situation) == [("a to c", "a"), ("a to b", "r")]
    act(situation, "go(b)")
    act(situation, "deliver(a,b)")
    assert places(situation) == [("a to c", "a"), ("a to b", "b")]


def test_an_abort_leaves_the_action_that_it_ends(situation: MapSituation) -> None:
    situation.begin_action("r", "go(b)")
    act(situation, "abort", "failure")
    assert situation.blocked == {frozenset(("a", "b"))}


def test_a_package_of_an_unknown_goal_is_shown_on_the_robot(situation: MapSituation) -> None:
    act(situation, "pickup(3)")
    assert situation.packages == [Package("package 3", "", "", "", robot="r", slot="3")]
    act(situation, "deliver(3)")
    assert situation.packages == []


def test_only_the_latest_delivered_packages_are_kept(situation: MapSituation) -> None:
    for number in range(15):
        situation.begin_goal(str(number), f"bring(a,b{number})")
        situation.end_goal(str(number), succeeded=True)
    assert [package.destination for package in situation.packages] == [
        f"b{number}" for number in range(5, 15)
    ]


@pytest.mark.parametrize("text", ["go(", "", "X", "do(r,go(b),1/0)"])
def test_a_text_that_is_no_term_changes_nothing(situation: MapSituation, text: str) -> None:
    for tell in (
        lambda: situation.hear("r", text),
        lambda: situation.hear(text, "success"),
        lambda: situation.begin_action("r", text),
        lambda: situation.begin_goal("goal", text),
        lambda: situation.set_plan(["do(r,go(b),1)", text]),
    ):
        with pytest.raises(TermError):
            tell()
    assert situation.steps == ()
    assert situation.positions == {"r": "a"}
    assert not situation.packages
