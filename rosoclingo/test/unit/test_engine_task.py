"""The planning task as data: how rows are read, what is left out, and what an execution refuses."""

from __future__ import annotations

from typing import List

import pytest

from rosoclingo.engine.flattening import flatten
from rosoclingo.engine.reading import TaskReader, plan_rows
from rosoclingo.engine.rest import begun_of, begun_plan, rest_of_plan
from rosoclingo.engine.task import Kind, PlanningTask
from rosoclingo.engine.ways import WayMap
from rosoclingo.errors import TaskError

SHOP = [
    "base_moves(r)",
    'base_way(a,"|",b,"|",1)', 'base_way(b,"|",a,"|",1)', 'base_way(b,"|",c,"|",3)',
    'base_drains(r,"|",battery,"|",2)', 'base_reserves(r,"|",battery)',
    "base_action(r,charge)", 'base_needs(r,charge,"|",at(r),"|",a)',
    'base_fills(r,charge,"|",battery)',
    "base_action(r,take)", 'base_needs(r,take,"|",at(r),"|",b)', 'base_needs(r,take,"|",box,"|",b)',
    'base_sets(r,take,"|",box,"|",r)', 'base_uses(r,take,"|",room,"|",1)',
    'base_costs(r,take,"|",4)',
    "base_action(r,put)", 'base_needs(r,put,"|",at(r),"|",a)', 'base_needs(r,put,"|",box,"|",r)',
    'base_sets(r,put,"|",box,"|",a)', 'base_gives(r,put,"|",room,"|",1)',
    "base_action(r,sing)", 'base_sets(r,sing,"|",mood,"|",good)',
]  # fmt: skip
NOW = [
    'task_is(at(r),"|",a)', 'task_is(box,"|",b)', 'task_is(battery,"|",10)', 'task_is(room,"|",1)',
    'task_limit(battery,"|",10)', 'task_limit(room,"|",1)', 'task_wish(1,"|",box,"|",a)',
]  # fmt: skip


def read(*more: str, without: str = "?", step: int = 0, followed: List[str] = []) -> PlanningTask:  # noqa: B006
    reader = TaskReader()
    reader.read_facts(row for row in SHOP if without not in row)
    return reader.read([*(row for row in NOW if without not in row), *more], followed, step)


def numbers(task: PlanningTask, *names: str) -> List[int]:
    """Returns the numbers of actions; a way is called by its two places."""
    all_names = [f"{one.start}-{one.name}" if one.start else one.name for one in task.actions]
    return [all_names.index(name) for name in names]


def test_a_plan_is_executed() -> None:
    task = read()
    done = task.execute(numbers(task, "a-b", "take", "b-a", "put"))
    assert done.met == {"1": 4}
    assert done.cost == 1 + 4 + 1 + 1
    assert done.state.values == {"at(r)": "a", "box": "a"}
    assert done.state.levels == {"battery": 6, "room": 1}


def test_what_is_not_possible_is_named() -> None:
    task = read()
    for names, text in (
        (["take"], r"action 1 of the plan, r: take, is not possible: at\(r\) is a, and not b"),
        (["a-b", "take", "take"], r"action 3 of the plan, r: take, .*: box is r, and not b"),
        (["put"], "box is b, and not r"),
    ):
        with pytest.raises(TaskError, match=text):
            task.execute(numbers(task, *names))
    full = read('task_is(room,"|",0)', without="task_is(room")
    with pytest.raises(TaskError, match="room is 0, and less than 1"):
        full.execute(numbers(full, "a-b", "take"))


def test_ways_keep_what_is_needed_to_get_to_where_it_refills() -> None:
    """It takes 2 for each length; c is 3 away from b, and no way leads back from there."""
    task = read('task_wish(1,"|",at(r),"|",c)')
    (far,) = numbers(task, "a-c")
    assert task.actions[far].cost == 4
    assert (Kind.TAKES, "battery", 8) in task.actions[far].numbers
    (near,) = numbers(task, "a-b")
    assert set(task.actions[near].numbers) == {
        (Kind.TAKES, "battery", 2), (Kind.LEAST, "battery", 4),
    }  # fmt: skip


def test_what_cannot_help_is_left_out() -> None:
    task = read()
    assert "sing" not in [one.name for one in task.actions]
    assert "c" not in [one.name for one in task.actions]
    assert "sing" in [one.name for one in read('task_wish(2,"|",mood,"|",good)').actions]


def test_what_is_out_of_reach_is_hopeless() -> None:
    assert read('task_wish(2,"|",box,"|",moon)').hopeless == ("2",)
    assert read('task_closed(a,"|",b)').hopeless == ("1",)
    assert not read('task_lately(a,"|",b,"|",4)').hopeless
    assert read('task_lately(a,"|",b,"|",5)', without="reserves").hopeless == ()
    assert read('task_lately(a,"|",b,"|",6)', without="reserves").hopeless == ("1",)
    assert read('task_wish(2,"|",battery,"|",least(11))').hopeless == ("2",)
    assert not read('task_wish(2,"|",battery,"|",most(3))').hopeless


@pytest.mark.parametrize(
    "row",
    [
        'task_uses(r,take,"|",room,"|",2)',  # three in all, and there is room for one
        'task_uses(r,take,"|",room,"|",x)',
        'task_least(r,take,"|",room,"|",2)',
        'task_most(r,take,"|",room,"|",-1)',
        'task_needs(r,take,"|",box,"|",moon)',
        'task_sets(r,take,"|",box,"|",moon)',
        'task_fills(r,take,"|",room)',
        'task_sets(r,take,"|",battery,"|",11)',
    ],
)
def test_what_can_never_be_done_is_no_action(row: str) -> None:
    assert read(row).hopeless == ("1",)


def test_two_values_are_no_task() -> None:
    with pytest.raises(TaskError, match="two values"):
        read('task_is(box,"|",a)')


def test_what_is_left_of_a_plan() -> None:
    shown = [
        'plan_way(1,"|",r,"|",b,"|",2)', 'plan_act(2,"|",r,take,"|",3)', "do(r,go(b),2)",
        'plan_way(3,"|",r,"|",a,"|",4)', 'plan_act(4,"|",r,put,"|",5)',
    ]  # fmt: skip
    followed = list(plan_rows(shown))
    assert len(followed) == 4
    task = read(followed=followed, step=1)
    assert rest_of_plan(task) == numbers(task, "a-b", "take", "b-a", "put")
    later = ['task_is(at(r),"|",b)', 'task_is(box,"|",r)', 'task_is(room,"|",0)']
    reader = TaskReader()
    reader.read_facts(SHOP)
    rows = [*later, *NOW[2:3], *NOW[4:]]
    assert rest_of_plan(reader.read(rows, followed, 3)) is not None
    again = reader.read(rows, followed, 0)  # to take it once more does not help
    assert rest_of_plan(again) == numbers(again, "b-a", "put")
    full = [*NOW[:3], 'task_is(room,"|",0)', *NOW[4:]]
    assert rest_of_plan(reader.read(full, followed, 1)) is None
    failed = reader.read([*NOW[:1], *NOW[1:], "task_failed(r,take)"], followed, 3)
    assert [len(layer) for layer in failed.left] == [1, 1, 1]


def test_a_layer_is_put_in_order() -> None:
    """What reads a value comes before what changes it."""
    reader = TaskReader()
    reader.read_facts([
        "base_action(x,shut)", 'base_sets(x,shut,"|",door,"|",shut)',
        "base_action(y,leave)", 'base_needs(y,leave,"|",door,"|",open)',
        'base_sets(y,leave,"|",room,"|",empty)',
    ])  # fmt: skip
    rows = ['task_is(door,"|",open)', 'task_is(room,"|",full)', 'task_wish(1,"|",door,"|",shut)',
            'task_wish(1,"|",room,"|",empty)']  # fmt: skip
    followed = ['plan_act(1,"|",x,shut,"|",1)', 'plan_act(1,"|",y,leave,"|",1)']
    task = reader.read(rows, followed)
    plan = rest_of_plan(task)
    assert plan is not None
    assert [task.actions[number].name for number in plan] == ["leave", "shut"]


def test_distances_and_reserves() -> None:
    ways = WayMap({("a", "b"): 2, ("b", "c"): 2, ("a", "c"): 5, ("c", "a"): 1})
    assert ways.distances("a") == {"a": 0, "b": 2, "c": 4}
    assert ways.distances("c") == {"c": 0, "a": 1, "b": 3}
    assert ways.reserves(["a"], 10, [("b", "c")]) == {"a": 0, "c": 10, "b": 10}


def test_what_served_a_request_that_is_gone_is_left_out() -> None:
    """The robot has taken the box, and nobody wants it at a any more, but at b again."""
    now = ['task_is(at(r),"|",b)', 'task_is(box,"|",r)', 'task_is(battery,"|",8)',
           'task_is(room,"|",0)', *NOW[4:6]]  # fmt: skip
    back = ["base_action(r,drop)", 'base_needs(r,drop,"|",at(r),"|",b)',
            'base_needs(r,drop,"|",box,"|",r)', 'base_sets(r,drop,"|",box,"|",b)']  # fmt: skip
    followed = ['plan_way(3,"|",r,"|",a,"|",4)', 'plan_act(4,"|",r,put,"|",5)',
                'plan_act(5,"|",r,sing,"|",6)']  # fmt: skip
    reader = TaskReader()
    reader.read_facts([*SHOP, *back])
    wishes = ['task_wish(1,"|",box,"|",b)', 'task_wish(2,"|",mood,"|",good)']
    task = reader.read([*now, *wishes], followed, 3)
    plan = rest_of_plan(task)
    assert plan is not None
    assert [task.actions[number].name for number in plan] == ["sing"]


def test_what_is_under_way_is_not_done_again() -> None:
    """The robot charges, and is to charge once more later; both would be possible now."""
    followed = ['plan_act(1,"|",r,charge,"|",9)', 'plan_way(2,"|",r,"|",b,"|",10)',
                'plan_act(3,"|",r,take,"|",11)', 'plan_way(4,"|",r,"|",a,"|",12)',
                'plan_act(5,"|",r,charge,"|",13)', 'plan_act(6,"|",r,put,"|",14)']  # fmt: skip
    reader = TaskReader()
    reader.read_facts(SHOP)
    rows = [*NOW, "task_busy(r,charge)"]
    left = [["r", "b"], ["r,take", ""], ["r", "a"], ["r,charge", ""], ["r,put", ""]]
    task = reader.read(rows, followed, 3)  # it has begun, and is to take until step 9
    assert [list(fact) for (fact,) in task.left] == left
    task = reader.read(rows, followed, 9)  # it takes longer than planned
    assert [list(fact) for (fact,) in task.left] == left


def test_what_puts_a_request_out_of_reach_is_not_begun() -> None:
    """The robot has the box, which is to be at b again; another one, s, has begun to sing."""
    now = ['task_is(at(r),"|",b)', 'task_is(box,"|",r)', 'task_is(battery,"|",8)',
           'task_is(room,"|",0)', 'task_is(hands,"|",full)', *NOW[4:6]]  # fmt: skip
    more = ['base_sets(r,put,"|",hands,"|",free)', 'base_sets(r,drop,"|",hands,"|",free)',
            "base_action(r,drop)", 'base_needs(r,drop,"|",at(r),"|",b)',
            'base_needs(r,drop,"|",box,"|",r)', 'base_sets(r,drop,"|",box,"|",b)',
            "base_action(s,hum)", 'base_sets(s,hum,"|",sound,"|",good)']  # fmt: skip
    followed = ['plan_way(3,"|",r,"|",a,"|",4)', 'plan_act(4,"|",r,put,"|",5)',
                'plan_act(5,"|",s,hum,"|",6)']  # fmt: skip
    reader = TaskReader()
    reader.read_facts([*(row for row in SHOP if "take" not in row), *more])
    for place, names in (("b", ["hum"]), ("a", ["a", "put", "hum"])):
        wishes = [f'task_wish(1,"|",box,"|",{place})', 'task_wish(2,"|",sound,"|",good)']
        free = ['task_wish(3,"|",hands,"|",free)']  # so that to put it somewhere else may help
        task = reader.read([*now, *wishes, *free], followed, 3)
        assert "put" in [action.name for action in task.actions]
        # The box can be put at a, and no action takes it from there.
        assert [task.actions[number].name for number in begun_plan(task)] == names


@pytest.mark.parametrize(("place", "is_held"), [("b", False), ("a", True)])
def test_what_has_to_ripen_where_the_robot_stands_is_not_begun(place: str, is_held: bool) -> None:
    """Where it stands it may do something else first; on its way it does not turn back."""
    followed = ['plan_way(3,"|",r,"|",b,"|",4)', 'plan_act(4,"|",r,take,"|",5)',
                'plan_way(5,"|",r,"|",a,"|",6)', 'plan_act(6,"|",r,put,"|",7)']  # fmt: skip
    now = [f'task_is(at(r),"|",{place})', *NOW[1:]]
    reader = TaskReader()
    reader.read_facts(SHOP)
    begun = ["take"] if place == "b" else ["b", "take"]
    waits = begun if is_held else []
    timed = ["task_ripening(box)", 'base_duration(r,put,"|",5)']
    for rows, names in (
        ([], begun),
        (["task_ripening(box)"], waits),
        ([*timed, 'task_since(box,"|",11)'], waits),
        ([*timed, 'task_since(box,"|",10)'], begun),
        ([*timed, 'task_since(box,"|",30)', 'task_free(r,"|",20)'], begun),
    ):
        reader.read_facts([*SHOP, *(row for row in rows if row.startswith("base_"))])
        task = reader.read([*now, *rows], followed, 3)
        plan = rest_of_plan(task)
        assert plan is not None
        assert [task.actions[number].name for number in begun_plan(task)] == names
        assert [task.actions[one].name for part in begun_of(task, plan) for one in part] == names


def test_what_another_actuator_does_first_is_not_waited_for() -> None:
    """The box is at b only when s has brought it there; r stands there, and may leave."""
    more = ["base_action(s,bring)", 'base_needs(s,bring,"|",box,"|",far)',
            'base_sets(s,bring,"|",box,"|",b)']  # fmt: skip
    followed = ['plan_act(3,"|",s,bring,"|",4)', 'plan_act(4,"|",r,take,"|",5)',
                'plan_way(5,"|",r,"|",a,"|",6)', 'plan_act(6,"|",r,put,"|",7)']  # fmt: skip
    reader = TaskReader()
    reader.read_facts([*SHOP, *more])
    task = reader.read(['task_is(at(r),"|",b)', 'task_is(box,"|",far)', *NOW[2:]], followed, 3)
    plan = rest_of_plan(task)
    assert plan is not None
    assert [task.actions[one].name for part in begun_of(task, plan) for one in part] == ["bring"]


TAP = [
    "base_action(r,turn)", 'base_sets(r,turn,"|",tap,"|",open)', "base_action(r,mop)",
    'base_needs(r,mop,"|",dry,"|",yes)', 'base_sets(r,mop,"|",tap,"|",shut)',
    "base_derived(wet)", "base_derived(damp)", "base_derived(dry)",
    'base_rule(1,"|",wet)', 'base_given(1,"|",tap,"|",open)',
    'base_rule(2,"|",damp)', 'base_given(2,"|",wet,"|",yes)',
    'base_rule(3,"|",wet)', 'base_given(3,"|",damp,"|",yes)',
    'base_rule(4,"|",dry)', 'base_given(4,"|",damp,"|",no)',
    'base_given_least(4,"|",heat,"|",2)', 'base_given_most(4,"|",heat,"|",3)',
    'base_number(heat,"|",5)',
]  # fmt: skip


@pytest.mark.parametrize(("heat", "dry"), [(1, "no"), (2, "yes"), (3, "yes"), (4, "no")])
def test_values_are_derived_after_each_action(heat: int, dry: str) -> None:
    reader = TaskReader()
    reader.read_facts(TAP)
    now = ['task_is(tap,"|",shut)', 'task_is(wet,"|",no)', 'task_is(damp,"|",no)',
           f'task_is(dry,"|",{dry})', f'task_is(heat,"|",{heat})', 'task_limit(heat,"|",5)',
           'task_wish(1,"|",damp,"|",yes)']  # fmt: skip
    task = reader.read(now)
    (turn,) = numbers(task, "turn")
    done = task.execute([turn])
    assert done.met == {"1": 1}
    assert done.state.values == {"tap": "open", "wet": "yes", "damp": "yes", "dry": "no"}
    assert task.derivation.basis("dry") == {"tap", "heat"}
    assert task.derivation.strata == {"wet": 0, "damp": 0, "dry": 1}
    assert "dry is yes if damp = no and heat >= 2 and heat <= 3" in task.lines()


def test_rules_are_numbered_in_the_order_of_the_encoding() -> None:
    """Their order was that of a set of names, so a replay could find another plan."""
    reader = TaskReader()
    reader.read_facts(TAP)
    now = ['task_is(tap,"|",shut)', 'task_is(heat,"|",2)', 'task_limit(heat,"|",5)']
    task = reader.read([*now, 'task_wish(1,"|",dry,"|",yes)'])
    needs = [len(values) + len(levels) for values, levels, _, _ in flatten(task).rules]
    assert needs == [1, 1, 1, 3]


def test_what_ends_a_derived_value_helps() -> None:
    reader = TaskReader()
    reader.read_facts(TAP)
    now = ['task_is(tap,"|",open)', 'task_is(wet,"|",yes)', 'task_is(damp,"|",yes)',
           'task_is(dry,"|",no)', 'task_is(heat,"|",2)', 'task_limit(heat,"|",5)']  # fmt: skip
    task = reader.read([*now, 'task_wish(1,"|",wet,"|",no)'])
    assert [action.name for action in task.actions] == ["mop"]
    assert task.hopeless == ()
