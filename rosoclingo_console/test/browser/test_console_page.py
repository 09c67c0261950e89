"""The page in Chromium: each function is clicked, against a running system.

Needs a sourced workspace, Chromium and Selenium; ``scripts/test browser`` runs it.
"""

from __future__ import annotations

import os
import signal
from pathlib import Path
from typing import Iterator, List

import pytest
from browser import PHONE, SCREEN, Browser, Shown, browsing, quoted, violations
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.remote.webelement import WebElement
from terminals import Terminals, package, terminals, wait_for

__all__ = ["terminals"]

BAGS = Path(__file__).resolve().parents[3] / "test" / "bags"
BAG = BAGS / "mailbot_dynamic_reset.bag"
SEEN = ("observes(d,failure,1)", "is_about(d,1,r,go(4))")
SHUT = (*SEEN, "belief(1,2,shut)", "speaks_for(shut,d,1)")
SEEK = """const one = document.getElementById('position'); one.value = one.max * {};
    one.dispatchEvent(new Event('input')); one.dispatchEvent(new Event('change'))"""
HIDDEN = """const texts = [...document.querySelectorAll('#picture text')];
    const all = texts.map((one) => [one.textContent, one.getBoundingClientRect()]);
    const meet = (a, b) => a.x < b.right && b.x < a.right && a.y < b.bottom && b.y < a.bottom;
    const frame = document.getElementById('picture').getBoundingClientRect();
    const leaves = (at) => at.x < frame.x - 1 || at.y < frame.y - 1 ||
        at.right > frame.right + 1 || at.bottom > frame.bottom + 1;
    return all.flatMap(([a, at], i) => [...(leaves(at) ? [a] : []), ...all.slice(i + 1)
        .filter(([, other]) => meet(at, other)).map(([b]) => `${a} and ${b}`)])"""
PLANNED = """return [...document.querySelectorAll('#drawing .bar.planned')]
    .map((one) => Number(one.getAttribute('width')))"""
WIDER = "return document.scrollingElement.scrollWidth - document.documentElement.clientWidth"
LEFT_OF_DRAWING = """const edge = document.getElementById('drawing').getBoundingClientRect().left;
    return [...document.querySelectorAll('#drawing text')]
        .filter((one) => one.getBoundingClientRect().left < edge).map((one) => one.textContent)"""
PICTURE = "getComputedStyle(document.getElementById('picture'))"
# Pixels between the run and what comes below it.
EMPTY = """const at = (id) => document.getElementById(id).getBoundingClientRect();
    const buttons = document.querySelector('#buttons').getBoundingClientRect();
    return at('goals').top - buttons.bottom"""
HEADER = 8192  # bytes: a bag of so many has messages
HOSTILE = (
    '"<img src=x onerror=hacked=1><script>hacked=1</script>\' onclick=hacked=1 javascript:hacked=1"'
)


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with browsing() as one:
        yield one


@pytest.fixture
def shown(terminals: Terminals, tmp_path: Path) -> Shown:
    return Shown(terminals, tmp_path)


def test_an_operator_clicks(browser: Browser, shown: Shown) -> None:
    """From a request to its end: pause, step, hold, release, approve, why."""
    shown.start_system("_ask_before:=go(3)")
    browser.show(shown.start_console())
    browser.sees("live", "#link")
    assert "#" not in browser.driver.current_url  # nobody sees the token there
    browser.click("Pause", "#control")
    browser.sees("The run is paused", "#attention")
    browser.request("visit(3)")
    browser.sees("visit(3)", "#goals li.open")
    browser.sees("go(2) until the run is resumed", "#actuators")
    browser.click("Step", "#control")
    browser.sees("acts", "#actuators .badge")
    browser.click("Hold robot", "#actuators")
    browser.sees("is on hold after that", "#actuators")
    browser.sees("operator", "#drawing")
    browser.click("Resume", "#control")
    browser.sees_no("The run is paused", "#attention")
    shown.answer()
    browser.sees("go(3) until", "#actuators")
    browser.click("Release robot", "#actuators")
    browser.sees("robot wants to do go(3)", "#attention")
    browser.sees("waits for an operator: robot asks for an approval", "#goals li.open")
    browser.sees("waits for an operator", "#run")
    browser.click("Why visit(3)?", "#goals")
    browser.sees("visit(3) ends in step", "#why-answer")
    browser.sees("go(3) of robot waits for an approval.", "#why-answer")
    browser.click("Close", "#why")
    browser.click("Why robot: go(3)", "#plan")
    browser.sees("If robot were not to do go(3)", "#why-answer")
    browser.driver.switch_to.active_element.send_keys(Keys.ESCAPE)
    browser.click("Approve go(3)", "#actuators")
    browser.sees("go(3)", "#drawing")
    browser.sees("robot: go(3)", "#lines li.action")
    shown.answer()
    browser.sees("succeeded", "#goals li.over .badge")
    browser.click("Hold robot", "#actuators")
    browser.sees("until it is released; nothing is planned for it", "#actuators")
    browser.request("visit(5)")
    browser.sees("waits for an operator: robot on hold", "#goals li.open")
    browser.sees("on hold", "#systems")

    text = "{step: 3, horizon: 9, actions: ['expected(1,160)', 'expected(2,160)']}"
    shown.terminals.publish("/rosoclingo/plan", "rosoclingo/ROSoClingoPlan", text)
    browser.sees("expected now", "#goals li.open")
    shown.terminals.master.setParam("/test", "/use_sim_time", True)
    shown.terminals.publish("/clock", "rosgraph_msgs/Clock", "{clock: {secs: 100, nsecs: 0}}")
    browser.sees("expected in 1:00 min of simulated time", "#goals li.open")
    equal_warnings(browser, shown)
    assert not browser.complaints()


def equal_warnings(browser: Browser, shown: Shown) -> None:
    """Equal requests that wait for the same reason stop nothing of the page."""
    for name in ("one", "two"):
        goal = f"{{goal_id: {{id: {name}}}, goal: {{request: visit(4)}}}}"
        shown.terminals.publish("/rosoclingo/goal", "rosoclingo/ROSoClingoActionGoal", goal)
        browser.sees("visit(4) is asked for", "#lines li")

    def are_told() -> bool:
        if len(browser.find("#goals li.open", "cell 4 is shut")) == 2:
            return True
        for name in ("one", "two"):  # again if another plan has come in between
            line = quoted("why: cell 4 is shut")
            text = f"{{status: {{goal_id: {{id: {name}}}}}, feedback: {{status: {line}}}}}"
            kind = "rosoclingo/ROSoClingoActionFeedback"
            shown.terminals.publish("/rosoclingo/feedback", kind, text)
        return False

    wait_for(are_told)
    browser.sees("visit(4): cell 4 is shut", "#attention")
    browser.click("Pause", "#control")
    browser.sees("The run is paused", "#attention")


@pytest.mark.costly
def test_a_refused_request_stays_in_the_form(browser: Browser, shown: Shown) -> None:
    node = shown.start_system()
    browser.show(shown.start_console())
    browser.sees("waits", "#systems")
    field = browser.driver.find_element(By.ID, "request-text")
    browser.type("request-more", "a book", end="")
    for text in ("fly(3)", "visit(77"):
        browser.type("request-text", text)
        browser.sees(f"Ask for {text}: rejected: ", "#said.bad")
        assert field.get_attribute("value") == text
    browser.request("visit(3)")
    browser.sees("accepted, in slot 1", "#said")
    browser.sees("acts", "#actuators .badge")
    browser.type("request-more", "a book", end="")
    browser.request("visit(4)")  # which is decided on when the robot has answered
    browser.sees("not decided on yet", "#said")
    node.interrupt()
    browser.sees("Ask for visit(4): ", "#said.bad")
    assert field.get_attribute("value") == "visit(4)"
    more = browser.driver.find_element(By.ID, "request-more")
    assert more.get_attribute("value") == "a book"
    assert not browser.complaints()


@pytest.mark.costly
def test_what_an_operator_refuses(browser: Browser, shown: Shown) -> None:
    """Cancel, reject, filter, halt, and a recording."""
    shown.start_system("_ask_before:=go(3)")
    browser.show(shown.start_console(f"_bags:={shown.folder}"))
    browser.click("Record", "#control")
    browser.sees("rosoclingo_2", "#run")
    browser.request("visit(5)")
    browser.sees("acts", "#actuators .badge")
    browser.confirm("Cancel visit(5)", "#goals")
    browser.sees("is to be cancelled", "#goals")
    shown.answer()
    browser.sees("cancelled", "#goals li.over .badge")

    field = browser.driver.find_element(By.ID, "message-text")
    known = "return [...document.querySelectorAll('#messages option')].map((one) => one.value)"
    wait_for(lambda: "info:close(4)" in browser.run(known))
    browser.type("message-text", "info:close(4)")
    browser.sees("sent to /rosoclingo", "#said")
    wait_for(lambda: not field.get_attribute("value"))
    browser.sees("info says close(4)", "#lines li.message")
    browser.type("message-text", "info:close(9)")
    browser.sees("declares no such event", "#said")
    browser.sees("A message was dropped", "#attention")
    assert field.get_attribute("value") == "info:close(9)"  # to be corrected

    browser.request("visit(3)")
    browser.sees("wants an approval", "#actuators")
    browser.confirm("Reject go(3)", "#actuators")
    browser.sees("the operator says: reject robot", "#lines li.operator")
    browser.type("filter", "asked for", end="")
    browser.sees_no("robot: go(2)", "#lines li")
    browser.sees("visit(5) is asked for", "#lines li")
    browser.type("filter", "a", end="")
    browser.sees("visit(5) is to be cancelled", "#lines li")
    scroll = """const list = document.getElementById('lines');
        const row = [...list.children].find((one) => one.textContent.includes('to be cancelled'));
        const top = () => row.getBoundingClientRect().top - list.getBoundingClientRect().top;"""
    browser.run(f"{scroll} list.style.height = '2em'; list.scrollTop += top() - 5")
    follow = browser.driver.find_element(By.ID, "follow")
    wait_for(lambda: follow.get_attribute("aria-pressed") == "false")
    where = browser.run(f"{scroll} return top()")
    browser.click("Halt", "#control")
    browser.sees("The run is paused", "#attention")
    browser.sees("the operator says: halt", "#lines li")
    assert abs(browser.run(f"{scroll} return top()") - where) < 1
    browser.type("filter", "visit(", end="")
    browser.sees_no("the operator says: halt", "#lines li")
    assert abs(browser.run(f"{scroll} return top()") - where) < 1
    wait_for(lambda: any(one.stat().st_size > HEADER for one in shown.folder.glob("*.bag")))
    browser.click("Stop recording", "#control")
    browser.sees("bag is written", "#said")
    assert len(list(shown.folder.glob("rosoclingo_*.bag"))) == 1
    assert not browser.complaints()


@pytest.mark.costly
def test_nothing_can_be_done_with_a_run_without_contact(browser: Browser, shown: Shown) -> None:
    node = shown.start_system("_ask_before:=go(3)")
    browser.show(shown.start_console())
    browser.request("visit(3)")
    browser.sees("acts", "#actuators .badge")
    browser.sees("Cancel", "#goals li.open button")
    browser.sees("Why", "#plan button")
    acting = (
        "#actuators button, #control button:not(.record), #goals button, #plan button, .ask button"
    )
    wait_for(lambda: any(button.is_enabled() for button in browser.find("#goals button")))
    os.killpg(node.process.pid, signal.SIGKILL)  # its goal stays open
    browser.sees("no contact", "#systems")
    wait_for(lambda: not any(button.is_enabled() for button in browser.find(acting)))
    for css in ("#actuators button", "#goals li.open button", "#plan button"):
        assert browser.find(css)
    is_as_it_was(browser, "no contact to /rosoclingo since")


def is_as_it_was(browser: Browser, words: str) -> None:
    """Says that what is shown is over, and when; no time goes by there."""
    browser.sees(words, "#link .badge.bad")
    browser.sees("what is shown is how it was", "#link")
    looks = "return getComputedStyle(document.getElementById('actuators')).filter"
    assert browser.run(looks) == "grayscale(1)"
    times = browser.driver.execute_async_script(
        "const done = arguments[0]; import('/page/store.js').then(({ now, stopped, state }) =>"
        "done([now(), stopped(), state.beat.now]))"
    )
    assert times[0] == times[1]
    browser.sees("acts", "#actuators .badge")


@pytest.mark.costly
def test_a_run_that_has_ended_is_shown_as_it_was(browser: Browser, shown: Shown) -> None:
    node = shown.start_system()
    browser.show(shown.start_console())
    browser.request("visit(3)")
    browser.sees("acts", "#actuators .badge")
    node.interrupt()
    is_as_it_was(browser, "/rosoclingo has ended at")
    shown.start_system()
    browser.sees("live", "#link .badge.good")
    browser.request("visit(3)")


@pytest.mark.costly
def test_a_robot_that_is_left_out(browser: Browser, shown: Shown) -> None:
    """It has answered that it is unknown what it has done, until it is told where it is."""
    shown.start_fleet()
    browser.show(shown.start_console())
    known = "return document.querySelectorAll('#messages option').length"
    wait_for(lambda: browser.run(known))
    browser.request("bring(o1,o2)")
    browser.sees("acts", "#actuators .badge")
    (row, *_) = browser.find("#actuators li", "▶")
    robot, action = (row.find_element(By.CSS_SELECTOR, css).text for css in ("b", ".what"))
    shown.say(robot, "unknown")
    browser.sees(f"{robot} has answered unknown to {action}", "#attention")
    browser.sees(f"left out until it is told where it is: info:at({robot},PLACE)", "#attention")
    browser.sees("left out", "#actuators .badge.warn")
    (place, *_) = browser.run(
        "return [...document.querySelectorAll('#messages option')].map((one) => one.value)"
        f".filter((one) => one.startsWith('info:at({robot},'))"
    )
    browser.type("message-text", place)
    browser.sees_no("left out", "#attention")
    browser.sees_no("left out", "#actuators .badge")


@pytest.mark.costly
def test_a_plan_in_seconds(browser: Browser, shown: Shown) -> None:
    """Bars are as long as the plan says, and the request has a lane with its deadline."""
    folder = package("rosoclingo_aspprograms") / "restaurant"
    shown.start_planner([folder / "instances" / "small.lp", folder / "restaurant.lp"])
    browser.show(shown.start_console())
    browser.request("serve(steak,t3)")
    browser.sees("acts", "#actuators .badge")
    wait_for(lambda: len(browser.run(PLANNED)) > 3, lambda: str(browser.run(PLANNED)))
    widths = browser.run(PLANNED)
    # The dish cooks for a minute, longer than the page shows; all else takes some seconds.
    assert max(widths) > 2 * sorted(widths)[-2]
    lane = [one.text for one in browser.driver.find_elements(By.CSS_SELECTOR, "#drawing text")]
    assert "serve(steak,t3)" in lane
    assert any("in time" in text for text in lane)


@pytest.mark.costly
def test_a_reason_that_is_not_found_in_time(browser: Browser, shown: Shown) -> None:
    """The page says what can be done."""
    shown.start_fleet("_why_seconds:=0.001")
    browser.show(shown.start_console())
    browser.sees("waits", "#systems")
    browser.type("message-text", "info:blocked(c1,o1)")
    browser.sees("info says blocked(c1,o1)", "#lines li.message")
    browser.request("bring(o1,o2)")
    for css in ("#attention", "#goals li.open .reason"):
        browser.sees("No reason found yet: ", css)
        browser.sees("~why_seconds gives it more time", css)
        browser.sees("Why? looks for it again", css)


@pytest.mark.costly
def test_a_key_keeps_the_focus(browser: Browser, shown: Shown) -> None:
    """Also where its button has no use any more, or is gone."""
    shown.start_system("_ask_before:=go(2)")
    browser.show(shown.start_console())
    browser.sees("waits", "#systems")
    pause = browser.driver.find_element(By.CSS_SELECTOR, "button.pause")
    resume = browser.driver.find_element(By.CSS_SELECTOR, "button.resume")
    wait_for(pause.is_enabled)
    for button, words in ((pause, "The run is paused"), (resume, "Nothing needs attention")):
        button.send_keys(Keys.ENTER)
        browser.sees(words, "#attention")
        assert browser.driver.switch_to.active_element == button
        wait_for(lambda one=button: one.get_attribute("aria-disabled") == "true")
        button.send_keys(Keys.ENTER)  # which does nothing now
        browser.sees(words, "#attention")
    browser.request("visit(3)")
    (approve,) = until_seen(browser, "#actuators button", "Approve")
    approve.send_keys(Keys.ENTER)
    browser.sees("acts", "#actuators .badge")
    assert browser.driver.switch_to.active_element.text == "Hold"
    lines = "return [...document.querySelectorAll('#lines li')].map((one) => one.textContent)"
    assert sum("the operator says: pause" in one for one in browser.run(lines)) == 1


def until_seen(browser: Browser, css: str, words: str) -> List[WebElement]:
    """Waits until there are some words, and returns the elements that have them."""
    browser.sees(words, css)
    return browser.find(css, words)


@pytest.mark.costly
@pytest.mark.parametrize(
    ("size", "scheme"), [(PHONE, "light"), (SCREEN, "dark")], ids=["phone", "screen"]
)
def test_a_fleet_with_long_names(browser: Browser, shown: Shown, size: object, scheme: str) -> None:
    """Eleven robots leave no room empty, their names are not cut by an edge, the map is dark."""
    media = {"features": [{"name": "prefers-color-scheme", "value": scheme}]}
    browser.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", media)
    shown.start_fleet()
    other = "a_system_with_quite_a_long_name_of_its_own_that_never_comes/rosoclingo"
    browser.show(shown.start_console(f"_systems:=rosoclingo {other}"), size)
    browser.sees("waits", "#systems")
    robots = [f"robot_of_the_second_floor_west_wing(number({i}))" for i in range(10, 21)]
    action = "carry(parcel_of_the_reception_desk,to(laboratory_of_the_west_wing))"
    plan = ", ".join(f"'do({robot},{action},{step})'" for step in (1, 2) for robot in robots)
    text = f"{{step: 1, horizon: 9, actions: [{plan}]}}"
    shown.terminals.publish("/rosoclingo/plan", "rosoclingo/ROSoClingoPlan", text)
    browser.sees(robots[-1], "#actuators li")
    browser.sees(robots[-1], "#plan li")
    wait_for(lambda: browser.run("return document.querySelectorAll('#picture text').length") > 10)
    wait_for(lambda: browser.run("return document.querySelectorAll('#drawing text').length") >= 11)
    assert browser.run(WIDER) <= 0
    assert browser.run(LEFT_OF_DRAWING) == []
    for css in ("#plan button", "#actuators button"):
        assert {one.size["height"] < 60 for one in browser.find(css)} == {True}
    assert violations(browser) == ""
    if scheme == "dark":
        assert browser.run(f"return {PICTURE}.filter").startswith("invert(1)")
        assert browser.run(EMPTY) < 200


@pytest.mark.costly
def test_completion_and_the_form_by_keyboard(browser: Browser, shown: Shown) -> None:
    shown.start_system()
    shown.start_robot()
    browser.show(shown.start_console(), PHONE)
    known = "return [...document.querySelectorAll('#requests option')].map((one) => one.value)"
    wait_for(lambda: "visit(6)" in browser.run(known))
    wait_for(browser.driver.find_element(By.ID, "request-send").is_enabled)
    body = browser.driver.find_element(By.TAG_NAME, "body")
    body.send_keys(Keys.TAB)
    for _ in range(40):
        active = browser.driver.switch_to.active_element
        assert browser.run("return getComputedStyle(document.activeElement).outlineStyle") != "none"
        if active.get_attribute("id") == "request-text":
            break
        active.send_keys(Keys.TAB)
    wait_for(lambda: active.get_attribute("placeholder") == "visit(1)")
    active.send_keys("visit(6)", Keys.ENTER)
    browser.sees("succeeded", "#goals .badge")
    assert browser.driver.switch_to.active_element.get_attribute("id") == "request-text"


@pytest.mark.costly
def test_nothing_of_messages_runs(browser: Browser, shown: Shown) -> None:
    """Names with markup in what comes from outside are text."""
    node = shown.start_system()
    browser.show(shown.start_console())
    browser.sees("live", "#link")
    wait_for(lambda: "/rosoclingo" in shown.terminals.subscribers("/rosoclingo/goal"))
    text = f"{{goal_id: {{id: {quoted(HOSTILE)}}}, goal: {{request: {quoted(HOSTILE)}, "
    text += f"information: [{quoted(HOSTILE)}]}}}}"
    shown.terminals.publish("/rosoclingo/goal", "rosoclingo/ROSoClingoActionGoal", text)
    shown.say("info", HOSTILE)
    shown.say(HOSTILE, HOSTILE)
    browser.type("request-text", f"visit({HOSTILE})")
    browser.sees("rejected", "#said.bad")
    for css in ("#goals li", "#lines li.goal", "#lines li.message"):
        browser.sees("<img src=x onerror=hacked=1>", css)
    assert not browser.run("return window.hacked")
    assert not browser.run("return document.querySelectorAll('main img, main script').length")
    assert not browser.complaints()
    # Even somebody who could put markup into the page would have nothing run.
    refused = "try { document.body.innerHTML = '<b>x</b>' } catch (err) { return err.name }"
    assert browser.run(refused) == "TypeError"
    handler = "try { document.body.setAttribute('onclick', 'hacked=1') } catch (err) {}"
    browser.run(handler + "document.body.click()")
    assert not browser.run("return window.hacked")
    assert browser.complaints()  # which come from this test
    node.interrupt()
    browser.sees("has ended", "#systems")


@pytest.mark.costly
def test_it_connects_again_and_says_what_is_stale(browser: Browser, shown: Shown) -> None:
    node = shown.start_system()
    browser.show(shown.start_console())
    browser.sees("waits", "#systems")
    assert shown.console is not None
    shown.console.interrupt()
    shown.console.wait()
    browser.sees("what is shown is old", "#link")
    assert browser.run("return document.body.classList.contains('stale')")
    assert not browser.driver.find_element(By.CSS_SELECTOR, "button.pause").is_enabled()
    node.interrupt()
    node.wait()
    shown.start_console()
    browser.sees("live", "#link")
    browser.sees("no contact", "#systems")
    shown.start_system()
    browser.sees("waits", "#systems")
    browser.click("Pause", "#control")
    browser.sees("The run is paused", "#attention")


@pytest.mark.costly
def test_who_has_no_token_looks(browser: Browser, shown: Shown) -> None:
    shown.start_system()
    link, _, token = shown.start_console().partition("#")
    browser.show(link)
    browser.run("sessionStorage.clear()")
    browser.show(link)
    browser.sees("You may look", "#key")
    browser.sees("waits", "#systems")
    assert not browser.driver.find_element(By.CSS_SELECTOR, "button.pause").is_enabled()
    browser.driver.find_element(By.NAME, "token").send_keys(token, Keys.ENTER)
    browser.click("Pause", "#control")
    browser.sees("The run is paused", "#attention")


@pytest.mark.costly
def test_a_recorded_run(browser: Browser, shown: Shown) -> None:
    """It is played, and shown as it was at any time; nothing of it can be changed."""
    browser.show(shown.start_bag(BAG))
    browser.sees("recorded", "#link")
    browser.sees("succeeded", "#goals li.over .badge")
    set_value = "const one = document.getElementById(arguments[0]); one.value = arguments[1];"
    set_value += "one.dispatchEvent(new Event('input')); one.dispatchEvent(new Event('change'))"
    browser.driver.execute_script(set_value, "position", "0")
    browser.sees_no("succeeded", "#goals li.over .badge")
    assert not browser.driver.find_element(By.CSS_SELECTOR, "button.pause").is_enabled()
    browser.driver.execute_script(set_value, "speed", "20")
    browser.click("Play", "#player")
    browser.sees("succeeded", "#goals li.over .badge")
    browser.driver.execute_script(set_value, "speed", "0.1")
    browser.click("Play", "#player")  # when it is through
    browser.click("Stop", "#player")
    assert violations(browser) == ""
    assert not browser.complaints()


@pytest.mark.costly
@pytest.mark.parametrize("name", ["scenario1_dyn_reset", "scenario3_dyn_reset"])
def test_no_text_on_the_map_hides_another(browser: Browser, shown: Shown, name: str) -> None:
    """Nor leaves the picture, at any time of a run in an office, and after a reload."""
    browser.show(shown.start_bag(BAGS / f"{name}.bag"))
    browser.sees("recorded", "#link")
    time = browser.driver.find_element(By.ID, "time")
    for part in (0.0, 0.25, 0.5, 0.75):
        before = time.text
        browser.run(SEEK.format(part))
        wait_for(lambda before=before: time.text != before)
        assert browser.run(HIDDEN) == []
    browser.driver.refresh()
    wait_for(lambda: browser.run("return document.querySelectorAll('#picture text').length") > 20)
    assert browser.run(HIDDEN) == []


@pytest.mark.costly
@pytest.mark.parametrize(
    ("size", "scheme"), [(PHONE, "light"), (SCREEN, "dark")], ids=["phone", "screen"]
)
def test_all_can_use_it(browser: Browser, shown: Shown, size: object, scheme: str) -> None:
    """axe-core finds nothing serious, and nothing is wider than the window."""
    media = {"features": [{"name": "prefers-color-scheme", "value": scheme}]}
    browser.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", media)
    shown.start_system("_ask_before:=go(4)")
    shown.start_robot("_delay:=1")
    browser.show(shown.start_console(), size)
    browser.request("visit(6)")
    browser.sees("wants an approval", "#actuators")
    browser.click("Why visit(6)?", "#goals")
    browser.sees("visit(6) ends in", "#why-answer")
    assert violations(browser) == ""
    browser.click("Close", "#why")
    assert violations(browser) == ""
    assert not browser.driver.find_element(By.ID, "beliefs").is_displayed()
    shown.believe(*SHUT, "belief(2,3,flat)", "speaks_for(full,d,1)", "speaks_against(full,d,2,x)")
    for text, css in (("shut", ".badge.warn"), ("flat", ".badge.quiet"), ("full", ".badge.quiet")):
        browser.sees(text, "#beliefs li:has(" + css + ")")
    browser.sees("for it: r: go(4) failure", "#beliefs li small")
    browser.sees("believed: shut", "#lines li.belief")
    assert violations(browser) == ""
    assert browser.run(WIDER) <= 0
    beside = "return document.body.clientWidth - document.getElementById('goals').offsetWidth"
    assert browser.run(beside) < 50  # pixels: there is no map beside them
