"""Errors, energies and times of methods: how-to-choose.md.

Its tables are of the paper's impact and other cases.
"""

from __future__ import annotations

import re
from typing import Any

import impactlab as il
from impactlab import metrics, simulate
from impactlab.api import reference_of
from impactlab.errors import ImpactlabError
from impactlab.history import AbstractHistory
from impactlab.models.modal import Modal
from impactlab.scene import Scene
from impactlab.scene.method import Simulation
from studies.pages import CASES, Study, filled, percent

REPEATS = 7  # the least time of so many runs is shown

LUMPED = {"kind": "finite_element", "elements": 100, "mass": "lumped"}
EXPLICIT = {"kind": "central_difference"}
AXIAL: dict[str, dict[str, Any]] = {
    "continuous": {"solve.model": {"kind": "continuous"}},
    "FE 100 lumped, central difference at courant 1, addition_deletion": {
        "solve.model": LUMPED,
        "solve.integrator": EXPLICIT,
        "solve.step": {"courant": 1.0},
        "contacts.0.law": {"kind": "addition_deletion"},
    },
    "the same at courant 0.9": {
        "solve.model": LUMPED,
        "solve.integrator": EXPLICIT,
        "solve.step": {"courant": 0.9},
        "contacts.0.law": {"kind": "addition_deletion"},
    },
    "FE 100 lumped, central difference at courant 0.5, penalty (0.8 EA/h)": {
        "solve.model": LUMPED,
        "solve.integrator": EXPLICIT,
        "solve.step": {"courant": 0.5},
        "contacts.0.law": {"kind": "penalty", "stiffness": {"relative": 0.8}},
    },
    "modal 400/100, newmark, wave_identification": {"solve.model": {"elements": 400, "modes": 100}},
    "modal 100/40, newmark, wave_identification": {},
    "modal 100/10, newmark, wave_identification": {"solve.model": {"modes": 10}},
    "modal 40 analytic, newmark, wave_identification": {"solve.model": {"kind": "modal", "modes": 40}},
    "modal 40/40, newmark, wave_identification": {"solve.model": {"elements": 40}},
    "modal 10/10, newmark, wave_identification": {"solve.model": {"elements": 10, "modes": 10}},
    "modal 100/70, newmark, wave_identification without residual": {
        "solve.model": {"modes": 70},
        "contacts.0.law": {"residual": False},
    },
    "modal 100/40, newmark, penalty (EA/h)": {"contacts.0.law": {"kind": "penalty", "stiffness": {"relative": 1.0}}},
    "modal 100/40, contact_stabilised_newmark, addition_deletion": {
        "contacts.0.law": {"kind": "addition_deletion"},
        "solve.integrator": {"kind": "contact_stabilised_newmark"},
    },
    "modal 40 analytic, exact_modal, impulse_momentum": {
        "solve.model": {"kind": "modal", "modes": 40},
        "solve.integrator": {"kind": "exact_modal"},
        "contacts.0.law": {"kind": "impulse_momentum"},
    },
}
NAMES = {
    "base": "modal 100/40, newmark, wave_identification",
    "finite_element": "FE lumped, central difference at courant 0.9, addition_deletion",
    "penalty": "FE lumped, central difference at courant 0.5, penalty (0.8 EA/h)",
}


def second_contact(history: AbstractHistory, scene: Scene) -> str:
    """Return from when to when the second contact lasts [T]."""
    if not any(law.answers_force for law in history.method.laws.values()):
        return "-"
    found = [span for span in history.contacts if span.start > 1.8 * scene.round_trip]
    if not found:
        return "missed"
    end = found[-1].end if found[-1].end is not None else history.duration
    return f"{found[0].start / scene.round_trip:.3f} to {end / scene.round_trip:.3f}"


def least_time(scene: Simulation) -> str:
    """Return the least time of several runs, preparation left out [ms]."""
    spent = min(simulate.run(*scene).cost.solve_s for _ in range(REPEATS))
    return f"{1e3 * spent:.1f}"


def axial() -> str:
    """Return the table of methods on the paper's impact."""
    base = il.load_case(CASES / "axial_impact.yaml")
    lines = [
        "| method | mass | face | force away from jumps | second contact [T] | energy gain | steps | time [ms] |",
        "|---|---|---|---|---|---|---|---|",
    ]
    reference = reference_of(*base.simulation())  # the hard contact, also for methods that soften it
    assert reference is not None
    for name, changes in AXIAL.items():
        case = base
        for path, value in changes.items():
            case = case.with_(path, value)
        scene = case.simulation()
        if "analytic" in name:  # a merged block keeps its elements
            scene = scene.but(model=Modal(None, 40))
        history = simulate.run(*scene)
        errors = metrics.errors(history, reference.name, reference.history, scene.scene)
        shown = [percent(errors[key]) for key in ("mass_displacement", "face_displacement", "force_away_from_jumps")]
        steps = str(history.cost.steps) if history.dt is not None else "none"
        gain = percent(history.energy.largest_gain)
        cells = [*shown, second_contact(history, scene.scene), gain]
        if any(warning.code == "constraint_energy" for warning in history.warnings):
            cells = [f"~{cell}" for cell in cells]  # it chatters: its numbers depend on the last bit
        lines.append("| " + " | ".join([name, *cells, steps, least_time(scene)]) + " |")
    return "\n".join(lines)


def others() -> str:
    """Return the table of methods on the other cases."""
    lines = ["| case | method | mass | face | force | impulse |", "|---|---|---|---|---|---|"]
    for file in ("free_rod", "rod_on_wall", "two_rods"):
        case = il.load_case(CASES / f"{file}.yaml")
        reference = reference_of(*case.simulation())
        assert reference is not None
        for method, name in NAMES.items():
            scene = case.method(method).simulation()
            errors = metrics.errors(simulate.run(*scene), reference.name, reference.history, scene.scene)
            shown = [percent(errors[key]) for key in ("mass_displacement", "face_displacement", "force", "impulse")]
            lines.append(f"| {file} | {name} | " + " | ".join(shown) + " |")
    return "\n".join(lines)


def steps() -> str:
    """Return the table of steps for the modal rod under wave identification."""
    base = il.load_case(CASES / "axial_impact.yaml")
    lines = ["| points in the shortest period | mass | face | steps |", "|---|---|---|---|"]
    reference = reference_of(*base.simulation())
    assert reference is not None
    for points in (3, 4, 5, 10, 20, 50):
        scene = base.with_("solve.step", {"points_per_period": points}).simulation()
        try:
            history = simulate.run(*scene)
        except ImpactlabError:
            lines.append(f"| {points} | refused | refused | - |")
            continue
        errors = metrics.errors(history, reference.name, reference.history, scene.scene)
        shown = percent(errors["mass_displacement"]), percent(errors["face_displacement"])
        lines.append(f"| {points} | {shown[0]} | {shown[1]} | {history.cost.steps} |")
    return "\n".join(lines)


def stiffness() -> str:
    """Return the table of penalty stiffnesses on a lumped mesh."""
    base = il.load_case(CASES / "axial_impact.yaml").with_("solve.model", LUMPED).with_("solve.integrator", EXPLICIT)
    lines = ["| stiffness [EA/h] | courant | mass | face | second contact [T] |", "|---|---|---|---|---|"]
    reference = reference_of(*base.simulation())
    assert reference is not None
    for relative, courant in ((0.8, 0.5), (8.0, 0.2), (80.0, 0.07)):
        case = base.with_("contacts.0.law", {"kind": "penalty", "stiffness": {"relative": relative}})
        scene = case.with_("solve.step", {"courant": courant}).simulation()
        history = simulate.run(*scene)
        errors = metrics.errors(history, reference.name, reference.history, scene.scene)
        shown = percent(errors["mass_displacement"]), percent(errors["face_displacement"])
        lines.append(f"| {relative:g} | {courant} | {shown[0]} | {shown[1]} | {second_contact(history, scene.scene)} |")
    return "\n".join(lines)


BASES: tuple[tuple[str, str, dict[str, Any]], ...] = (
    ("free-end, analytic", "addition_deletion", {}),
    ("free-end, analytic", "impedance_residual", {}),
    ("craig_bampton", "addition_deletion", {"basis": "craig_bampton"}),
    ("striker_attached", "addition_deletion", {"basis": "striker_attached"}),
    ("ritz", "addition_deletion", {"basis": "ritz"}),
    ("substructured", "addition_deletion", {"basis": "substructured"}),
    ("macneal", "addition_deletion", {"basis": "macneal"}),
)


def bases() -> str:
    """Return the table of reduced bases: steps cut at the events, and fixed ones."""
    lines = [
        "| basis | N | law | steps | force | face | mass | second contact [T] | unresolved |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    base = il.load_case(CASES / "axial_impact.yaml")
    reference = reference_of(*base.simulation())
    assert reference is not None
    rows: list[tuple[str, int, str, str, dict[str, Any], dict[str, Any]]] = []
    for name, law, options in BASES:
        mesh = {"elements": 40, "order": 8} if options else {}
        for modes in (10, 40):
            solve = {"integrator": {"kind": "exact_modal"}, "events": "located", "step": {"points_per_period": 100.0}}
            rows.append((name, modes, law, "cut at events", {"modes": modes, **mesh, **options}, solve))
    for points in (10, 20, 100):
        solve = {"integrator": {"kind": "moreau_jean"}, "step": {"points_per_period": float(points)}}
        options = {"modes": 10, "elements": 40, "order": 8, "basis": "craig_bampton"}
        rows.append(("craig_bampton", 10, "velocity_complementarity", f"fixed, {points} a period", options, solve))
    for name, modes, law, told, options, solve in rows:
        # Another kind first: a block of the same kind would be merged with the mesh of the case.
        case = base.with_("solve.model", kind="continuous").with_("solve.model", kind="modal", **options)
        case = case.with_("contacts.0.law", kind=law)
        for key, value in solve.items():
            case = case.with_(f"solve.{key}", value)
        scene = case.simulation()
        history = simulate.run(*scene)
        errors = metrics.errors(history, reference.name, reference.history, scene.scene)
        shown = [percent(errors[key]) for key in ("force", "face_displacement", "mass_displacement")]
        lost = percent(float(history.energy.booked["unresolved"][-1]) / history.energy.scale)
        lines.append(
            "| " + " | ".join([name, str(modes), law, told, *shown, second_contact(history, scene.scene), lost]) + " |"
        )
    return "\n".join(lines)


def without_times(page: str) -> str:
    """Return the page without times and without rows that chatter.

    A time is the last cell of a row.
    """
    return re.sub(r"\| [\d.]+ \|$|^.*\| ~.*$", "|", page, flags=re.MULTILINE)


PARTS = {"axial": axial, "bases": bases, "others": others, "steps": steps, "stiffness": stiffness}
STUDY = Study({"how-to-choose.md": filled(PARTS)}, comparable=without_times)
