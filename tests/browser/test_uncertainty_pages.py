"""The page of an uncertainty in a browser: figures, tables and warnings; phone, dark, accessibility."""

from __future__ import annotations

from pathlib import Path

import pytest
from selenium.webdriver.common.by import By

from tests.browser.support import console, faults, requests, show
from tests.cases.support import CASES
from tests.support import invoke

pytestmark = [pytest.mark.browser, pytest.mark.slow]
VARY = ("--vary", "bodies.hammer.mass=normal(2.133 kg, 1 %)", "--vary", "bodies.hammer.velocity=uniform(0.9, 1.1)")


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("page") / "out"
    case = ["uncertainty", str(CASES / "axial_impact.yaml"), "--method", "continuous", *VARY, "--samples", "64"]
    written = invoke(*case, "--quantities", "final_velocity,contacts", "--out", str(out))
    assert written.exit_code == 0, written.stderr
    return out / "index.html"


def test_the_page_is_whole_silent_and_accessible_in_every_light(page, browser):
    for dark in (False, True):
        show(browser, page, dark=dark, wait=False)
        assert faults(browser) == []
    assert console(browser) == []
    assert requests(browser) == []
    assert [each.get_attribute("id") for each in browser.find_elements(By.TAG_NAME, "figure")] == [
        "contacts",
        "indices",
        "final_velocity",
    ]
    assert "the linear estimate is wrong" in browser.find_element(By.CLASS_NAME, "warnings").text
    assert browser.find_element(By.CSS_SELECTOR, "tbody small").text.startswith("±")
    show(browser, page, width=400, wait=False)
    assert browser.execute_script("return document.documentElement.scrollWidth") <= 400
