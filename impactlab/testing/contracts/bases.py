"""Contract suite of bases."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from impactlab.bases.base import AbstractBasis
from impactlab.bases.reduced import ReducedMesh
from impactlab.models.mesh.bars import Mesh
from impactlab.models.mesh.base import AbstractMesh
from impactlab.models.mesh.beams import BeamMesh
from impactlab.models.modal_body import ModalBody
from impactlab.numerics.banded import full
from impactlab.scene.bodies import Beam, End, Rod, Segment
from impactlab.testing.contracts.common import BAR, PIECE, SOFT_BAR, STRUCK, at_most, described

KINDS = (("rod", "free"), ("rod", "clamped"), ("beam", "free"), ("beam", "pinned"), ("beam", "clamped"))


class BasisContract:
    """Properties that every basis must have, on a rod and on a beam.

    Each has two segments and is struck by a mass at its left end.

    Forty elements, twelve modes.
    """

    part: ClassVar[AbstractBasis]
    modes: ClassVar[int] = 12

    def mesh(self, kind: str, right: str) -> AbstractMesh:
        """Return the mesh of a rod or Timoshenko beam of two segments, free at the left."""
        ends = End("free"), End(right)  # type: ignore[arg-type]
        if kind == "beam":
            return BeamMesh(Beam("beam", (BAR, SOFT_BAR), *ends, theory="timoshenko"), 40, "consistent", 0.0)
        soft = Segment(length=0.2, area=6e-4, young=7e10, density=2700.0)
        return Mesh(Rod("rod", (PIECE, soft), *ends), 40, "consistent", 0.0)

    def reduced(self, kind: str, right: str, modes: int | None = None) -> ReducedMesh:
        """Return the mesh in the coordinates of the basis."""
        mesh = self.mesh(kind, right)
        span = self.part.span(mesh, modes or self.modes, STRUCK)
        return ReducedMesh(mesh, span.shapes, span.uncoupled)

    def test_it_has_a_description_and_a_source(self) -> None:
        described(self.part)

    def test_it_has_as_many_coordinates_as_modes_and_rigid_motions(self) -> None:
        for kind, right in KINDS:
            mesh = self.mesh(kind, right)
            span = self.part.span(mesh, self.modes, STRUCK)
            assert span.shapes.shape[1] == self.modes + mesh.rigid.shape[1], f"there are {span.shapes.shape[1]}"
            assert span.closed is None or span.closed[1].shape == span.shapes.shape

    def test_its_coordinates_have_unit_mass_and_squared_frequencies(self) -> None:
        for kind, right in KINDS:
            reduced = self.reduced(kind, right)
            shapes, mesh = reduced.shapes, reduced.mesh
            # Rounding of sums over forty nodes; of the stiffness, relative to its largest entry.
            error = float(np.max(np.abs(shapes.T @ full(mesh.mass) @ shapes - np.eye(shapes.shape[1]))))
            at_most(error, 1e-11, f"the error of the unit mass of a {kind}")
            squared, highest = reduced.frequencies**2, float(full(mesh.stiffness).diagonal().max())
            size = max(squared[-1], highest * float(np.max(shapes**2)))
            error = float(np.max(np.abs(shapes.T @ full(mesh.stiffness) @ shapes - np.diag(squared))))
            at_most(error, 1e-11 * size, f"the error of the squared frequencies of a {kind} [1/s2]")
            assert np.all(np.diff(squared) >= 0.0)
            assert np.count_nonzero(squared == 0.0) == mesh.rigid.shape[1]

    def test_the_rigid_motions_of_a_free_body_are_exact(self) -> None:
        for kind, right in KINDS:
            reduced = self.reduced(kind, right)
            mesh = reduced.mesh
            shares = reduced.shapes.T @ full(mesh.mass) @ mesh.rigid
            error = float(np.max(np.abs(reduced.shapes @ shares - mesh.rigid), initial=0.0))
            at_most(error, 1e-11 * float(np.max(np.abs(mesh.rigid), initial=1.0)), f"the error of those of a {kind}")
            if right == "free":
                # Coordinates of unit velocity are the momentum of each, its mass being 1: the translation's alone.
                velocity = reduced.project_uniform()
                error = abs(float(velocity @ velocity / mesh.momentum_row().sum()) - 1.0)
                at_most(error, 1e-11, f"the relative error of the mass of a {kind}")

    def test_its_frequencies_are_bounds_from_above_and_fall_with_more_modes(self) -> None:
        from scipy.linalg import eigh

        for kind, right in KINDS:
            mesh = self.mesh(kind, right)
            exact = np.sqrt(np.abs(eigh(full(mesh.stiffness), full(mesh.mass), eigvals_only=True)))
            enough = self.modes * {"rod": 2, "beam": 4}[kind]  # a beam has two coordinates in a node
            fewer, more = (self.reduced(kind, right, modes).frequencies for modes in (self.modes, enough))
            # Rayleigh and Ritz: no frequency of a smaller space lies below its own in a larger one. Rounding: the
            # eigenvalues of the whole mesh are good to the rounding of their largest.
            slack = 1e-13 * exact[-1] ** 2
            assert np.all(fewer**2 >= exact[: fewer.size] ** 2 - slack)
            assert np.all(more**2 >= exact[: more.size] ** 2 - slack)
            rigid = mesh.rigid.shape[1]
            first = slice(rigid, rigid + 3)
            worst = [float(np.max(np.abs(found[first] / exact[first] - 1.0))) for found in (fewer, more)]
            at_most(worst[1], worst[0] + slack / exact[rigid] ** 2, f"the error of a {kind} with more modes")
            at_most(worst[1], 1e-3, f"the relative error of the first three frequencies of a {kind}")

    def test_modes_and_residual_flexibility_add_up_to_the_static_compliance(self) -> None:
        for kind, right in KINDS:
            reduced = self.reduced(kind, right)
            body = ModalBody(reduced.mesh.body, 0.0, reduced, paper_rule=False)
            elastic = reduced.frequencies > 0.0
            largest = abs(reduced.static(0.0, "displacement", 0.0))
            for x in np.linspace(0.0, 0.99, 6) * PIECE.length:
                kept = np.sum(
                    (reduced.row(float(x), "displacement") * reduced.row(0.0, "displacement"))[elastic]
                    / reduced.frequencies[elastic] ** 2
                )
                left = body.left_out(float(x), "displacement", 0.0)
                error = abs(float(kept + left - reduced.static(float(x), "displacement", 0.0)))
                at_most(error, 1e-12 * largest, f"the error of the compliance of a {kind} at x = {x:.4g} m [m/N]")
                if type(self.part).static_exact and right == "clamped":
                    # The condition of forty elements, 1e3 of a rod and 1e6 of this beam, times the rounding of a small
                    # eigenvalue problem.
                    limit = {"rod": 1e-9, "beam": 1e-6}[kind] * largest
                    at_most(abs(left), limit, f"the compliance left out of a {kind} at x = {x:.4g} m [m/N]")

    def test_all_modes_are_the_whole_mesh(self) -> None:
        if not type(self.part).complete:
            return
        from scipy.linalg import eigh

        for kind in ("rod", "beam"):
            mesh = self.mesh(kind, "clamped")
            squared = eigh(full(mesh.stiffness), full(mesh.mass), eigvals_only=True)
            found = self.reduced(kind, "clamped", squared.size).frequencies ** 2
            error = float(np.max(np.abs(found - squared)))
            at_most(error, 1e-10 * squared[-1], f"the error of a squared frequency of a {kind} [1/s2]")
