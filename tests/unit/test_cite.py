"""Sources are complete, and every part cites by a key that exists."""

from __future__ import annotations

from impactlab.casefile import load_case
from impactlab.casefile.listing import listing
from impactlab.cite import bibtex, cite, entries, source_key
from impactlab.plugins import registry
from tests.support import CASES

KEYS = {
    "Bathe1982", "CourantFriedrichsLewy1928", "EscalonaMayoDominguez1999", "Goldsmith1960",
    "HughesTaylorSackmanCurnierKanoknukulchai1976", "KhuliefShabana1987", "Newmark1959", "Palas1992", "StVenant1883",
    "TimoshenkoGoodier1951", "WuHaug1990",
}  # fmt: skip


def test_the_sources_are_there():
    assert set(entries()) >= KEYS


def test_entries_are_complete():
    for key, entry in entries().items():
        assert all(f"{field} " in entry for field in ("author", "title", "year")), key
        assert entry.count("{") == entry.count("}"), key


def test_every_installed_part_cites_by_a_key_that_exists():
    for part in listing(registry().only("impactlab")):
        assert set(part.citations) <= set(entries()), part.name


def test_source_may_be_a_key_or_name_authors_and_year():
    assert source_key("StVenant1883") == "StVenant1883"
    assert source_key("Escalona, Mayo, Dominguez 1999") == "EscalonaMayoDominguez1999"
    assert source_key("Escalona and Mayo 1999") is None
    assert source_key("Escalona, Mayo, Dominguez") is None
    assert source_key("") is None


def test_a_case_cites_its_parts_and_its_source():
    case = load_case(CASES / "two_rods.yaml")
    assert cite(case).keys == ("EscalonaMayoDominguez1999", "Newmark1959", "StVenant1883")
    hard = cite(case.method("finite_element"))
    assert {"WuHaug1990", "StVenant1883"} <= set(hard.keys)
    assert hard.bibtex.count("\n@") + 1 == len(hard.keys)


def test_static_shapes_of_modes_left_out_are_cited_where_they_are_taken():
    case = load_case(CASES / "sphere_on_beam.yaml")
    assert "MacNeal1971" not in cite(case).keys
    assert "MacNeal1971" in cite(case.with_("solve.model.residual", True)).keys


def test_source_without_a_key_stays_as_a_remark():
    case = load_case(CASES / "two_rods.yaml").with_("source", "a talk\nin 1999")
    assert cite(case).bibtex.startswith("% Source of the case: a talk in 1999\n\n@")


def test_a_plugin_may_bring_its_own_entry():
    found = bibtex(["@misc{Me2024,\n  title = {Mine}\n}", "Newmark1959", "Unknown2020"])
    assert found.keys == ("Me2024", "Newmark1959")
    assert found.bibtex.startswith("% Unknown2020: no entry in citations.bib")
