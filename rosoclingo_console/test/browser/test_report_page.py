"""The page of report.py in Chromium: opened from a file, without a server.

Needs a sourced workspace, Chromium and Selenium; ``scripts/test browser`` runs it.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Iterator, List

import pytest
from browser import PHONE, SCREEN, Browser, browsing, violations
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

from rosoclingo.bags.holds import OperatorDecisions
from rosoclingo.bags.read.reader import read_recording
from rosoclingo.bags.report.page import render
from rosoclingo.bags.report.statistics import compute
from rosoclingo.loop.journal import BeliefsChanged

BAG = Path(__file__).resolve().parents[3] / "test" / "bags" / "mailbot_dynamic_reset.bag"


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with browsing() as one:
        yield one


@pytest.fixture(scope="module")
def link(tmp_path_factory: pytest.TempPathFactory) -> str:
    held = ((0.2, OperatorDecisions(True)), (0.4, OperatorDecisions()))
    recording = read_recording(BAG)
    belief = BeliefsChanged(("belief(1,2,shut)",))
    believed = replace(recording.entries[-1], event=belief, seconds=0.5)
    entries = sorted((*recording.entries, believed), key=lambda entry: entry.seconds)
    recording = replace(recording, entries=tuple(entries), held=held)
    file = tmp_path_factory.mktemp("report") / "run.html"
    file.write_text(render(recording, compute(recording), BAG), encoding="utf-8")
    return file.as_uri()


def texts(browser: Browser, css: str) -> List[str]:
    found: List[str] = browser.run(
        f"return [...document.querySelectorAll('{css}')].map((one) => one.textContent)"
    )
    return found


@pytest.mark.costly
@pytest.mark.parametrize("size", [PHONE, SCREEN], ids=["phone", "screen"])
def test_bars_have_signs_and_words(browser: Browser, link: str, size: object) -> None:
    browser.show(link, size)
    browser.sees(" to ", "#section")
    drawn = texts(browser, "#timeline text")
    assert [one for one in drawn if one.startswith("✓")]  # done
    assert {"goals", "messages", "plan changes", "searches", "operator"} <= set(drawn)
    assert [one for one in drawn if one.startswith("‖")]  # held by an operator
    assert "believed" in drawn
    assert [one for one in drawn if one.startswith("≈")]
    assert "shut" in texts(browser, "#beliefs td")
    assert all(texts(browser, "#legend .sample text"))
    assert texts(browser, "#axis text")
    colours = "return [...document.querySelectorAll('rect.bar')].map((one) => getComputedStyle(one)"
    assert len(set(browser.run(f"{colours}.fill)"))) > 3
    wide = "return document.scrollingElement.scrollWidth - document.documentElement.clientWidth"
    assert browser.run(wide) <= 0
    assert violations(browser) == ""
    assert not browser.complaints()


@pytest.mark.costly
def test_it_zooms_and_tells(browser: Browser, link: str) -> None:
    browser.show(link)
    browser.sees(" to ", "#section")
    (whole,) = texts(browser, "#section")
    browser.click("+")
    browser.sees_no(whole, "#section")
    browser.click("all")
    browser.sees(whole, "#section")
    scroller = browser.driver.find_element(By.ID, "scroller")
    scroller.send_keys("+")
    browser.sees_no(whole, "#section")
    scroller.send_keys("0", Keys.NULL)
    browser.sees(whole, "#section")

    bar = browser.driver.find_element(By.CSS_SELECTOR, "#timeline rect.success:not(.solid)")
    ActionChains(browser.driver).move_to_element(bar).perform()
    (title,) = texts(browser, "#timeline rect title")
    assert "answer: success" in title
    bar.click()
    browser.sees("answer: success", "#details")
    browser.driver.find_element(By.CSS_SELECTOR, "#changes tr.go").click()
    browser.sees("what came before: ", "#details")
    browser.sees_no(whole, "#section")
    browser.driver.find_element(By.CSS_SELECTOR, "#charts rect[fill=transparent]").click()
    browser.sees("since the start", "#details")
    assert not browser.complaints()


@pytest.mark.costly
def test_its_policy_lets_nothing_else_run(browser: Browser, link: str) -> None:
    browser.show(link)
    browser.sees(" to ", "#section")
    browser.run("document.body.setAttribute('onclick', 'window.hacked = 1')")
    browser.run("document.body.click()")
    assert not browser.run("return window.hacked")
    assert browser.complaints()  # which come from this test
