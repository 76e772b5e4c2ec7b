"""The programs of benchmarks/peers: the cases are right, loops by hand tend to the exact answer, packages if there."""

from __future__ import annotations

import ast
import json

import numpy as np
import pytest

from benchmarks import step_loop
from benchmarks.peers import (
    arms,
    arms_compare,
    compiled_peer,
    exudyn_peer,
    impactlab_peer,
    mujoco_peer,
    numpy_peer,
    opensees_peer,
    page,
    scipy_peer,
)
from benchmarks.peers.cases import (
    CASES,
    NORMS,
    PAPER,
    PAPER_EVENTS,
    TWO_MATERIAL,
    Outcome,
    errors_of,
    exact,
    opening_of,
)
from benchmarks.peers.mesh import chain, modes, reduced
from tests.reference.st_venant_mp import events
from tests.support import ROOT


def solved(peer, case, **setting):
    run = peer.build(case, setting, record=True)
    run.solve()
    return run.outcome()


def errors(peer, case, **setting):
    return errors_of(solved(peer, case, **setting), case)


def explicit(peer, case, elements, courant=0.9):
    return errors(peer, case, model="chain", coordinates=elements, scheme="central_difference", courant=courant)


def test_exact_events_of_the_paper():
    """Constants, an independent tracer in 40 digits, and the solver are one; 15 digits are printed."""
    traced = [time for time, _, _ in events(1, 3, digits=40)]
    assert np.allclose(traced, PAPER_EVENTS, rtol=0.0, atol=1e-14)
    found = [event.time / PAPER.round_trip for event in exact(PAPER).history.events]
    assert np.allclose(found, PAPER_EVENTS, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_meshes_hold_the_rod(case):
    """The chain has the rod's static stiffness and its mass except the clamped node's; modes give that answer too."""
    flexibility = sum(length / (young * area) for length, area, young, _ in case.segments)
    total = sum(length * area * density for length, area, _, density in case.segments)
    mesh = chain(case, 60)
    assert np.isclose(np.sum(1.0 / mesh.spring), flexibility, rtol=1e-12)
    _, area, _, density = case.segments[-1]
    assert np.isclose(mesh.mass.sum(), total - 0.5 * mesh.h * area * density, rtol=1e-12)
    # The constraint mode is the static shape, so the flexibility of the face is exact in any number of coordinates.
    assert np.isclose(np.linalg.inv(reduced(case, 6).stiffness)[0, 0], flexibility, rtol=1e-9)
    rod = modes(case, 6)
    assert np.isclose(np.sum(rod.face**2 / rod.frequency**2), flexibility, rtol=1e-9)


def test_opening_is_read_from_force_or_gap():
    """A gap through zero and a force that falls linearly tell the same instant; chatter is passed over."""
    t = np.linspace(0.0, 1.0, 101)
    opening = 0.4567
    gap = np.where(t < opening, 1.0, 2.0) * (t - opening)
    force = np.maximum(0.0, opening - t)
    force[20] = 0.0  # one step without force
    zero = np.zeros_like(t)
    # The gap bends where it opens: a straight line is off by part of a step of 0.01; the force is straight.
    assert abs(opening_of(Outcome(t, zero, gap, 0.0), 1.0) - opening) < 0.005
    assert abs(opening_of(Outcome(t, zero, gap, 0.0, force), 1.0) - opening) < 1e-12
    assert opening_of(Outcome(t, zero, gap - 1.0, 0.0), 1.0) == np.inf


@pytest.mark.parametrize("peer", [compiled_peer, numpy_peer], ids=["compiled", "numpy"])
def test_loops_by_hand_tend_to_the_exact_solution(peer):
    """First order in h for the face (half a mesh length of it is lumped): four times the elements, a quarter."""
    coarse, fine = (explicit(peer, TWO_MATERIAL, n)["face_displacement"] for n in (40, 160))
    assert 3.0 < coarse / fine < 7.0
    assert max(explicit(peer, PAPER, 160)[norm] for norm in NORMS) < 5e-3


def test_loops_by_hand_agree():
    """The numpy loop and the compiled one are one scheme: only the rounding of 200 steps lies between them."""
    one, other = (
        solved(peer, PAPER, model="chain", coordinates=30, scheme="central_difference", courant=0.9)
        for peer in (compiled_peer, numpy_peer)
    )
    assert np.allclose(one.face, other.face, rtol=0.0, atol=1e-11 * np.abs(one.face).max())
    assert np.allclose(one.mass, other.mass, rtol=0.0, atol=1e-11 * np.abs(one.mass).max())


@pytest.mark.parametrize("elements", [4, 5, 31, 40])
def test_newmark_by_hand_is_the_package_s(elements):
    """The same scheme, law and coefficients: forces agree to the rounding that a chattering constraint magnifies."""
    assert step_loop.measure(elements, 1, step_loop.SCHEMES["newmark"])["difference"] < 1e-9


def test_newmark_by_hand_tends_to_the_exact_solution():
    """First order in h for the face, as central difference; the constraint chatters, hence the wide bounds."""
    setting = {"model": "chain", "scheme": "newmark", "courant": 1.0}
    coarse, fine = (errors(compiled_peer, TWO_MATERIAL, coordinates=n, **setting) for n in (30, 240))
    assert coarse["face_displacement"] / fine["face_displacement"] > 4.0
    assert fine["face_displacement"] < 5e-3


def test_solve_ivp_tends_to_the_exact_solution():
    """More coordinates, less error; the face of N Craig-Bampton coordinates is off by about 0.06/N (0.007 at 10).

    The opening wanders: where a truncated force parts for good hangs on its ripples.
    """
    setting = {"model": "reduced", "scheme": "DOP853", "relative_tolerance": 1e-3}
    few, many = (errors(scipy_peer, TWO_MATERIAL, coordinates=n, **setting) for n in (8, 20))
    assert many["face_displacement"] < 0.5 * few["face_displacement"]
    assert max(many[norm] for norm in NORMS if norm != "opening_time") < 5e-3


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_impactlab_is_timed_on_its_own_solution(case):
    """The parts that are timed apart give the whole: exact to the straight lines between 6000 samples."""
    found = errors(impactlab_peer, case, model="exact")
    assert max(found.values()) < 1e-5
    assert errors(impactlab_peer, case, model="central_difference", coordinates=160, courant=0.9)[NORMS[0]] < 2e-3


PACKAGES = {
    "exudyn": (exudyn_peer, {"model": "matrix", "scheme": "VelocityVerlet", "contact_stiffness": 3.0, "courant": 0.5}),
    "exudyn implicit": (
        exudyn_peer,
        {"model": "reduced", "coordinates": 16, "scheme": "GeneralizedAlpha", "courant": 0.25}
        | {"contact_stiffness": 100.0, "spectral_radius": 0.3, "linear": "EXUdense"},
    ),
    "mujoco": (
        mujoco_peer,
        {"model": "chain", "scheme": "Euler", "courant": 0.9, "damper_per_step": 1.0, "spring_per_step": 0.5},
    ),
    "mujoco modes": (
        mujoco_peer,
        {"model": "modes", "coordinates": 16, "scheme": "Euler", "courant": 0.5, "damper_per_step": 1.0}
        | {"spring_per_step": 0.5, "solver": "PGS"},
    ),
    "openseespy": (
        opensees_peer,
        {"model": "chain", "scheme": "NewmarkExplicit", "courant": 0.5, "contact_stiffness": 3.0},
    ),
}


@pytest.mark.parametrize("name", PACKAGES)
def test_packages_tend_to_the_exact_solution(name):
    """A mesh of 100 elements, a contact spring of 3 E A/h: penetrations of h/3 against displacements of L/2, 0.7 %."""
    pytest.importorskip(name.split()[0], exc_type=ImportError) if name != "openseespy" else _opensees()
    peer, setting = PACKAGES[name]
    found = errors(peer, PAPER, **{"coordinates": 100} | setting)
    assert max(found.values()) < 0.02
    run = peer.build(PAPER, {"coordinates": 100} | setting, record=False)
    run.solve()
    # The timed run is the same: its mass leaves with the same velocity.
    again = solved(peer, PAPER, **{"coordinates": 100} | setting).exit_velocity
    assert np.isclose(run.outcome().exit_velocity, again, rtol=1e-9)


def _opensees():
    if opensees_peer.version() is None:
        pytest.skip("openseespy is not installed; the extra 'peers' brings it")
    try:
        opensees_peer.engine()
    except (ImportError, RuntimeError) as error:
        pytest.skip(f"openseespy does not load here: {error}")


def test_the_package_imports_no_other_program():
    """Nothing in impactlab imports a package of the extra `peers`; sources without their names are not parsed."""
    others = {"exudyn", "mujoco", "openseespy", "benchmarks"}
    for path in (ROOT / "impactlab").rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(text)) if any(other in text for other in others) else ():
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            assert not {name.partition(".")[0] for name in names} & others, path


def test_the_page_is_of_its_numbers(tmp_path):
    """docs/peers.md is what docs/peers.json says, nothing written in by hand."""
    results = json.loads((ROOT / "docs" / "peers.json").read_text(encoding="utf-8"))
    page.write(results, tmp_path / "peers.md", figure=False)
    assert (tmp_path / "peers.md").read_text(encoding="utf-8") == (ROOT / "docs" / "peers.md").read_text(
        encoding="utf-8"
    )


def test_the_page_of_mechanisms_is_of_its_numbers(tmp_path):
    """docs/peers-mechanisms.md is what its JSON and the scan say."""
    docs = ROOT / "docs"
    results = json.loads((docs / "peers-mechanisms.json").read_text(encoding="utf-8"))
    arms_compare.write(results, tmp_path / "page.md", figure=False)
    assert (tmp_path / "page.md").read_text(encoding="utf-8") == (docs / "peers-mechanisms.md").read_text(
        encoding="utf-8"
    )


@pytest.mark.parametrize("name", arms.ARMS)
def test_arms_of_both_programs_give_the_same_impulses(name):
    """The best stored settings of both programs find the impulses of impactlab's finest run."""
    results = json.loads((ROOT / "docs" / "peers-mechanisms.json").read_text(encoding="utf-8"))
    for row in results["rows"]:
        if row["case"] != name or row["tolerance"] != arms_compare.AIMED or row["kept"]:
            continue
        program = "impactlab" if row["group"] == "impactlab" else "exudyn"
        if program == "exudyn" and exudyn_peer.version() is None:
            continue
        run = arms.build(program, arms.ARMS[name], row["setting"], record=True)
        run.solve()
        assert arms.errors_of(run.outcome(), results["impulses"][name]["impactlab"]) < 1.5e-3
