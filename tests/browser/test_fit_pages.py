"""The page of a fit in a browser: silent, alone, accessible, on a desktop and a phone, light and dark."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from selenium.webdriver.common.by import By

import impactlab as il
from tests.browser.support import console, faults, made_once, requests, show
from tests.cases.support import CASES

pytestmark = [pytest.mark.browser, pytest.mark.slow]
FORCE = "force:hammer|rod.left"
BOUNDS = {"contacts.0.law.stiffness": (5e7, 8e8), "bodies.hammer.mass": (1.0, 4.0)}


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    case = il.load_case(CASES / "axial_impact.yaml").method("continuous")
    case = case.with_("contacts.0.law", {"kind": "penalty", "stiffness": 2e8, "damping": 0.0})
    times = np.linspace(1e-6, 3.4e-4, 200)
    noise = np.convolve(np.random.default_rng(0).standard_normal(209), np.full(10, 150.0), mode="valid")
    signal = il.Signal(FORCE, times, il.run(case).evaluate(times, FORCE) + noise)

    def make(folder: Path) -> None:
        found = il.fit(case, signal, BOUNDS, shift="free", intervals="profile,bootstrap", resamples=40)
        found.write(folder, "impactlab fit")

    return made_once(tmp_path_factory, "fit_page", make) / "fit.html"


@pytest.mark.parametrize("dark", [False, True])
def test_the_page_is_silent_alone_and_accessible(page, browser, dark):
    show(browser, page, dark=dark, wait=False)
    assert faults(browser) == []
    assert console(browser) == []
    assert requests(browser) == []


def test_the_page_fits_a_phone(page, browser):
    show(browser, page, width=400, wait=False)
    assert browser.execute_script("return document.documentElement.scrollWidth") <= 400
    for figure in browser.find_elements(By.TAG_NAME, "figure"):
        [svg] = figure.find_elements(By.TAG_NAME, "svg")
        assert svg.size["height"] > 100


def test_the_page_shows_all_kinds_of_intervals_and_the_warning(page, browser):
    show(browser, page, wait=False)
    headings = [each.text for each in browser.find_elements(By.CSS_SELECTOR, "thead th")]
    assert len(headings) == 6
    cells = [each.text for each in browser.find_elements(By.CSS_SELECTOR, "tbody tr:first-child td")]
    ends = [tuple(float(end) for end in cell.split(" to ")) for cell in cells[1:]]
    assert ends[1][0] < ends[0][0] < float(cells[0].split()[0]) < ends[0][1] < ends[1][1]
    assert "neighbouring residuals have a correlation of" in browser.find_element(By.CLASS_NAME, "warnings").text
