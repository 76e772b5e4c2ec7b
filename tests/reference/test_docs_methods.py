"""The page that sets methods side by side: its numbers are those of the runs, on a sample, and its words are true."""

from __future__ import annotations

import re
from importlib.metadata import entry_points

import numpy as np
import pytest

from studies.comparison import bouncing, periodic, schemes
from studies.pages import DOCS

PAGE = (DOCS / "methods.md").read_text(encoding="utf-8")


def rows(name: str) -> list[dict[str, str]]:
    """The rows of a table of the page, by the names of its columns."""
    found = re.search(rf"<!-- table: {name} -->\n(.*?)\n<!-- end of table -->", PAGE, re.DOTALL)
    assert found is not None
    lines = [
        [cell.strip() for cell in line.strip("|").split(" | ")]
        for line in found.group(1).splitlines()
        if line.startswith("| ")
    ]
    return [dict(zip((each.strip() for each in lines[0]), line, strict=True)) for line in lines[1:]]


def row_of(name: str, method: str, rule: str) -> dict[str, str]:
    [found] = [row for row in rows(name) if row["method"].rstrip("*") == method and row["c dt/h"] == rule]
    return found


def numbers(cell: str) -> list[float]:
    return [float(value) for value in cell.split(" / ")]


SAMPLE = ["EXPLICIT", "MASSLESS", "BATHE", "MOREAU", "STABILISED", "WAVES"]


@pytest.mark.parametrize("name", SAMPLE)
def test_rows_of_the_periodic_bar_are_those_of_the_runs(name: str) -> None:
    scheme = getattr(schemes, name)
    row = row_of("periodic", scheme.name, scheme.rule)
    for place, n in enumerate((20, 80)):
        found, reason = periodic.measured(scheme, n)
        assert not reason
        # Energies are shown to three places, errors to two digits; none of these methods chatters.
        assert numbers(row["energy at the end"])[place] == pytest.approx(found.end, abs=6e-4)
        for column, value in (
            ("tip [%]", found.tip),
            ("pressure [%]", found.pressure),
            ("away from jumps [%]", found.away),
        ):
            assert numbers(row[column])[place] == pytest.approx(100.0 * value, rel=0.06), column
        assert numbers(row["re-touches"])[place] == found.again == 0


def test_a_dozen_methods_and_more_stand_on_three_meshes() -> None:
    full = [row for row in rows("periodic") if len(numbers(row["tip [%]"])) == 3]
    assert len({row["method"] for row in full}) >= 12


def test_the_trap_gains_energy_at_every_mesh_and_step() -> None:
    table = rows("trap")
    textbook = [row for row in table if row["contact force"].startswith("end of the step")]
    assert {row["c dt/h"] for row in textbook} == {"1", "0.5"}
    assert all(value > 3.0 for row in textbook for value in numbers(row["largest energy"]))
    assert all(value > 1.0 for row in table for value in numbers(row["largest energy"]))
    # Its numbers hang on the last bit, its growth does not.
    found, _ = periodic.measured(schemes.TRAP, 20, 0.5)
    assert found.largest > 3.0
    assert found.peak > 3.0


KEPT = ["SPRING", "CONSERVING", "MASSLESS"]


@pytest.mark.parametrize("name", KEPT)
def test_methods_that_keep_their_energy_keep_it_over_a_hundred_bounces(name: str) -> None:
    scheme = getattr(schemes, name)
    assert row_of("periodic", scheme.name, scheme.rule)["energy at the end"] == "1 / 1 / 1"
    assert row_of("bouncing", scheme.name, scheme.rule)["energy at the end"] == "1 / 1"
    energy = bouncing.mechanical(bouncing.bounced(scheme, 100).history)
    # An energy of 1 on the page: 80 000 steps add their roundings.
    assert np.max(np.abs(energy - 1.0)) < 1e-9


def test_no_other_method_on_a_mesh_keeps_it() -> None:
    kept = [row["method"] for row in rows("bouncing") if set(row["energy at the end"].split(" / ")) == {"1"}]
    assert kept == [getattr(schemes, name).name for name in ("CONSERVING", "SPRING", "MASSLESS", "EXACT")]


def test_the_continuous_bar_bounces_a_hundred_times_to_1e_9() -> None:
    history = bouncing.bounced(schemes.EXACT, 1).history
    starts = np.array([span.start for span in history.contacts])
    ends = np.array([span.end for span in history.contacts])
    touch = 1.0 + np.arange(100) * 8.0 / 3.0
    assert starts.size == 100
    assert np.max(np.abs(starts - touch)) < 1e-9
    assert np.max(np.abs(ends - touch - 2.0 / 3.0)) < 1e-9
    # From touch on 300 + 300 t' in odd contacts, 500 - 300 t' in even ones.
    for inside in (0.1, 0.6):
        force = history.evaluate(touch + inside, "force:wall|bar.left")
        assert np.max(np.abs(force[0::2] - (300.0 + 300.0 * inside))) < 1e-9 * 500.0
        assert np.max(np.abs(force[1::2] - (500.0 - 300.0 * inside))) < 1e-9 * 500.0
    assert row_of("bouncing", "continuous", "none")["in time"] == "100"


def test_a_bar_at_rest_has_the_energy_of_the_page() -> None:
    # Weight per length 10, EA = 900: u' = -10 (L - x)/900; strain energy minus work of the weight, -10^2 L^3/(6 EA).
    rest = -(10.0**2) * 10.0**3 / (6.0 * 900.0)
    assert rest == pytest.approx(-18.5, abs=0.05)
    row = row_of("bouncing", "velocity_complementarity, moreau_jean 1", "1")
    # The law leaves an overlap of a step's travel at most: 10 m/s dt, times the weight of 100 N, over 500 J.
    for value, dt in zip(numbers(row["energy at the end"]), (1.0 / 300.0, 1.0 / 600.0), strict=True):
        assert rest / 500.0 - 10.0 * dt * 100.0 / 500.0 - 5e-4 < value < rest / 500.0 + 5e-4


def test_orders_on_the_page_are_the_declared_ones() -> None:
    table = rows("orders")
    for row in table:
        if row["declared"].isdigit():
            assert float(row["smooth motion"]) == pytest.approx(float(row["declared"]), abs=0.1)
            assert float(row["impact"]) == pytest.approx(float(row["declared"]), abs=0.1)
    shown = {re.split(r"[ ,]", row["integrator"])[0] for row in table}
    ours = {entry.name for entry in entry_points(group="impactlab.integrators") if entry.value.startswith("impactlab.")}
    assert ours == shown


def test_sources_and_pictures_of_the_page_exist() -> None:
    keys = set(re.findall(r"@\w+\{(\w+),", (DOCS.parent / "impactlab" / "citations.bib").read_text(encoding="utf-8")))
    assert set(re.findall(r"\b[A-Z]\w+?(?:19|20)\d\d\b", PAGE)) <= keys
    for link in re.findall(r"\]\(([^)#:]+)\)", PAGE):
        assert (DOCS / link).exists(), link
