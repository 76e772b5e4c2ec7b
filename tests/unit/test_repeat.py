"""Bodies and contacts made from one block: names, formulas of the index, chains, refusals, both forms."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import impactlab as il
from impactlab.casefile.blocks.repeat import MAX_REPEAT, expand
from impactlab.casefile.text.words import listed_bodies
from impactlab.casefile.values.formula import IndexFormula
from impactlab.errors import CaseError, ImpactlabError

LAW = {"kind": "hertz", "stiffness": 1e9}
SOLVE = {"duration": 1e-4, "integrator": {"kind": "central_difference"}, "step": {"dt": 1e-6}}
BEADS = {
    "striker": {"kind": "mass", "mass": 1e-3, "velocity": 1.0},
    "bead": {"repeat": 4, "kind": "mass", "mass": "1e-3*0.9**i"},
    "wall": {"kind": "wall"},
}
CHAIN = [{"chain": ["striker", "bead", "wall"], "gap": "1e-6*(i - 1)/n", "law": LAW}]
TEXT = """
schema_version: 1
bodies:
  striker: {kind: mass, mass: 1 g, velocity: 1.0}
  bead:
    repeat: 4
    kind: mass
    mass: "{0.9**i} g"
contacts:
  - chain: [striker, bead]
    law: {kind: hertz, stiffness: 1.0e9}
solve: {duration: 1e-4, integrator: {kind: central_difference}, step: {dt: 1e-6}}
"""


def made(**changes: Any) -> il.Case:
    return il.Case.from_dict({"bodies": BEADS, "contacts": CHAIN, "solve": SOLVE, **changes}, "beads")


def test_bodies_and_contacts_are_written_out() -> None:
    scene = made().scene()
    assert list(scene.bodies) == ["striker", "bead_1", "bead_2", "bead_3", "bead_4", "wall"]
    assert [scene.bodies[f"bead_{i}"].rigid_mass for i in range(1, 5)] == pytest.approx(
        [1e-3 * 0.9**i for i in range(1, 5)], rel=1e-15
    )
    assert [contact.name for contact in scene.contacts] == [
        "striker|bead_1", "bead_1|bead_2", "bead_2|bead_3", "bead_3|bead_4", "bead_4|wall",
    ]  # fmt: skip
    assert [contact.gap for contact in scene.contacts] == pytest.approx([1e-6 * k / 5 for k in range(5)])


def test_pairs_written_as_faces_are_the_same_chain() -> None:
    pairs = [
        {"between": ["striker", "bead_1"], "gap": 0.0, "law": LAW},
        {"repeat": 3, "between": ["bead_{i}", "bead_{i + 1}"], "gap": "1e-6*i/5", "law": LAW},
        {"between": ["bead_4", "wall"], "gap": 0.8e-6, "law": LAW},
    ]
    one, other = made().scene(), made(contacts=pairs).scene()
    assert [contact.name for contact in one.contacts] == [contact.name for contact in other.contacts]
    assert [contact.gap for contact in one.contacts] == pytest.approx([contact.gap for contact in other.contacts])


def test_repeated_blocks_are_the_bits_of_those_written_out() -> None:
    bodies = {"striker": il.Mass(1e-3, velocity=1.0)} | {f"bead_{i}": il.Mass(1e-3 * 0.9**i) for i in range(1, 5)}
    names = ["striker", *(f"bead_{i}" for i in range(1, 5)), "wall"]
    contacts = [
        il.Contact(one, other, law=LAW, gap=1e-6 * (i - 1) / 5)
        for i, (one, other) in enumerate(itertools.pairwise(names), 1)
    ]
    written = il.Case(bodies=bodies | {"wall": il.Wall()}, contacts=contacts, solve=SOLVE)
    one, other = il.run(made()), il.run(written)
    assert one.events == other.events
    assert len(one.events) > 4
    assert (one.recorded["velocity:bead_4"].values == other.recorded["velocity:bead_4"].values).all()


def test_the_classes_make_the_same_case() -> None:
    case = il.Case(
        name="beads",
        bodies={"striker": il.Mass(1e-3, velocity=1.0), "bead": il.Mass("1e-3*0.9**i", repeat=4), "wall": il.Wall()},
        contacts=[il.Chain(["striker", "bead", "wall"], LAW, gap="1e-6*(i - 1)/n")],
        solve=SOLVE,
    )
    assert case.resolved() == made().resolved()


def test_a_rod_meets_its_neighbours_by_its_ends() -> None:
    rod = {"kind": "rod", "length": 0.1, "area": 1e-4, "material": "steel"}
    scene = made(
        bodies={"left": {**rod, "velocity": 1.0}, "bead": BEADS["bead"], "rod": {**rod, "repeat": 2}},
        contacts=[{"chain": ["left", "bead", "rod"], "law": LAW}],
        solve={"duration": 1e-5, "step": {"dt": 1e-7}},
    ).scene()
    assert scene.contacts[0].name == "left.right|bead_1"
    assert [contact.name for contact in scene.contacts][-2:] == ["bead_4|rod_1.left", "rod_1.right|rod_2.left"]


def test_the_file_stays_as_it_was_written_and_the_resolved_case_states_what_ran(tmp_path: Path) -> None:
    file = tmp_path / "beads.yaml"
    file.write_text(TEXT, encoding="utf-8")
    case = il.load_case(file)
    assert 'mass: "{0.9**i} g"' in case.to_yaml()
    assert case.resolved()["bodies"]["bead"] == {
        "kind": "mass",
        "mass": {"each": pytest.approx([1e-3 * 0.9**i for i in range(1, 5)])},
        "velocity": 0.0,
        "repeat": 4,
    }
    assert case.resolved()["contacts"] == [
        {"chain": ["striker", "bead"], "gap": 0.0, "law": {"kind": "hertz", "stiffness": 1e9, "exponent": 1.5}}
    ]
    again = tmp_path / "again.yaml"
    again.write_text(case.to_yaml(), encoding="utf-8")
    assert il.load_case(again).resolved() == case.resolved()


def test_a_resolved_case_is_the_same_case() -> None:
    case = made()
    resolved = {key: case.resolved()[key] for key in ("bodies", "contacts", "solve", "gravity", "probes")}
    assert il.Case.from_dict(resolved, "beads").scene().bodies == case.scene().bodies
    assert il.Case.from_dict(resolved, "beads").scene().contacts == case.scene().contacts


def test_numbers_of_a_repeated_block_have_their_units() -> None:
    """Sensitivities to the mass of all beads were per 1, not per kg; the law of a second block had the first one's."""
    bond = {"between": ["striker", "wall"], "law": {"kind": "penalty", "stiffness": 1e6}, "gap": 1.0}
    case = made(contacts=[*CHAIN, bond], probes=[{"repeat": 4, "body": "bead_{i}", "quantity": "velocity"}])
    assert case.unit_of("bodies.bead.mass") == case.unit_of("bodies.striker.mass") == "kg"
    assert case.unit_of("contacts.0.law.stiffness") == "N/m^1.5"
    assert case.unit_of("contacts.1.law.stiffness") == "N/m"
    assert case.unit_of("contacts.0.gap") == "m"
    assert case.unit_of("title") == case.unit_of("bodies") == ""


def test_settings_and_variants_change_the_block_as_written() -> None:
    case = made(variants={"long": {"bodies.bead.repeat": 7}})
    assert len(case.with_("bodies.bead.repeat", 2).scene().bodies) == 4
    assert len(case.variant("long").scene().contacts) == 8
    assert case.with_("bodies.bead.mass", 2e-3).scene().bodies["bead_3"].rigid_mass == 2e-3


@pytest.mark.parametrize(
    ("path", "asked"),
    [
        ("bodies.bead_2.mass", "bodies.bead.mass={each: [...]}"),
        ("bodies.bead.2.mass", "bodies.bead.mass={each: [...]}"),
        ("bodies.bead.2", "bodies.bead.KEY={each: [...]}"),
        ("contacts.2.gap", "KEY={each: [...]} in it"),
    ],
)
def test_one_of_many_has_no_path_and_the_message_names_the_key(path: str, asked: str) -> None:
    case = made()
    with pytest.raises(CaseError) as refused:
        case.with_(path, 2e-3)
    assert refused.value.path == path
    assert asked in refused.value.remedy
    if path.startswith("bodies"):
        assert "the 4 bodies made from the block bodies.bead have no paths of their own" in refused.value.text


def test_values_of_each_are_set_and_a_new_body_may_still_be_added() -> None:
    case = made()
    masses = case.with_("bodies.bead.mass", {"each": [1e-3, 2e-3, 3e-3, 4e-3]}).scene().bodies
    assert masses["bead_2"].rigid_mass == 2e-3
    gaps = case.with_("contacts.0.gap", {"each": [0.0, 1e-6, 2e-6, 3e-6, 4e-6]}).scene().contacts
    assert [each.gap for each in gaps] == [0.0, 1e-6, 2e-6, 3e-6, 4e-6]
    assert "post" in case.with_("bodies.post", {"kind": "wall"}).scene().bodies


def test_probes_are_repeated() -> None:
    probes = [{"repeat": 4, "body": "bead_{i}", "quantity": "velocity"}]
    assert "velocity:bead_3@0" in il.run(made(probes=probes)).channels()


def test_the_index_counts_from_one() -> None:
    assert IndexFormula("i")(3).tolist() == [1.0, 2.0, 3.0]
    assert IndexFormula("i % 2")(4).tolist() == [1.0, 0.0, 1.0, 0.0]
    assert IndexFormula("2**(n - i)")(3).tolist() == [4.0, 2.0, 1.0]


def test_an_array_gives_one_value_to_each_body(tmp_path: Path) -> None:
    """The message was: a list of 4 is given for 4 blocks."""
    masses = np.linspace(1e-3, 2e-3, 4)
    case = made(bodies={**BEADS, "bead": il.Mass({"each": masses}, repeat=4)})
    assert [case.scene().bodies[f"bead_{i}"].rigid_mass for i in (1, 2, 3, 4)] == masses.tolist()
    again = tmp_path / "again.yaml"
    again.write_text(case.to_yaml(), encoding="utf-8")
    assert il.load_case(again).resolved() == case.resolved()


def test_a_list_for_repeated_bodies_is_pointed_to_each() -> None:
    with pytest.raises(CaseError, match="a list of 4 is not allowed here") as refused:
        made(bodies={**BEADS, "bead": il.Mass([1e-3] * 4, repeat=4)})  # type: ignore[arg-type]
    assert refused.value.remedy == "Give one value to each by {each: [...]}."


@pytest.mark.parametrize("name", ["j", "k"])
def test_a_formula_of_another_name_is_pointed_to_the_index(name: str) -> None:
    """The formula 1e-3*j was called a unit that is not known, 1e-3*k one of another dimension, and no more."""
    with pytest.raises(CaseError, match="has a unit") as refused:
        made(bodies={**BEADS, "bead": il.Mass(f"1e-3*{name}", repeat=4)})
    assert refused.value.remedy == "Fix the unit; a formula of a repeated block names i, n and pi alone."


def test_a_chain_of_one_name_is_not_one_of_its_letters() -> None:
    with pytest.raises(CaseError, match="'bead' is not a list") as refused:
        made(contacts=[il.Chain("bead", LAW)])
    assert refused.value.path == "contacts.0.chain"


def test_a_missing_channel_of_many_bodies_is_refused_with_a_few_names() -> None:
    history = il.run(made(bodies={**BEADS, "bead": {**BEADS["bead"], "repeat": 20}}))
    with pytest.raises(ImpactlabError, match=r"'force:a' was not recorded.* in all: `history.channels\(\)`") as refused:
        history.evaluate(0.0, "force:a")
    assert len(refused.value.text) < 2500


def test_values_that_do_not_vary_are_shared() -> None:
    contacts = expand(made().document.data).data["contacts"]
    assert contacts[0]["law"] is contacts[-1]["law"]


REFUSED = [
    ({"repeat": 2.5}, "bodies.bead.repeat", "2.5 is not a whole number. Allowed: a whole number from 1 to 100000"),
    ({"repeat": "4"}, "bodies.bead.repeat", "'4' is not a whole number"),
    ({"repeat": True}, "bodies.bead.repeat", "true is not a whole number"),
    ({"repeat": None}, "bodies.bead.repeat", "nothing is not a whole number"),
    ({"repeat": float("inf")}, "bodies.bead.repeat", "inf is not a whole number"),
    ({"repeat": 0}, "bodies.bead.repeat", "0 is out of range"),
    ({"repeat": -3}, "bodies.bead.repeat", "-3 is out of range"),
    ({"repeat": MAX_REPEAT + 1}, "bodies.bead.repeat", f"{MAX_REPEAT + 1} is out of range"),
    ({"repeat": MAX_REPEAT}, "bodies", f"{MAX_REPEAT + 2} bodies in all. Allowed: up to {MAX_REPEAT}"),
    ({"mass": "1e-3*k*i"}, "bodies.bead.mass", "the formula names 'k'"),
    ({"mass": "1e-3/(i - 3)"}, "bodies.bead.mass", "'1e-3/(i - 3)' is not a finite number at i = 3"),
    ({"mass": "9.0**(9.0**(9.0**i))"}, "bodies.bead.mass", "is not a finite number at i = 1"),
    ({"mass": "__import__('os').getcwd()*i"}, "bodies.bead.mass", "the formula calls"),
    ({"mass": "i.real"}, "bodies.bead.mass", "'i.real' is no number"),
    ({"mass": "1e-3*(2 - i)"}, "bodies.bead.mass", "0 kg is out of range. Allowed: a number in kg above 0 (at i = 2)"),
    ({"mass": {"each": [1e-3, 2e-3]}}, "bodies.bead.mass.each", "a list of 2 is given for 4 blocks"),
    ({"colour": 1}, "bodies.bead.colour", "the key 'colour' is not known here"),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "path", "text"), REFUSED, ids=lambda given: str(given)[:40])
def test_a_block_that_cannot_be_repeated_is_refused(changes: dict[str, Any], path: str, text: str) -> None:
    with pytest.raises(CaseError) as refused:
        made(bodies={**BEADS, "bead": {**BEADS["bead"], **changes}})
    assert refused.value.path == path
    if "i.real" not in text:
        assert text in refused.value.text
    assert refused.value.remedy or "Allowed: " in refused.value.text


def test_too_many_bodies_are_refused_with_the_key_to_reduce() -> None:
    with pytest.raises(CaseError) as refused:
        made(bodies={**BEADS, "bead": {**BEADS["bead"], "repeat": MAX_REPEAT}})
    assert refused.value.remedy == "Give fewer bodies: a smaller repeat, or fewer blocks."


def test_one_fault_of_many_blocks_is_one() -> None:
    with pytest.raises(CaseError, match=r"\(at i = 1\) \(and in 3 more made from this block\)") as refused:
        made(bodies={**BEADS, "bead": {**BEADS["bead"], "mass": -1.0}})
    assert refused.value.others == ()


def test_faults_that_differ_in_their_numbers_are_one_with_their_count() -> None:
    """A mass of 1e-3*(5 - i) is wrong in 995 of 1000 beads: one message, not 200."""
    with pytest.raises(CaseError, match=r"at i = 5\) \(and in 995 more made from this block\)") as refused:
        made(bodies={**BEADS, "bead": {"kind": "mass", "repeat": 1000, "mass": "1e-3*(5 - i)"}})
    assert refused.value.others == ()


def test_the_bodies_of_a_message_are_listed_by_their_rows() -> None:
    assert listed_bodies([*(f"bead_{i}" for i in range(1, 1001)), "wall", "a_1"]) == "a_1, bead_1 to bead_1000, wall"


@pytest.mark.parametrize(
    ("bodies", "text"),
    [
        ({"bead_3": {"kind": "wall"}}, "makes a body 'bead_3' at i = 3, and bodies.bead_3 has the same name"),
        (
            {"bead_{i + 2}": {"kind": "wall", "repeat": 2}},
            "makes a body 'bead_3' at i = 1, and bodies.bead has the same name",
        ),
        (
            {"ball_{i % 2}": {"kind": "wall", "repeat": 3}},
            "makes a body 'ball_1' at i = 3, and another one has the same name",
        ),
    ],
)
def test_names_that_collide_are_refused(bodies: dict[str, Any], text: str) -> None:
    with pytest.raises(CaseError) as refused:
        made(bodies={**BEADS, **bodies})
    assert text in refused.value.text


@pytest.mark.parametrize(
    ("contact", "path", "text"),
    [
        ({"chain": ["striker"]}, "contacts.0.chain", "a chain of 1 body has no contact"),
        ({"chain": "striker"}, "contacts.0.chain", "'striker' is not a list"),
        ({"chain": ["striker", 3]}, "contacts.0.chain", "3 is not the name of a body"),
        ({"chain": ["striker", "bead"], "repeat": 3}, "contacts.0.repeat", "given together with chain"),
        ({"chain": ["striker", "bead"], "between": ["a", "b"]}, "contacts.0.between", "given together with chain"),
        ({"chain": ["striker", "beads"]}, "contacts.0.chain.1", "there is no body 'beads'. Did you mean 'bead'?"),
        ({"chain": ["striker", "bead", "wal"]}, "contacts.0.chain.2", "there is no body 'wal'"),
        ({"between": ["striker", "bead"]}, "contacts.0.between.1", "'bead'. Block 'bead' makes bead_1 to bead_4."),
        ({"repeat": 3, "between": ["bead_{i/2}", "wall"]}, "contacts.0.between.0", "'i/2' gives 0.5 at i = 1"),
        ({"repeat": 5, "between": ["bead_{i}", "bead_{i+1}"]}, "contacts.0.between.1", "there is no body 'bead_5'"),
        ({"chain": ["striker", "bead", "bead_2"]}, "contacts.0.chain", "on the left of"),
        ({"chain": ["striker", "bead"], "gap": "-1e-6*i"}, "contacts.0.gap", "the faces overlap before the run"),
    ],
)
def test_contacts_that_cannot_be_made_are_refused(contact: dict[str, Any], path: str, text: str) -> None:
    with pytest.raises(CaseError) as refused:
        made(contacts=[{"law": LAW, **contact}])
    assert refused.value.path == path
    assert text in refused.value.text


def test_an_error_names_the_line_of_the_block(tmp_path: Path) -> None:
    file = tmp_path / "beads.yaml"
    file.write_text(TEXT.replace("{0.9**i} g", "{0.9**i} N"), encoding="utf-8")
    with pytest.raises(CaseError) as refused:
        il.load_case(file)
    assert (refused.value.path, refused.value.line) == ("bodies.bead.mass", 8)


def test_records_of_many_bodies_fit_into_the_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 10000 beads a record has 80000 numbers: kept are as many as half of the limit holds, unless the case says."""
    many = {**BEADS, "bead": {**BEADS["bead"], "repeat": 10000, "mass": 1e-3}}
    solve = {**SOLVE, "duration": 0.02}
    assert made(bodies=many, solve=solve).scene().records == int(0.9e9 / 16 / (1 + 6 * 10001 + 2 * 10001))
    assert made(solve=solve).scene().records == 20000
    with pytest.raises(CaseError) as refused:
        il.run(made(bodies=many, solve={**solve, "records": 20000}))
    assert refused.value.path == "solve.records"
    assert refused.value.text == "2e+04 records of 80009 numbers take about 25.6 GB. Allowed: 1.8 GB"
    assert "Give 1406 or fewer." in refused.value.remedy
    # The machine may have less than that limit.
    monkeypatch.setattr("impactlab.scene.sizes.available_memory", lambda: 5e8)
    with pytest.raises(CaseError, match=r"and this machine has 500 MB free\. Allowed: 450 MB"):
        il.run(made(bodies=many, solve=solve))
