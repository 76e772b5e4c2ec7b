"""Headless Chromium: a browser without network, its console messages, its requests, its faults of accessibility."""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import shutil
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import axe_core_python
import pytest
from selenium import webdriver
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.by import By

AXE = Path(axe_core_python.__file__).with_name("axe.min.js")
ARGUMENTS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
PATIENCE = 20.0  # s, for a page to be ready


def made_once(factory: pytest.TempPathFactory, name: str, make: Callable[[Path], None]) -> Path:
    """Return a folder that the first worker which asks for it fills: the tests of a module run in several of them."""
    whole = factory.getbasetemp()
    folder = (whole.parent if "PYTEST_XDIST_WORKER" in os.environ else whole) / name
    with folder.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        done = folder / "done"
        if not done.exists():  # also where a worker failed half way: the next one fails alike
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
            make(folder)
            done.touch()
    return folder


@contextlib.contextmanager
def chromium() -> Iterator[webdriver.Chrome]:
    """Give a browser; it needs the programs chromium and chromedriver (Debian: chromium, chromium-driver)."""
    options = webdriver.ChromeOptions()
    options.binary_location = _program("chromium")
    for argument in ARGUMENTS:
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service(_program("chromedriver")))
    try:
        yield driver
    finally:
        driver.quit()


def _program(name: str) -> str:
    found = shutil.which(name)
    assert found, f"the tests of pages need the program {name}; leave them out by -m 'not browser'"
    return found


def show(
    driver: webdriver.Chrome,
    page: Path,
    *,
    width: int = 1280,
    dark: bool = False,
    script: bool = True,
    wait: bool = True,
) -> webdriver.Chrome:
    """Open a page at a width [px], light or dark; of a live page wait until all is drawn.

    Without scripts the browser may return before it has read the whole page: then wait until nothing is added.
    """
    look(driver, width=width, dark=dark)
    driver.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": not script})
    driver.get_log("browser"), driver.get_log("performance")
    driver.get(page.absolute().as_uri())
    until = time.monotonic() + PATIENCE
    while script and wait and not driver.execute_script("return Boolean(window.impactlab && window.impactlab.drawn)"):
        assert time.monotonic() < until, driver.get_log("browser")
        time.sleep(0.02)
    before = -1
    while not script and before != (before := len(driver.find_elements(By.CSS_SELECTOR, "section, figure, img"))):
        time.sleep(0.2)
    return driver


def look(driver: webdriver.Chrome, *, width: int = 1280, dark: bool = False, printed: bool = False) -> None:
    """Set the width of the window [px], the colour scheme and the medium."""
    size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    scheme = [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": scheme, "media": "print" if printed else ""})


def console(driver: webdriver.Chrome) -> list[str]:
    """Return the messages on the console since the page was opened."""
    return [entry["message"] for entry in driver.get_log("browser")]


def requests(driver: webdriver.Chrome) -> list[str]:
    """Return the addresses that were asked for since the page was opened, besides its own file and its data."""
    entries = [json.loads(entry["message"])["message"] for entry in driver.get_log("performance")]
    sent = [entry["params"]["request"]["url"] for entry in entries if entry["method"] == "Network.requestWillBeSent"]
    return [url for url in sent if not url.startswith(("file:", "data:", "blob:"))]


def faults(driver: webdriver.Chrome) -> list[str]:
    """Return the serious and critical faults of accessibility that axe finds, with the places of each.

    All rules are checked; places are collected of those alone that are broken, which takes a third less time.
    """
    driver.execute_script(AXE.read_text(encoding="utf-8"))
    found: dict[str, Any] = driver.execute_async_script(
        "const done = arguments[0], broken = {resultTypes: ['violations']}; axe.run(broken).then(done, (error) => "
        "done({violations: [{id: String(error), impact: 'critical', nodes: []}]}));"
    )
    return [
        f"{fault['id']}: {[node['target'] for node in fault['nodes']][:5]}"
        for fault in found["violations"]
        if fault["impact"] in ("serious", "critical")
    ]
