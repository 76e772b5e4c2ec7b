"""The pages of runs and comparisons in a browser: views that move together, keyboard, phone, dark, print, no script."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import pytest
from selenium import webdriver
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

from impactlab.bench.report.write import write_bench
from tests.browser.support import console, faults, look, made_once, requests, show
from tests.cases.support import CASES
from tests.support import invoke
from tests.unit.test_bench_report import HAND, written

pytestmark = [pytest.mark.browser, pytest.mark.slow]
COMMANDS = {
    "compared": ("compare", "axial_impact.yaml", "--methods", "continuous,finite_element,modal_10,impulse_momentum"),
    "train": ("run", "chain_of_bars.yaml", "--method", "continuous"),
    "stepped": ("run", "hopkinson_chain.yaml", "--method", "penalty"),
    "beam": ("run", "tube_between_stops.yaml"),
    "no contact": ("run", "step_loaded_rod.yaml"),
}


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    def make(folder: Path) -> None:
        for name, (command, case, *others) in COMMANDS.items():
            written = invoke(command, str(CASES / case), *others, "--out", str(folder / name))
            assert written.exit_code == 0, written.stderr

    folder = made_once(tmp_path_factory, "pages", make)
    return {name: folder / name / "index.html" for name in COMMANDS}


def views(driver: webdriver.Chrome) -> list[Any]:
    """Return all that follows the time: slider, words, cursors of diagram and plot, and the pixels of the scene."""
    return driver.execute_script(
        "const seen = (id) => document.getElementById(id);"
        "return [seen('time').value, seen('clock').textContent, seen('now').style.transform,"
        " document.querySelector('.plot .now').style.transform, seen('stage').toDataURL()]"
    )


@pytest.mark.parametrize("name", COMMANDS)
def test_every_page_is_silent_alone_and_accessible(pages, browser, name):
    show(browser, pages[name])
    assert faults(browser) == []
    assert "NaN" not in browser.execute_script("return document.body.innerText")  # values beside the curves
    browser.execute_script("impactlab.setTime(impactlab.state.time * 0.5)")
    assert console(browser) == []
    assert requests(browser) == []


@pytest.mark.parametrize("name", COMMANDS)
def test_no_page_scrolls_sideways_on_a_phone(pages, browser, name):
    show(browser, pages[name], width=400)
    assert browser.execute_script("return document.documentElement.scrollWidth") <= 400
    assert console(browser) == []


def test_the_slider_moves_the_scene_the_diagram_and_the_traces(pages, browser):
    show(browser, pages["compared"])
    before = views(browser)
    browser.find_element(By.ID, "time").send_keys(*[Keys.ARROW_RIGHT] * 40)
    after = views(browser)
    assert [a != b for a, b in zip(before, after, strict=True)] == [True] * 5
    assert int(after[0]) == int(before[0]) + 40


def test_a_click_in_the_diagram_sets_the_time(pages, browser):
    show(browser, pages["train"])
    diagram = browser.find_element(By.ID, "diagram")
    browser.execute_script("arguments[0].scrollIntoView({block: 'center'})", diagram)
    webdriver.ActionChains(browser).move_to_element_with_offset(diagram, 0, -100).click().perform()
    time, duration = browser.execute_script("return [impactlab.state.time, impactlab.state.duration]")
    assert 0.55 < time / duration < 0.95
    assert int(browser.find_element(By.ID, "time").get_attribute("value")) == pytest.approx(
        1920 * time / duration, abs=1
    )


BEADS = """
schema_version: 1
bodies:
  striker: {kind: mass, mass: 4 g, velocity: 1 m/s}
  bead: {repeat: 3, kind: mass, mass: 4 g}
  bar: {kind: rod, length: 0.5 m, diameter: 10 mm, material: steel}
contacts:
  - {chain: [striker, bead, bar], law: {kind: hertz, stiffness: 7.0e9}}
solve: {duration: 30 us, model: {kind: finite_element, elements: 50, mass: lumped},
        integrator: {kind: central_difference}, step: {courant: 0.5}}
"""


def contact_columns(browser, folder, case):
    """Return the places [px] of the lines of contacts in the diagram of a case's page."""
    (folder / "beads.yaml").write_text(case, encoding="utf-8")
    written = invoke("run", str(folder / "beads.yaml"), "--out", str(folder / "out"))
    assert written.exit_code == 0, written.stderr
    show(browser, folder / "out" / "index.html")
    return browser.execute_script(
        "const sheet = document.getElementById('diagram'), pen = sheet.getContext('2d');"
        "const [r, g, b] = [1, 3, 5].map((k) => parseInt(getComputedStyle(document.documentElement)"
        ".getPropertyValue('--accent').trim().slice(k, k + 2), 16));"
        "const { width, height, data } = pen.getImageData(0, 0, sheet.width, sheet.height), found = [];"
        "for (let x = 0; x < width; x++) { let count = 0; for (let y = 0; y < height; y++) {"
        " const i = 4 * (y * width + x);"
        " if (data[i] === r && data[i + 1] === g && data[i + 2] === b) count += 1; }"
        " if (count > 20 && x - (found.at(-1) ?? -9) > 4) found.push(x); } return found;"
    )


def test_contacts_of_masses_are_drawn_where_these_meet(browser, tmp_path):
    """A contact of two beads stood one bead too far to the left, on that of a bead with the body before it."""
    columns = contact_columns(browser, tmp_path, BEADS)
    apart = [b - a for a, b in itertools.pairwise(columns)]
    assert len(columns) == 4
    assert max(apart) - min(apart) <= 2


def test_a_long_row_of_masses_fits_into_the_diagram(browser, tmp_path):
    """Thirty beads were wider than the page: their motion was mirrored, and their lines lay on the axis of time."""
    row = BEADS.replace("repeat: 3", "repeat: 30").replace("30 us", "600 us")
    assert len(contact_columns(browser, tmp_path, row)) > 28  # of 31, each of which closes


def test_a_contact_behind_a_gap_is_drawn_at_the_wall(browser, tmp_path):
    """A ball falls 0.5 m: its contact was drawn where it starts, not where the floor is."""
    drop = """
schema_version: 1
gravity: 9.81
bodies: {ball: {kind: mass, mass: 1 kg}, floor: {kind: wall}}
contacts: [{between: [ball, floor], gap: 0.5 m, law: {kind: penalty, stiffness: 2000.0}}]
solve: {duration: 0.5 s, integrator: {kind: midpoint}, step: {dt: 1 ms}}
"""
    [column] = contact_columns(browser, tmp_path, drop)
    assert column > 0.7 * browser.execute_script("return document.getElementById('diagram').width")


def test_the_keyboard_alone_plays_moves_and_switches(pages, browser):
    show(browser, pages["compared"])
    body = browser.find_element(By.TAG_NAME, "body")
    body.send_keys(Keys.SPACE)
    assert browser.execute_script("return impactlab.state.playing") is True
    body.send_keys(Keys.SPACE)
    assert browser.execute_script("return impactlab.state.playing") is False
    reached, actions = [], webdriver.ActionChains(browser)
    for _ in range(30):
        actions.send_keys(Keys.TAB).perform()
        reached.append(browser.execute_script("return document.activeElement.id || document.activeElement.className"))
        ring = browser.execute_script("return getComputedStyle(document.activeElement).outlineStyle")
        assert ring != "none", reached[-1]
    for wanted in ("play", "time", "speed", "method", "stretch", "closer", "key", "scroll"):
        assert wanted in reached
    assert reached.index("play") < reached.index("time") < reached.index("key")


def test_a_method_is_switched_off_in_all_plots(pages, browser):
    show(browser, pages["compared"])
    key = next(each for each in browser.find_elements(By.CSS_SELECTOR, "#keys .key") if each.text == "modal_10")
    before = browser.execute_script("return document.querySelector('.plot canvas').toDataURL()")
    key.click()
    assert key.get_attribute("aria-pressed") == "false"
    browser.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]))")
    assert browser.execute_script("return document.querySelector('.plot canvas').toDataURL()") != before
    key.send_keys(Keys.ENTER)
    assert key.get_attribute("aria-pressed") == "true"


def test_the_method_of_the_scene_is_chosen(pages, browser):
    show(browser, pages["compared"])
    before = browser.execute_script("return document.getElementById('diagram').toDataURL()")
    choice = browser.find_element(By.ID, "method")
    assert choice.find_element(By.CSS_SELECTOR, "option:checked").text == "exact"
    choice.find_element(By.CSS_SELECTOR, "option:nth-child(3)").click()
    assert browser.execute_script("return document.getElementById('diagram').toDataURL()") != before


def test_a_reference_without_fields_is_not_the_first_picture(browser, tmp_path):
    """A comparison against a converged run began with an empty diagram, "no fields kept by this run"."""
    beam = "{kind: beam, length: 0.4, section: {width: 0.02, height: 0.01}, ends: {left: pinned, right: pinned}, "
    (tmp_path / "beam.yaml").write_text(
        "schema_version: 1\n"
        f"bodies: {{ball: {{kind: mass, mass: 0.03, velocity: 1}}, beam: {beam}material: steel}}}}\n"
        "contacts: [{between: [ball, beam.at(0.2)], law: {kind: hertz, stiffness: 1.0e10}}]\n"
        "solve: {duration: 0.2 ms, model: {kind: modal, elements: 40, modes: 10}, integrator: {kind: newmark}, "
        "step: {points_per_period: 20}}\n"
        "methods: {midpoint: {solve.integrator: {kind: midpoint}}}\n",
        encoding="utf-8",
    )
    written = invoke("compare", str(tmp_path / "beam.yaml"), "--out", str(tmp_path / "out"))
    assert written.exit_code == 0, written.stderr
    show(browser, tmp_path / "out" / "index.html")
    choice = browser.find_element(By.ID, "method")
    assert "converged" in choice.text
    assert choice.find_element(By.CSS_SELECTOR, "option:checked").text == "base"


def test_zoom_is_the_same_in_all_plots_and_has_buttons(pages, browser):
    show(browser, pages["compared"])
    browser.find_element(By.ID, "closer").click()
    spans = browser.execute_script("return impactlab.spans()")
    assert len({tuple(span) for span in spans}) == 1
    whole = browser.execute_script("return impactlab.state.duration")
    assert spans[0][1] - spans[0][0] == pytest.approx(0.5 * whole, rel=1e-6)
    browser.find_element(By.ID, "all").click()
    assert browser.execute_script("return impactlab.spans()")[0] == pytest.approx([0.0, whole])


def test_the_table_sorts_by_a_column_and_marks_it(pages, browser):
    show(browser, pages["compared"])
    head = next(each for each in browser.find_elements(By.CSS_SELECTOR, "thead th") if each.text.startswith("impulse"))
    head.find_element(By.TAG_NAME, "button").send_keys(Keys.ENTER)
    assert head.get_attribute("aria-sort") == "ascending"
    column = browser.execute_script("return [...arguments[0].parentNode.cells].indexOf(arguments[0])", head)
    read = "return [...document.querySelectorAll('tbody tr')].map((r) => Number(r.cells[arguments[0]].dataset.value))"
    values = browser.execute_script(read, column)
    assert len(values) == 4
    assert values == sorted(values)
    head.find_element(By.TAG_NAME, "button").send_keys(Keys.ENTER)
    assert head.get_attribute("aria-sort") == "descending"
    assert browser.execute_script(read, column) == values[::-1]


def test_dark_mode_turns_the_ramp_round(pages, browser):
    middle = "const p = document.getElementById('stage').getContext('2d'); return impactlab.ramp()[127]"
    show(browser, pages["train"])
    assert min(browser.execute_script(middle)) > 200
    look(browser, dark=True)
    browser.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]))")
    assert max(browser.execute_script(middle)) < 80
    show(browser, pages["train"], dark=True)
    assert faults(browser) == []


def test_paper_shows_the_static_figures_and_no_controls(pages, browser):
    show(browser, pages["compared"])
    shown = "return [...document.querySelectorAll('figure, .controls')].map((e) => [e.id, e.offsetHeight > 0])"
    on_screen = dict(browser.execute_script(shown))
    look(browser, printed=True)
    on_paper = dict(browser.execute_script(shown))
    assert on_paper.pop("") is False
    assert set(on_paper.values()) == {True}
    assert on_screen["waves"] is False
    assert on_screen["errors"] is True


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of a small bench; one of its cases has a variant."""

    def make(folder: Path) -> None:
        varied = [row | {"variant": "steep"} for row in HAND if row["case"] == "b"]
        write_bench(folder, written(folder, [*HAND, *varied]))

    return made_once(tmp_path_factory, "bench_page", make) / "index.html"


def chosen(driver: webdriver.Chrome) -> tuple[str, int]:
    """Return the words below the diagram of a bench and the number of sections of scenes on the screen."""
    sections = driver.find_elements(By.CSS_SELECTOR, ".scene")
    return driver.find_element(By.ID, "count").text, sum(section.is_displayed() for section in sections)


def test_the_page_of_a_bench_is_silent_alone_accessible_and_as_wide_as_its_window(bench, browser):
    for width, dark in ((1280, False), (1280, True), (400, False)):
        show(browser, bench, width=width, dark=dark)
        assert browser.execute_script("return document.documentElement.scrollWidth") <= width
        assert faults(browser) == []
        assert console(browser) == []
        assert requests(browser) == []


def test_case_and_variant_of_a_bench_are_chosen_by_list_link_and_key(bench, browser):
    show(browser, bench)
    assert chosen(browser) == ("a: 5 runs.", 1)
    assert not browser.find_element(By.ID, "variant").is_displayed()
    browser.find_element(By.ID, "case").send_keys("b")
    assert chosen(browser) == ("b: 3 runs.", 1)
    browser.find_element(By.ID, "variant").send_keys(Keys.ARROW_DOWN)
    assert chosen(browser) == ("b/steep: 3 runs.", 1)
    browser.find_element(By.CSS_SELECTOR, "table a[href='#a']").click()
    assert chosen(browser) == ("a: 5 runs.", 1)


def test_a_run_of_a_bench_is_read_by_pointer_and_by_key(bench, browser):
    show(browser, bench)
    tip, diagram = browser.find_element(By.ID, "tip"), browser.find_element(By.ID, "diagram")
    assert not tip.is_displayed()
    browser.execute_script("arguments[0].scrollIntoView({block: 'center'})", diagram)
    place = "const p = impactlab.points().find(({y}) => y === 0.002), b = arguments[0].getBoundingClientRect();"
    away = browser.execute_script(f"{place} return [p.left - b.width / 2, p.up - b.height / 2]", diagram)
    webdriver.ActionChains(browser).move_to_element_with_offset(diagram, *map(round, away)).perform()
    for words in ("quick, level 1", "error of displacement and impulse: 0.002", "time to solve: 2 ms", "steps: 100"):
        assert words in tip.text
    assert tip.text.split("\n")[1] == "a"
    webdriver.ActionChains(browser).move_by_offset(0, -400).perform()
    assert not tip.is_displayed()
    diagram.send_keys(Keys.ARROW_RIGHT)
    first = tip.text
    diagram.send_keys(Keys.ARROW_DOWN)
    assert tip.text.split()[0] != first.split()[0]  # another method
    diagram.send_keys(Keys.ESCAPE)
    assert not tip.is_displayed()


def test_methods_and_axes_of_a_bench_are_switched(bench, browser):
    show(browser, bench)
    drawn = (
        "return [...document.querySelectorAll('#diagram g')]"
        ".map((g) => impactlab.points().filter((p) => p.m == g.dataset.method).length)"
    )
    assert sorted(browser.execute_script(drawn)) == [1, 2, 2]
    key = next(each for each in browser.find_elements(By.CSS_SELECTOR, "#keys .key") if each.text == "quick")
    front = "return document.querySelector('#diagram .front').getAttribute('d')"
    before = browser.execute_script(front)
    key.send_keys(Keys.ENTER)
    assert key.get_attribute("aria-pressed") == "false"
    assert sorted(browser.execute_script(drawn)) == [1, 2]
    assert browser.execute_script(front) != before  # of the methods shown
    browser.find_element(By.ID, "none").click()
    assert browser.execute_script(drawn) == []
    browser.find_element(By.ID, "every").click()
    assert browser.execute_script(front) == before
    browser.find_element(By.ID, "right").send_keys("steps")
    browser.find_element(By.ID, "up").send_keys("energy gained")
    assert browser.execute_script("return impactlab.points().map(({x, y}) => [x, y])") == [[100, 1e-4]] * 4


def test_tables_of_a_bench_sort(bench, browser):
    show(browser, bench)
    head = browser.find_element(By.CSS_SELECTOR, ".chosen table thead tr:last-child th")
    head.find_element(By.TAG_NAME, "button").send_keys(Keys.ENTER)
    first = "return [...document.querySelector('.chosen table').tBodies[0].rows].map((row) => row.cells[0].textContent)"
    names = browser.execute_script(first)
    head.find_element(By.TAG_NAME, "button").send_keys(Keys.ENTER)
    assert len(set(names)) > 1
    assert names == sorted(names)
    assert browser.execute_script(first) == sorted(names, reverse=True)


def test_a_bench_on_paper_and_without_a_script(bench, browser):
    show(browser, bench)
    look(browser, printed=True)
    assert browser.find_element(By.ID, "diagram").is_displayed()
    assert not browser.find_element(By.ID, "case").is_displayed()
    show(browser, bench, script=False)
    assert not browser.find_element(By.ID, "diagram").is_displayed()
    assert [section.get_attribute("id") for section in browser.find_elements(By.CSS_SELECTOR, ".scene")] == [
        "a",
        "b",
        "c",
        "b-steep",
    ]
    images = browser.find_elements(By.TAG_NAME, "img")
    assert len(images) == 4
    assert all(section.is_displayed() for section in (*images, *browser.find_elements(By.CSS_SELECTOR, ".scene")))
    show(browser, bench)  # scripts on again


def test_without_a_script_the_figures_are_there(pages, browser):
    show(browser, pages["compared"], script=False)
    figures = browser.find_elements(By.TAG_NAME, "figure")
    assert len(figures) >= 5
    assert all(figure.is_displayed() for figure in figures)
    assert not browser.find_element(By.ID, "play").is_displayed()
    show(browser, pages["compared"])  # scripts on again
