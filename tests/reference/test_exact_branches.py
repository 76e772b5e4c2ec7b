"""Exact answers of laws that are linear between changes of branch, against numbers found by hand and by steps."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import impactlab as il
from impactlab import piling
from impactlab.errors import CaseError, PairingError
from impactlab.exact.results.branch_energies import BranchContact
from impactlab.exact.results.history import ContinuousHistory
from impactlab.exact.results.thinned import ThinnedHistory
from impactlab.exact.solve import serves, solve
from impactlab.history import AbstractHistory
from impactlab.refine.references import reference
from tests.solving import run_case
from tests.support import CASES

HARD = {"kind": "addition_deletion"}
CONCRETE = {"young": 40e9, "density": 2500.0}
STEEL = {"young": 200e9, "density": 8000.0}  # c 5000 m/s
AREA = math.pi * 0.01**2  # m2, of a Hopkinson bar
SECTION = math.pi * 0.005**2  # m2, of its specimen
Z = 8000.0 * 5000.0 * AREA
EXACT = {"kind": "continuous"}


def solved(case: il.Case) -> ContinuousHistory:
    history = il.run(case)
    assert isinstance(history, ContinuousHistory)
    assert np.abs(history.energy.balance).max() <= 1e-11 * np.abs(history.energy.total).max()
    return history


def at(history: AbstractHistory, t: float, channel: str) -> float:
    return float(history.evaluate(np.array([t]), channel)[0])


def test_pile_with_a_toe_that_yields() -> None:
    bodies = {
        "ram": il.Mass("5 t", velocity=3.0),
        "pile": il.Rod(length=20.0, area=0.16, material=CONCRETE),
        "base": il.Wall(),
    }
    toe = {"kind": "smith", "capacity": 1e6, "quake": 3e-3, "tension": False}
    contacts = [il.Contact("ram", "pile.left", HARD), il.Contact("pile.right", "base", toe, name="toe")]
    history = solved(il.Case(bodies=bodies, contacts=contacts, solve={"duration": "30 ms", "model": EXACT}))
    yields = next(change for change in history.changes if change.branch == "yields")
    assert yields.time == pytest.approx(5.58317464777e-3, rel=1e-11)
    assert [(event.contact, event.kind) for event in history.events] == [
        ("ram|pile.left", k) for k in ("close", "open")
    ]
    assert history.events[1].time == pytest.approx(0.01, rel=1e-12)
    (link,) = history.links
    assert (link.name, link.pieces, link.smallest) == ("toe", 1, 0.0)
    assert link.largest == pytest.approx(1e6, rel=1e-12)
    assert link.set == pytest.approx(15.4547221651e-3, rel=1e-11)
    assert link.loss == pytest.approx(1e6 * 15.4547221651e-3, rel=1e-11)  # plastic work
    assert at(history, 30e-3, "velocity:ram") == pytest.approx(0.122286611935, rel=1e-11)
    assert at(history, 7e-3, "force:toe") == pytest.approx(1e6, rel=1e-12)


def drill(rod: float, stiffness: float, duration: float) -> il.Case:
    bodies = {
        "hammer": il.Rod(length=0.5, area=1e-3, material=STEEL, velocity=10.0),
        "rod": il.Rod(length=rod, area=1e-3, material=STEEL),
        "rock": il.Wall(),
    }
    law = {"kind": "bilinear", "stiffness": stiffness, "unloading_stiffness": 10.0 * stiffness}
    contacts = [il.Contact("hammer.right", "rod.left", HARD), il.Contact("rod.right", "rock", law)]
    return il.Case(bodies=bodies, contacts=contacts, solve={"duration": duration, "model": EXACT})


def test_one_pass_of_a_drill_rod() -> None:
    history = solved(drill(3.0, 2.5e8, 1.79e-3))  # until the wave that the rock sends back has gone to and fro
    b = 2.0 * 2.5e8 * 0.5 / (200e9 * 1e-3)
    first = 0.9 * 2.0 * (1.0 - math.exp(-b)) ** 2 / b
    assert first == pytest.approx(0.7330685831, rel=1e-9)
    (span,) = history.spans("rod.right|rock")
    assert span.peak_force is not None
    assert span.peak_force == pytest.approx(285398.081, rel=1e-9)
    lost = np.interp(1.5e-3, history.energy.time, history.energy.booked["contact"])
    assert lost / 200.0 == pytest.approx(first, rel=1e-9)
    # At the end of the unloading line the rod leaves a dent of 1 - gamma of the deepest penetration.
    assert 0.9 * span.peak_force / 2.5e8 == pytest.approx(1.027433093e-3, rel=1e-9)
    assert -at(history, 1.5e-3, "gap:rod.right|rock") == pytest.approx(1.027433093e-3, rel=1e-9)


def test_several_passes_of_a_drill_rod() -> None:
    history = solved(drill(3.0, 5e7, 6e-3))
    book = history.energy
    assert np.interp(1.5e-3, book.time, book.booked["contact"]) / 200.0 == pytest.approx(0.35229, rel=1e-4)
    assert book.booked["contact"][-1] == pytest.approx(152.24, rel=1e-4)
    deepest = max(span.peak_force or 0.0 for span in history.spans("rod.right|rock")) / 5e7
    assert deepest == pytest.approx(2.6012e-3, rel=1e-4)
    kinds = [event.kind for event in history.events if event.contact == "rod.right|rock"]
    assert kinds == ["close", "open"] * 2
    assert at(history, 6e-3, "momentum:hammer") == pytest.approx(0.0, abs=1e-12)


def bars(contacts: list[il.Contact], bodies: dict[str, Any] | None = None, duration: float = 0.55e-3) -> il.Case:
    def bar(length: float, **others: Any) -> il.Rod:
        return il.Rod(length=length, area=AREA, material=STEEL, **others)

    three = {"striker": bar(0.25, velocity=12.0), "incident": bar(1.5), **(bodies or {}), "transmission": bar(1.5)}
    strike = il.Contact("striker.right", "incident.left", HARD)
    return il.Case(bodies=three, contacts=[strike, *contacts], solve={"duration": duration, "model": EXACT})


def test_specimen_between_hopkinson_bars() -> None:
    law = {
        "kind": "specimen", "length": 5e-3, "area": SECTION, "young": 70e9,
        "flow": {"yield_stress": 300e6, "hardening": 500e6},
    }  # fmt: skip
    history = solved(bars([il.Contact("incident.right", "transmission.left", law, name="specimen")]))
    begins = 1.5 / 5000.0
    assert at(history, begins + 50e-6, "force:specimen") == pytest.approx(26572.0435, rel=2e-9)
    assert at(history, begins + 100e-6, "force:specimen") == pytest.approx(29530.2722, rel=2e-9)
    name = "incident.right|transmission.left"
    assert -at(history, begins + 100e-6, f"gap:{name}") == pytest.approx(0.781339604e-3, rel=1e-9)
    (link,) = history.links
    assert link.set == pytest.approx(0.754483097e-3, rel=1e-9)
    assert [change.branch for change in history.changes] == ["elastic", "yields", "elastic"]


def test_ring_up_of_a_bonded_specimen_rod() -> None:
    short = il.Rod(length=5e-3, area=SECTION, material={"young": 67.5e9, "density": 2700.0})
    bonds = [
        il.Contact("incident.right", "specimen.left", {"kind": "bonded"}),
        il.Contact("specimen.right", "transmission.left", {"kind": "bonded"}),
    ]
    history = solved(bars(bonds, {"specimen": short}, 0.5e-3))
    own = 2700.0 * 5000.0 * SECTION
    r = (Z - own) / (Z + own)
    n = np.arange(1, 50)
    t = 1.5 / 5000.0 + 2e-6 * n  # in the middle of each step, 1 us after the front has crossed the specimen
    share = history.evaluate(t, "force:specimen.right|transmission.left") / (6.0 * Z)
    assert np.abs(share - (1.0 - r ** (2 * n))).max() < 2e-15
    assert share[[0, 1, 4]] == pytest.approx([0.287021734, 0.491661993, 0.815761048], rel=1e-8)
    assert history.events[0].contact == "striker.right|incident.left"
    assert {event.contact for event in history.events} == {"striker.right|incident.left"}


def test_bonded_bars_are_one_rod() -> None:
    def case(*lengths: float) -> il.Case:
        names = "abc"[: len(lengths)]
        rods = {
            name: il.Rod(length=length, area=1e-3, material=STEEL)
            for name, length in zip(names, lengths, strict=True)
        }  # fmt: skip
        contacts = [il.Contact("ram", "a.left", {"kind": "penalty", "stiffness": 1e8})]
        contacts += [il.Contact(f"{a}.right", f"{b}.left", {"kind": "bonded"}) for a, b in pairwise(names)]
        contacts.append(il.Contact(f"{names[-1]}.right", "wall", HARD))
        bodies = {"ram": il.Mass(0.5, velocity=3.0), **rods, "wall": il.Wall()}
        return il.Case(bodies=bodies, contacts=contacts, solve={"duration": "3 ms", "model": EXACT})

    whole, parts = solved(case(1.5)), solved(case(0.4, 0.3, 0.8))
    t = np.linspace(0.0, 3e-3, 701)
    for own, other in (("a@0.2", "a@0.2"), ("a@0.55", "b@0.15"), ("a@1.2", "c@0.5")):
        expected = whole.evaluate(t, f"displacement:{own}")
        assert np.abs(parts.evaluate(t, f"displacement:{other}") - expected).max() < 1e-13 * np.abs(expected).max()
    inside = whole.evaluate(t, "force:a@0.4")
    there = parts.evaluate(t, "force:a.right|b.left")
    assert np.abs(there - inside).max() < 1e-11 * np.abs(inside).max()
    assert there.min() < 0.0 < there.max()  # it pulls, and never opens


LAWS = {
    "joint": {"kind": "elastic_plastic", "stiffness": 4e8, "yield_force": 2e4},
    "hardening": {"kind": "elastic_plastic", "stiffness": 4e8, "yield_force": 1.5e4, "hardening": 8e7},
    "shaft": {"kind": "smith", "capacity": 3e4, "quake": 1e-4, "damping": 0.3, "rule": "viscous"},
    "toe": {"kind": "smith", "capacity": 3e4, "quake": 1e-4, "damping": 0.3, "rule": "viscous", "tension": False},
    "dry toe": {"kind": "smith", "capacity": 3e4, "quake": 1e-4, "tension": False, "set": 2e-5},
    "specimen": {
        "kind": "specimen", "length": 5e-3, "area": 7.85e-5, "young": 7e10,
        "flow": {"yield_stress": 2e8, "hardening": 5e9},
    },
    "glued": {
        "kind": "specimen", "length": 5e-3, "area": 7.85e-5, "young": 7e10, "tension": True,
        "flow": {"yield_stress": 1e8, "hardening": 5e9},
    },
    "play": {"kind": "slack", "stiffness": 4e8, "slack": 5e-5},
    "no play": {"kind": "slack", "stiffness": 4e8},
    "cushion": {"kind": "bilinear", "stiffness": 2e8, "restitution": 0.6},
    "spring": {"kind": "bilinear", "stiffness": 2e8, "restitution": 1.0},
}  # fmt: skip


def struck(law: dict[str, Any], wall: bool, speed: float = 5.0, **solve: Any) -> il.Case:
    """Return a rod between a mass that strikes it and a law, behind which is a wall or another rod."""
    bodies = {"ram": il.Mass(2.0, velocity=speed), "a": il.Rod(length=0.7, area=1e-3, material=STEEL)}
    bodies["b"] = il.Wall() if wall else il.Rod(length=1.1, area=1e-3, material=STEEL)
    contacts = [
        il.Contact("ram", "a.left", {"kind": "penalty", "stiffness": 1e9}),
        il.Contact("a.right", "b" if wall else "b.left", law, name="law"),
    ]
    return il.Case(bodies=bodies, contacts=contacts, solve={"duration": "3 ms", "model": EXACT, **solve})


@pytest.mark.parametrize("wall", [True, False], ids=["wall", "rod"])
@pytest.mark.parametrize("law", LAWS)
def test_steps_tend_to_the_exact_solution(law: str, wall: bool) -> None:
    exact = solved(struck(LAWS[law], wall))
    t = np.linspace(0.0, 3e-3, 301)
    expected = exact.evaluate(t, "displacement:a@0.7")
    apart = []
    for dt in (8e-7, 2e-7):
        history = il.run(struck(LAWS[law], wall, step={"dt": dt}))
        assert not isinstance(history, ContinuousHistory)
        apart.append(float(np.abs(history.evaluate(t, "displacement:a@0.7") - expected).max() / np.abs(expected).max()))
    assert apart[1] < 2e-5
    assert apart[1] < 0.4 * apart[0]  # of the first order at least: a sixteenth at the second
    for ours, theirs in zip(exact.links, history.links, strict=True):
        assert (ours.set is None) == (theirs.set is None)
        if ours.set is not None and theirs.set is not None:
            assert ours.set == pytest.approx(theirs.set, rel=1e-4)
        assert ours.largest == pytest.approx(theirs.largest, rel=1e-5)
        assert ours.smallest == pytest.approx(theirs.smallest, rel=1e-5)
        assert ours.loss == pytest.approx(theirs.loss, rel=1e-4, abs=1e-9)


@pytest.mark.parametrize("law", LAWS)
def test_mirrored_scene_has_the_mirrored_solution(law: str) -> None:
    def case(mirrored: bool) -> il.Case:
        side = -1.0 if mirrored else 1.0
        bodies = {
            "a": il.Rod(length=0.7, area=1e-3, material=STEEL, velocity=6.0 * side),
            "b": il.Rod(length=1.1, area=1.3e-3, material=STEEL, velocity=-2.0 * side),
        }
        contact = ("b.right", "a.left") if mirrored else ("a.right", "b.left")
        return il.Case(
            bodies=bodies, contacts=[il.Contact(*contact, LAWS[law], name="law")],
            solve={"duration": "2 ms", "model": EXACT},
        )  # fmt: skip

    here, there = solved(case(False)), solved(case(True))
    t = np.linspace(0.0, 2e-3, 501)
    scale = np.abs(here.evaluate(t, "force:law")).max()
    assert np.abs(here.evaluate(t, "force:law") - there.evaluate(t, "force:law")).max() < 1e-10 * scale
    assert len(here.changes) == len(there.changes)
    assert [a.time for a in here.changes] == pytest.approx([b.time for b in there.changes], rel=1e-10, abs=1e-15)
    momentum = here.evaluate(t, "momentum:a") + here.evaluate(t, "momentum:b")
    assert np.abs(momentum - momentum[0]).max() < 1e-13 * abs(6.0 * 0.7 * 8.0)
    given = here.evaluate(t[-1:], "momentum:b")[0] - here.evaluate(t[:1], "momentum:b")[0]
    assert given == pytest.approx(here.impulse_of(here.scene.contacts[0].name), rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("law", LAWS)
def test_laws_never_give_energy(law: str) -> None:
    history = solved(struck(LAWS[law], wall=False, speed=7.3))
    lost = history.energy.booked["contact"]
    assert np.diff(lost).min() >= -1e-12 * history.energy.total[0]
    assert history.energy.stored.min() >= 0.0
    assert history.energy.total.max() <= history.energy.total[0] * (1.0 + 1e-12)
    if law in ("play", "no play", "spring"):
        assert np.abs(lost).max() <= 1e-12 * history.energy.total[0]
    else:
        assert lost[-1] > 0.05 * history.energy.total[0]


def test_a_law_far_from_yielding_is_a_spring() -> None:
    weak = {"kind": "elastic_plastic", "stiffness": 4e8, "yield_force": 1e9}
    yielding, joint = solved(struck(weak, wall=False)), solved(struck(LAWS["no play"], wall=False))
    assert yielding.changes == joint.changes == ()
    t = np.linspace(0.0, 3e-3, 301)
    assert np.array_equal(yielding.evaluate(t, "force:law"), joint.evaluate(t, "force:law"))


def test_links_at_rest_have_no_events() -> None:
    history = solved(struck(LAWS["shaft"], wall=True, speed=0.0))
    assert history.changes == ()
    assert np.abs(history.evaluate(np.linspace(0.0, 3e-3, 50), "force:law")).max() == 0.0
    # A rod that is held at its yield force, and stays there: no change after the first.
    held = il.Case(
        bodies={
            "a": il.Rod(length=0.7, area=1e-3, material=STEEL, ends={"left": {"force": 1e4, "dashpot": 4e4}}),
            "w": il.Wall(),
        },
        contacts=[il.Contact("a.right", "w", {"kind": "elastic_plastic", "stiffness": 4e8, "yield_force": 1e4})],
        solve={"duration": "20 ms", "model": EXACT},
    )
    assert len(solved(held).changes) <= 1


def test_adding_up_a_shaft() -> None:
    bodies = {
        "ram": il.Mass("5 t", velocity=3.0),
        "pile": il.Rod(length=20.0, area=0.16, material=CONCRETE),
        "soil": il.Wall(),
    }
    shaft = {"kind": "smith", "capacity": 6e5, "quake": 2.5e-3, "damping": 0.2, "rule": "viscous"}
    contacts = [
        il.Contact("ram", "pile.left", {"kind": "bilinear", "stiffness": 1e9, "restitution": 0.8}),
        il.Contact("pile.along(5 m, 20 m)", "soil", shaft, pieces=6, name="shaft"),
    ]
    history = solved(il.Case(bodies=bodies, contacts=contacts, solve={"duration": "30 ms", "model": EXACT}))
    t = np.linspace(0.0, 30e-3, 3001)
    own = [f"force:{contact.name}" for contact in history.scene.contacts if contact.group == "shaft"]
    assert len(own) == 6
    assert np.allclose(history.evaluate(t, "force:shaft"), sum(history.evaluate(t, name) for name in own), rtol=1e-14)
    (link,) = history.links
    assert (link.name, link.pieces, len(link.sets)) == ("shaft", 6, 6)
    assert link.largest >= history.evaluate(t, "force:shaft").max()
    assert link.largest == pytest.approx(history.evaluate(t, "force:shaft").max(), rel=1e-3)
    total = history.integral("force:shaft", t)
    assert total is not None
    assert total[-1] == pytest.approx(sum(history.impulse_of(name.removeprefix("force:")) for name in own), rel=1e-12)


@pytest.mark.parametrize(
    ("law", "remedy"),
    [
        ({"kind": "smith", "capacity": 3e4, "quake": 1e-4, "damping": 0.3}, "rule: viscous"),
        ({**LAWS["specimen"], "flow": {"kind": "johnson_cook", "A": 3e8}}, "yield_stress and hardening"),
    ],
)  # fmt: skip
def test_other_laws_are_refused_by_name(law: dict[str, Any], remedy: str) -> None:
    scene, method = struck(law, wall=True).simulation()
    assert f"but not '{law['kind']}' with these options" in (serves(scene, method) or "")
    with pytest.raises(PairingError) as refusal:
        solve(scene, method)
    assert remedy in refusal.value.remedy
    assert refusal.value.path == "contacts.1.law"


def test_bonds_between_masses_are_refused() -> None:
    bodies = {
        "ram": il.Mass(2.0, velocity=1.0),
        "a": il.Rod(length=0.7, area=1e-3, material=STEEL, ends={"left": {"mass": 1.0}}),
    }
    contacts = [il.Contact("ram", "a.left", {"kind": "bonded"})]
    with pytest.raises(CaseError, match="the exact solver supports a bond only where one face has no mass"):
        il.run(il.Case(bodies=bodies, contacts=contacts, solve={"duration": "1 ms", "model": EXACT}))


def test_a_given_step_is_taken_by_the_delay_line() -> None:
    assert isinstance(il.run(struck(LAWS["joint"], wall=True)), ContinuousHistory)
    assert not isinstance(il.run(struck(LAWS["joint"], wall=True, step={"dt": 1e-6})), ContinuousHistory)


def pile(duration: str, model: dict[str, Any], **solve: Any) -> il.Case:
    """Return the pile of the piling pages: two cushions, a helmet, a shaft of fifteen pieces and a toe, all viscous."""
    case = il.load_case(CASES / "smith_pile.yaml").with_("solve", {"duration": duration, "model": model, **solve})
    soil = {"kind": "smith", "rule": "viscous"}
    case = case.with_("contacts.2.law", {**soil, "capacity": "600 kN", "quake": "2.5 mm", "damping": 0.2})
    return case.with_(
        "contacts.3.law", {**soil, "capacity": "900 kN", "quake": "3 mm", "damping": 0.5, "tension": False}
    )


def test_a_pile_in_viscous_soil_and_a_fine_mesh() -> None:
    exact = solved(pile("18 ms", EXACT))
    assert [link.pieces for link in exact.links] == [15, 1]
    t = np.linspace(0.0, 18e-3, 501)
    apart = []
    for elements in (160, 640):
        mesh = {"kind": "finite_element", "elements": elements, "mass": "lumped"}
        central = {"integrator": {"kind": "central_difference"}, "step": {"courant": 0.5}}
        history = il.run(pile("18 ms", mesh, **central))
        for channel in ("displacement:pile@20", "position:ram", "position:helmet"):
            expected = exact.evaluate(t, channel)
            apart.append(float(np.abs(history.evaluate(t, channel) - expected).max() / np.abs(expected).max()))
    assert max(apart[3:]) < 1e-4
    assert all(fine < 0.3 * coarse for coarse, fine in zip(apart[:3], apart[3:], strict=True))
    for ours, theirs in zip(exact.links, history.links, strict=True):
        assert ours.set == pytest.approx(theirs.set, rel=2e-5)
        assert ours.largest == pytest.approx(theirs.largest, rel=2e-4)
        assert ours.loss == pytest.approx(theirs.loss, rel=2e-5)


@pytest.mark.parametrize("law", ["toe", "hardening", "glued"])
def test_a_run_beyond_its_memory_keeps_its_links(law: str, monkeypatch: pytest.MonkeyPatch) -> None:
    case = struck(LAWS[law], wall=True, duration="30 ms", records=600)
    whole = solved(case)
    monkeypatch.setenv("IMPACTLAB_MEMORY", "1.2e7")
    thin = il.run(case)
    assert isinstance(thin, ThinnedHistory)
    assert thin.changes == whole.changes
    assert np.abs(thin.energy.balance).max() <= 1e-10 * np.abs(thin.energy.total).max()
    t = np.linspace(0.0, 30e-3, 601)
    for channel in ("displacement:a@0.7", "velocity:a@0.7"):
        assert np.abs(thin.evaluate(t, channel) - whole.evaluate(t, channel)).max() < 1e-9
    lost = BranchContact(whole.signals, 1).lost(thin.energy.time)
    assert np.abs(thin.energy.booked["contact"] - lost).max() < 1e-10 * lost[-1]
    for ours, theirs in zip(thin.links, whole.links, strict=True):
        assert ours[:2] == theirs[:2]
        assert ours[2:6] == pytest.approx(theirs[2:6], rel=1e-8, abs=1e-8)
    contact = whole.scene.contacts[1].name
    assert thin.impulse_of(contact) == pytest.approx(whole.impulse_of(contact), rel=1e-9, abs=1e-9)
    pushed = whole.integral("force:law", t)
    assert pushed is not None
    means = np.diff(pushed) / np.diff(t)  # forces of such a run are means, of either sign
    middles = thin.evaluate(0.5 * (t[1:] + t[:-1]), "force:law")
    assert np.abs(middles - means).max() < 1e-8 * np.abs(means).max()
    assert (means.min() < -1.0) == (law != "toe")


@settings(max_examples=40, deadline=None)
@given(
    law=st.sampled_from(sorted(LAWS)),
    lengths=st.tuples(st.floats(0.1, 2.0), st.floats(0.1, 2.0)),
    speed=st.floats(0.05, 30.0),
    area=st.floats(0.1, 10.0),
    inside=st.booleans(),
)
def test_random_scenes_keep_energy_and_momentum(
    law: str, lengths: tuple[float, float], speed: float, area: float, inside: bool
) -> None:
    bodies = {
        "a": il.Rod(length=lengths[0], area=1e-3, material=STEEL, velocity=speed),
        "b": il.Rod(length=lengths[1], area=area * 1e-3, material=STEEL),
    }
    place = f"b.at({0.4 * lengths[1]})" if inside else "b.left"
    case = il.Case(
        bodies=bodies, contacts=[il.Contact("a.right", place, LAWS[law])], solve={"duration": "1 ms", "model": EXACT}
    )
    history = solved(case)
    t = np.linspace(0.0, 1e-3, 101)
    momentum = history.evaluate(t, "momentum:a") + history.evaluate(t, "momentum:b")
    assert np.abs(momentum - momentum[0]).max() < 1e-11 * abs(momentum[0])
    assert np.diff(history.energy.booked["contact"]).min() >= -1e-11 * history.energy.total[0]


def test_references_are_exact_where_links_have_branches() -> None:
    stepped = struck(LAWS["joint"], wall=True, step={"dt": 1e-6})
    found = reference.find(*stepped.simulation())
    assert found is not None
    assert (found.name, found.uncertainty) == ("branches", 0.0)
    assert isinstance(found.history, ContinuousHistory)
    rate = {"kind": "smith", "capacity": 3e4, "quake": 1e-4, "damping": 0.3}
    other = reference.find(*struck(rate, wall=True, step={"dt": 1e-6}).simulation())
    assert other is None or other.name == "converged"
    # A long blow on a pile with many links costs more than a plain run may spend.
    long = reference.find(*pile("0.1 s", EXACT).simulation(), 0.05)
    assert long is None or long.name == "converged"


def test_a_tolerance_takes_the_exact_solution_of_links() -> None:
    bodies = {"ram": il.Mass(2.0, velocity=5.0), "a": il.Rod(length=0.7, area=1e-3, material=STEEL), "w": il.Wall()}

    def chosen(law: dict[str, Any]) -> il.Case:
        contacts = [il.Contact("ram", "a.left"), il.Contact("a.right", "w", law)]
        return il.Case(bodies=bodies, contacts=contacts, solve={"duration": "2 ms", "tolerance": 1e-3})

    history = il.run(chosen(LAWS["shaft"]))
    assert history.choice is not None
    assert (history.choice.chosen, history.choice.met) == ("continuous, from event to event", True)
    with pytest.raises(CaseError, match="law 'specimen' with these options has none") as refusal:
        chosen({**LAWS["specimen"], "rate": {"kind": "cowper_symonds", "D": 6500.0, "q": 4.0}})
    assert "yield_stress and hardening" in refusal.value.remedy
    damped = il.Rod(length=0.7, area=1e-3, material=STEEL, damping={"stiffness": 1e-7})
    bodies["a"] = damped
    with pytest.raises(CaseError, match="'a' is damped"):
        il.run(chosen(LAWS["shaft"]))


def test_bonds_to_a_mass_and_to_a_wall_are_ends_of_a_rod() -> None:
    def case(end: il.Mass | il.Wall | None, **ends: Any) -> il.Case:
        bodies: dict[str, Any] = {
            "ram": il.Mass(1.0, velocity=2.0),
            "r": il.Rod(length=0.8, area=1e-3, material=STEEL, **ends),
        }
        contacts = [il.Contact("ram", "r.left", HARD)]
        if end is not None:
            bodies["end"] = end
            contacts.append(il.Contact("r.right", "end", {"kind": "bonded"}))
        return il.Case(bodies=bodies, contacts=contacts, solve={"duration": "3 ms", "model": EXACT})

    t = np.linspace(0.0, 3e-3, 401)
    for end, own in ((il.Mass(0.7), {"mass": 0.7}), (il.Wall(), "clamped")):
        glued, whole = solved(case(end)), solved(case(None, ends={"right": own}))
        assert glued.events == whole.events
        for channel in ("displacement:r@0.3", "position:ram"):
            assert np.abs(glued.evaluate(t, channel) - whole.evaluate(t, channel)).max() < 1e-15
        inside = whole.evaluate(t, "force:r@0.8")
        assert np.abs(glued.evaluate(t, "force:r.right|end") - inside).max() < 1e-12 * np.abs(inside).max()


def test_a_rod_comes_to_rest_on_soil_and_stays() -> None:
    soil = {"kind": "smith", "capacity": 1e3, "quake": 1e-4, "damping": 0.5, "rule": "viscous", "tension": False}
    bodies = {"rod": il.Rod(length=0.5, area=1e-3, material=STEEL), "ground": il.Wall()}
    contacts = [il.Contact("rod.right", "ground", soil, name="soil")]
    history = run_case(bodies=bodies, contacts=contacts, gravity=9.81, solve={"duration": "0.3 s", "model": EXACT})
    assert [change.branch for change in history.changes] == ["elastic"]
    assert at(history, 0.3, "force:soil") == pytest.approx(9.81 * 4.0, rel=1e-6)
    assert history.links[0].set == 0.0


def test_blows_with_residual_forces_on_exact_piles() -> None:
    def case(model: dict[str, Any], **others: Any) -> il.Case:
        soil = {"kind": "smith", "rule": "viscous"}
        bodies = {
            "ram": il.Mass("5 t", velocity=3.0), "pile": il.Rod(length=20.0, area=0.16, material=CONCRETE),
            "ground": il.Wall(), "base": il.Wall(),
        }  # fmt: skip
        shaft = {**soil, "capacity": "600 kN", "quake": "2.5 mm", "damping": 0.2}
        toe = {**soil, "capacity": "1 MN", "quake": "3 mm", "damping": 0.3, "tension": False}
        contacts = [
            il.Contact("ram", "pile.left", {"kind": "bilinear", "stiffness": 1e9, "restitution": 0.8}),
            il.Contact("pile.along(5 m, 20 m)", "ground", shaft, pieces=3, name="shaft"),
            il.Contact("pile.right", "base", toe, name="toe"),
        ]
        return il.Case(bodies=bodies, contacts=contacts, solve={"duration": "30 ms", "model": model, **others})

    mesh = {"kind": "finite_element", "elements": 400, "mass": "lumped"}
    exact = piling.drive(case(EXACT), 2).blows
    steps = piling.drive(case(mesh, integrator={"kind": "central_difference"}, step={"courant": 0.5}), 2).blows
    for ours, theirs in zip(exact, steps, strict=True):  # the second blow begins in the soil of the first
        assert ours.toe == pytest.approx(theirs.toe, rel=1e-3)
        assert ours.head == pytest.approx(theirs.head, rel=1e-3)
        largest = max(abs(force) for force in theirs.soil.values())
        assert all(abs(ours.soil[name] - force) < 0.02 * largest for name, force in theirs.soil.items())
