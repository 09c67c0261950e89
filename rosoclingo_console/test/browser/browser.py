"""Chromium without a screen, and a system with a console that it shows."""

from __future__ import annotations

import contextlib
import re
import shutil
import time
from pathlib import Path
from typing import Any, Callable, Iterator, List, Optional, Sequence

import axe_core_python
from selenium import webdriver
from selenium.common.exceptions import (
    ElementNotInteractableException,
    NoSuchElementException,
    StaleElementReferenceException,
)
from selenium.webdriver.common.by import By
from selenium.webdriver.remote.webelement import WebElement
from terminals import TIMEOUT, Terminal, Terminals, package, wait_for

AXE = Path(axe_core_python.__file__).parent / "axe.min.js"
LINK = re.compile(r"open (http://\S+)")
PHONE, SCREEN = (375, 800), (1280, 1000)
_TRIES = 20  # until a system takes a request
_PASSES = (
    NoSuchElementException,
    StaleElementReferenceException,
    ElementNotInteractableException,
    IndexError,
)  # while the page changes


def start_browser() -> webdriver.Chrome:
    """Starts Chromium; says what is missing if it cannot."""
    driver, browser = shutil.which("chromedriver"), shutil.which("chromium")
    missing = [
        name for name, found in (("chromium-driver", driver), ("chromium", browser)) if not found
    ]
    assert not missing, f"{' and '.join(missing)} not installed; scripts/setup --test does that"
    options = webdriver.ChromeOptions()
    options.binary_location = browser
    for word in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage",
                 "--no-proxy-server", "--disable-background-networking"):  # fmt: skip
        options.add_argument(word)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    chrome = webdriver.Chrome(options=options, service=webdriver.ChromeService(driver))
    chrome.set_script_timeout(TIMEOUT)
    return chrome


class Browser:
    """A page, as an operator uses it: by what can be seen, named and clicked."""

    def __init__(self, driver: webdriver.Chrome) -> None:
        self.driver = driver

    def show(self, link: str, size: Any = SCREEN) -> None:
        """Opens a link in a window of a size."""
        width, height = size
        # A window of Chromium is no narrower than 500 pixels, but what it shows can be.
        self.driver.execute_cdp_cmd(
            "Emulation.setDeviceMetricsOverride",
            {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 500},
        )
        self.driver.get("about:blank")
        self.complaints()  # those of the page before
        self.driver.get(link)

    def find(self, css: str, words: str = "") -> List[WebElement]:
        """Returns the visible elements with some words."""
        return [
            one
            for one in self.driver.find_elements(By.CSS_SELECTOR, css)
            if one.is_displayed() and words in self.text(one)
        ]

    def text(self, one: WebElement) -> str:
        label = one.get_attribute("aria-label") or ""
        return f"{one.text} {label}"

    def sees(self, words: str, css: str = "body") -> None:
        """Waits until there are some words."""
        self._wait(lambda: self.find(css, words), f"no {words!r} in {css}: ")

    def sees_no(self, words: str, css: str = "body") -> None:
        """Waits until there are no such words."""
        self._wait(lambda: not self.find(css, words), f"still {words!r} in {css}: ")

    def click(self, words: str, within: str = "body") -> None:
        """Clicks the button with some words or of this name, once it can be clicked."""

        def is_clicked() -> bool:
            found = [one for one in self.find(f"{within} button", words) if one.is_enabled()]
            if found:
                self.driver.execute_script(
                    "arguments[0].scrollIntoView({block:'center'})", found[0]
                )
                found[0].click()
            return bool(found)

        self._wait(is_clicked, f"no button {words!r} in {within}: ")

    def type(self, name: str, text: str, end: str = "\n") -> None:
        """Types into the field of an id."""
        field = self.driver.find_element(By.ID, name)
        self._wait(field.is_enabled, f"{name} takes nothing: ")
        field.clear()
        field.send_keys(text + end)

    def request(self, text: str) -> None:
        """Sends a request by the form, and again as long as the system is not there."""
        field, said = (self.driver.find_element(By.ID, name) for name in ("request-text", "said"))

        def is_sent() -> bool:
            return not field.get_attribute("value")

        def is_over() -> bool:
            return is_sent() or "bad" in (said.get_attribute("class") or "")

        for _ in range(_TRIES):
            self.type("request-text", text, end="")
            self.click("Ask for it", "#request")
            self._wait(is_over, f"{text} is not sent: ")
            if is_sent():
                return
        raise AssertionError(f"{text} is not sent: {said.text}")

    def confirm(self, words: str, within: str) -> None:
        """Clicks a button that asks once more, and again as long as it asks."""
        asks = True
        while asks:
            self.click(words, within)
            asks = any("?" in one.text for one in self.find(f"{within} button", words))

    def run(self, script: str) -> Any:
        return self.driver.execute_script(script)

    def complaints(self) -> List[str]:
        """What the browser has logged: refused scripts, errors."""
        return [
            entry["message"]
            for entry in self.driver.get_log("browser")
            if entry["level"] in ("SEVERE", "WARNING")
        ]

    def _wait(self, condition: Callable[[], Any], about: str) -> None:
        def holds() -> bool:
            try:
                return bool(condition())
            except _PASSES:
                return False

        wait_for(holds, lambda: about + self.driver.find_element(By.TAG_NAME, "body").text)


class Shown:
    """A system of one node, whose robot moves on a line, and its console."""

    def __init__(self, terminals: Terminals, folder: Path) -> None:
        self.terminals = terminals
        self.folder = folder
        self.console: Optional[Terminal] = None
        self.link = ""

    def start_system(self, *parameters: str) -> Terminal:
        """Starts the node; its actions wait for :meth:`answer`."""
        return self.start_planner([package("rosoclingo") / "example" / "line.lp"], *parameters)

    def start_fleet(self, *parameters: str) -> Terminal:
        """Starts a node with two mailbots, r1 and r2."""
        mailbot = package("rosoclingo_aspprograms") / "mailbot"
        files = [mailbot / "instances" / "fleet_2.lp", mailbot / "mailbot.lp"]
        return self.start_planner(files, *parameters)

    def start_planner(self, files: Sequence[Path], *parameters: str) -> Terminal:
        """Starts the node with an encoding."""
        return self.terminals.start(
            "rosrun", "rosoclingo", "run-1.0.py", *(f"--file={one}" for one in files),
            "_why_nice:=0", "_why_seconds:=600", *parameters,
        )  # fmt: skip

    def start_bag(self, bag: Path) -> str:
        """Starts a console of a recorded run, and returns its link."""
        console = self.terminals.start(
            "rosrun", "rosoclingo_console", "console.py", str(bag), "--port", "0"
        )
        console.wait_for("open http")
        found = LINK.search(console.output)
        assert found is not None
        return found[1]

    def start_robot(self, *parameters: str) -> Terminal:
        """Starts what does all actions."""
        return self.terminals.start("rosrun", "rosoclingo_interfaces", "fulfill.py", *parameters)

    def start_console(self, *parameters: str) -> str:
        """Starts a console whose link stays the same, and returns that."""
        port = self.link.partition("/#")[0].rpartition(":")[2] or "0"
        self.console = self.terminals.start(
            "rosrun", "rosoclingo_console", "console.py", f"_port:={port}",
            f"_token_file:={self.folder / 'token'}", *parameters,
        )  # fmt: skip
        self.console.wait_for("open http")
        found = LINK.search(self.console.output)
        assert found is not None
        self.link = found[1]
        return self.link

    def answer(self, value: str = "success") -> None:
        """Answers for the robot."""
        self.say("robot", value)

    def say(self, source: str, value: str) -> None:
        text = f"{{id: {quoted(source)}, value: {quoted(value)}}}"
        self.terminals.publish("/rosoclingo/in", "rosoclingo/ROSoClingoIn", text)

    def believe(self, *terms: str) -> None:
        """Adds an event to the journal, after all others, as an encoding with causes does."""
        text = f"{{number: 99999, kind: belief, stamp: {{secs: {int(time.time())}}}, "
        text += f"details: [{', '.join(map(quoted, terms))}]}}"
        self.terminals.publish("/rosoclingo/journal", "rosoclingo/ROSoClingoEvent", text)


def quoted(text: str) -> str:
    return "'" + text.replace("'", "''") + "'"


@contextlib.contextmanager
def browsing() -> Iterator[Browser]:
    driver = start_browser()
    try:
        yield Browser(driver)
    finally:
        driver.quit()


def violations(browser: Browser) -> str:
    """Serious findings of axe-core."""
    browser.run(AXE.read_text())
    found = browser.driver.execute_async_script(
        "const done = arguments[0]; axe.run(document).then((found) => done(found.violations))"
    )
    return "\n".join(
        f"{one['impact']}: {one['help']}: {[node['html'] for node in one['nodes']]}"
        for one in found
        if one["impact"] in ("serious", "critical")
    )
