"""Bases of the modal model on beams."""

from __future__ import annotations

import numpy as np
import pytest

from impactlab import simulate
from impactlab.bases.craig_bampton import CraigBampton
from impactlab.bases.eigenvectors import Eigenvectors
from impactlab.bases.macneal import Macneal
from impactlab.bases.reduced import ReducedMesh
from impactlab.bases.ritz import Ritz
from impactlab.bases.shapes import constraint_modes, pieces, still_free, struck
from impactlab.bases.striker_attached import StrikerAttached
from impactlab.bases.substructured import Substructured
from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.errors import CaseError
from impactlab.integrators.exact_modal import ExactModal
from impactlab.models.base import Face
from impactlab.models.mesh.beams import BeamMesh
from impactlab.models.modal import Modal
from impactlab.numerics.banded import full
from impactlab.scene import Beam, End
from tests.reference.beam_scenes import STEEL, sheared, sphere_on_beam

BASES = (Eigenvectors(), CraigBampton(), Ritz(), Macneal(), Substructured(), StrikerAttached())
PUSHED = tuple(basis for basis in BASES if not isinstance(basis, Macneal))  # by a law that needs mass at the face


def mesh(left, right, segment=STEEL, elements=40):
    return BeamMesh(Beam("beam", (segment,), End(left), End(right)), elements, "consistent", 0.0)


def name(basis):
    return type(basis).__name__


@pytest.mark.parametrize("basis", PUSHED, ids=name)
def test_sphere_on_a_beam(basis):
    history = simulate.run(*sphere_on_beam(Modal(60, 20, basis=basis), ExactModal(), 2e-7))
    # Timoshenko's case: one contact of 156.40 us with a peak of 4.9771 N at 72.6 us; the sphere leaves at -0.302324.
    assert [event.kind for event in history.events] == ["close", "open"]
    assert history.events[1].time == pytest.approx(156.40e-6, rel=1e-4)
    assert history.contacts[0].peak_force == pytest.approx(4.9771, rel=1e-4)
    assert float(history.evaluate(2e-4, "velocity:sphere")) == pytest.approx(-0.302324e-2, rel=2e-4)


@pytest.mark.parametrize("basis", BASES, ids=name)
@pytest.mark.parametrize("at", [0.0, 0.3, 0.5])
def test_hard_mass_on_a_free_beam_keeps_momentum_and_turning(basis, at):
    scene = sphere_on_beam(
        Modal(40, 20, basis=basis), ExactModal(), 2e-7, ends=("free", "free"), at=at, law=AdditionDeletion(),
        segment=sheared(STEEL), duration=6e-5,
    )  # fmt: skip
    plan = simulate.prepare(*scene)
    system = plan.built["beam"].system
    row = plan.built["beam"].model.row(at * STEEL.length, "displacement")
    # Jerk the face alone: the rigid motions take what a rigid beam takes, whatever the basis.
    jump = row / system.mass[0]
    momentum = plan.built["beam"].model.momentum_row()
    assert float(momentum @ jump) == pytest.approx(1.0, abs=1e-9)
    history = simulate.run(*scene)
    given = sum(span.impulse for span in history.contacts)
    sphere = float(history.evaluate(scene.scene.duration, "velocity:sphere"))
    assert given > 0.0
    assert scene.scene.bodies["sphere"].mass * (0.01 - sphere) == pytest.approx(given, rel=1e-9)


def test_a_kept_deflection_cuts_no_beam_and_a_kept_node_does():
    of_free = mesh("free", "free")
    assert [piece.size for piece in pieces(of_free, np.array([40]))] == [81]
    assert [piece.size for piece in pieces(of_free, np.array([40, 41]))] == [40, 40]
    assert [piece.size for piece in pieces(of_free, np.array([0, 40, 41]))] == [39, 40]


@pytest.mark.parametrize(("ends", "loose"), [(("free", "free"), 1), (("pinned", "free"), 0), (("clamped", "free"), 0)])
def test_constraint_modes_of_a_beam_struck_at_one_place(ends, loose):
    body = mesh(*ends)
    kept = struck(body, (Face(0.5 * STEEL.length, 0, 1.0),))
    assert kept.size == 1
    left = still_free(body, kept)
    assert left.shape[1] == loose
    assert np.abs(left[kept]).max(initial=0.0) < 1e-12 * np.abs(left).max(initial=1.0)
    shapes = constraint_modes(body, kept)
    force = full(body.stiffness) @ shapes[:, 0]
    others = np.setdiff1d(np.arange(force.size), kept)
    # No force but at the place itself; rounding of the largest entries.
    assert np.abs(force[others]).max() < 1e-9 * np.abs(full(body.stiffness)).max() * np.abs(shapes).max()
    assert shapes[kept[0], 0] == 1.0


@pytest.mark.parametrize("basis", BASES, ids=name)
def test_a_beam_without_contacts_keeps_its_rigid_motions(basis):
    body = mesh("free", "free")
    faces = (Face(0.25 * STEEL.length, 0, 0.1),)
    reduced = ReducedMesh(body, *basis.span(body, 14, faces)[:2])
    motions = body.rigid
    shares = reduced.shapes.T @ full(body.mass) @ motions
    assert np.abs(reduced.shapes @ shares - motions).max() < 1e-10 * np.abs(motions).max()
    assert np.count_nonzero(reduced.frequencies == 0.0) == 2


def test_a_mesh_too_large_for_its_modes_is_refused_with_the_number_of_elements_allowed():
    with pytest.raises(CaseError, match="elements times order up to 1000"):
        Modal(1100, 10).build_beam(Beam("beam", (STEEL,), End("free"), End("free")), 0.0)


@pytest.mark.parametrize(
    ("basis", "modes", "needed"), [(CraigBampton(), 0, None), (Substructured(pieces=6, others=2), 3, 19)]
)
def test_too_few_coordinates_for_a_beam_are_refused_with_a_number(basis, modes, needed):
    body = mesh("free", "free")
    faces = (Face(0.0, 0, 0.1),)
    if needed is None:
        # The constraint mode and the turn about the struck place are the two rigid motions themselves.
        assert basis.span(body, modes, faces).shapes.shape[1] == 2
        return
    with pytest.raises(CaseError, match=f"needs {needed} modes or more"):
        basis.span(body, modes, faces)
    assert basis.span(body, needed, faces).shapes.shape[1] == needed + 2
