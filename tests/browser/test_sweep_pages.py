"""The pages of sweeps in a browser: a click or a slider chooses a point, its command repeats it; phone, dark, print."""

from __future__ import annotations

import json
import shlex
from pathlib import Path

import numpy as np
import pytest
from selenium import webdriver
from selenium.webdriver.common.actions.action_builder import ActionBuilder
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

import impactlab as il
from tests.browser.support import console, faults, look, made_once, requests, show
from tests.cases.support import CASES
from tests.support import invoke

pytestmark = [pytest.mark.browser, pytest.mark.slow]
MASS, GAP = "bodies.hammer.mass", "contacts.0.gap"
ASKED = ("--quantities", "contacts,restitution,impulse")
MASSES = ("--over", f"{MASS}=0.5 kg:5 kg:7log")
ARGUMENTS = {
    "map": ("--method", "continuous", *MASSES, "--over", f"{GAP}=0,0.1 mm,0.3 mm", *ASKED),
    "line": ("--method", "continuous", *MASSES, *ASKED),
    "words": ("--over", "method=base,continuous", "--over", f"{MASS}=1,2", *ASKED),
    "failed": ("--over", "contacts.0.law={kind: hertz, stiffness: 1e9},{kind: wave_identification}",
               "--over", "bodies.rod.ends.left=free,{mass: 1.0}", *ASKED),
    "three": ("--over", "method=continuous,penalty", "--over", f"{MASS}=1,2", "--over", f"{GAP}=0,1e-4", *ASKED),
}  # fmt: skip


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    def make(folder: Path) -> None:
        for name, arguments in ARGUMENTS.items():
            case = str(CASES / "axial_impact.yaml")
            written = invoke("sweep", case, *arguments, "--out", str(folder / name))
            assert written.exit_code == 0, written.stderr

    folder = made_once(tmp_path_factory, "sweep_pages", make)
    return {name: folder / name / "index.html" for name in ARGUMENTS}


def values(driver: webdriver.Chrome) -> list[str]:
    return [each.text for each in driver.find_elements(By.CSS_SELECTOR, "#values b")]


@pytest.mark.parametrize("name", ARGUMENTS)
def test_every_page_is_silent_alone_and_accessible(pages, browser, name):
    for dark in (False, True):
        show(browser, pages[name], dark=dark)
        assert faults(browser) == []
    assert console(browser) == []
    assert requests(browser) == []
    show(browser, pages[name], width=400)
    assert browser.execute_script("return document.documentElement.scrollWidth") <= 400


def test_a_click_shows_the_point_and_its_command_repeats_it(pages, browser, monkeypatch):
    show(browser, pages["map"])
    panel = browser.find_element(By.CSS_SELECTOR, "#impulse .mark")
    browser.execute_script("scrollBy(0, arguments[0].getBoundingClientRect().top - 20)", panel)
    box = browser.execute_script("return arguments[0].getBoundingClientRect().toJSON()", panel)
    click = ActionBuilder(browser)
    click.pointer_action.move_to_location(int(box["x"] + 0.92 * box["width"]), int(box["y"] + 0.6 * box["height"]))
    click.pointer_action.click()
    click.perform()
    found = il.open_sweep(pages["map"].parent)
    assert browser.execute_script("return impactlab.state.at") == [6, 1]
    point = found.isel({MASS: 6, GAP: 1})
    contacts, restitution, impulse = values(browser)
    assert int(contacts) == point["contacts"].item()
    assert restitution == "–"  # the mass has not parted at the end of the run
    assert np.isnan(point["restitution"].item())
    assert float(impulse.split()[0]) == pytest.approx(point["impulse"].item(), rel=1e-5)
    command = shlex.split(browser.find_element(By.ID, "command").text)
    monkeypatch.chdir(CASES)
    summary = json.loads(invoke(*command[1:], "--json").stdout)
    assert sum(span["impulse"] for span in summary["contacts"]) == point["impulse"].item()
    browser.find_element(By.ID, "copy").click()
    assert browser.find_element(By.ID, "copy").text == "Copied"


def test_the_keyboard_moves_the_point_in_all_figures(pages, browser):
    show(browser, pages["map"])
    marks = "return [...document.querySelectorAll('.mark b')].map((mark) => mark.style.left)"
    before = browser.execute_script(marks)
    browser.find_element(By.ID, "axis-0").send_keys(Keys.ARROW_RIGHT)
    assert browser.execute_script("return impactlab.state.at") == [4, 1]
    after = browser.execute_script(marks)
    assert len(after) == 3
    assert len(set(after)) == 1
    assert after != before
    assert browser.find_element(By.ID, "axis-0").get_attribute("aria-valuetext").endswith("kg")


def test_words_stand_on_the_page_and_a_method_in_the_command(pages, browser):
    show(browser, pages["words"])
    browser.find_element(By.ID, "axis-0").send_keys(Keys.ARROW_RIGHT)
    assert "--method continuous" in browser.find_element(By.ID, "command").text
    assert browser.find_element(By.CSS_SELECTOR, "#axes output").text == "continuous"


def test_a_point_without_values_shows_the_reason(pages, browser):
    show(browser, pages["failed"])
    found = il.open_sweep(pages["failed"].parent)
    place = [int(each[0]) for each in (found["status"].values != 1).nonzero()]
    for axis, at in enumerate(place):
        browser.find_element(By.ID, f"axis-{axis}").send_keys(Keys.HOME, *[Keys.ARROW_RIGHT] * at)
    assert "refused" in browser.find_element(By.ID, "number").text
    assert "mass" in browser.find_element(By.ID, "reason").text
    assert set(values(browser)) == {"–"}


def test_more_axes_have_sliders_and_figures_without_marks(pages, browser):
    show(browser, pages["three"])
    assert [each.get_attribute("id") for each in browser.find_elements(By.TAG_NAME, "figure")] == ASKED[1].split(",")
    assert browser.find_elements(By.CLASS_NAME, "mark") == []
    browser.find_element(By.CLASS_NAME, "frame").click()
    browser.find_element(By.ID, "axis-2").send_keys(Keys.ARROW_RIGHT)
    assert f"{GAP}=0.0001" in browser.find_element(By.ID, "command").text


def test_paper_and_no_script_show_the_figures(pages, browser):
    show(browser, pages["line"])
    look(browser, printed=True)
    shown = "return [...document.querySelectorAll('figure, #point')].map((each) => each.offsetHeight > 0)"
    assert browser.execute_script(shown) == [True, True, True, False]
    show(browser, pages["line"], script=False)
    assert all(figure.is_displayed() for figure in browser.find_elements(By.TAG_NAME, "figure"))
    assert not browser.find_element(By.ID, "point").is_displayed()
    show(browser, pages["line"])  # scripts on again
