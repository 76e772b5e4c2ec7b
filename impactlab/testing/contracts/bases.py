"""What every basis must keep."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from impactlab.banded import full
from impactlab.bases.base import AbstractBasis
from impactlab.bases.reduced import ReducedMesh
from impactlab.models.mesh import Mesh
from impactlab.models.modal_body import ModalBody
from impactlab.scene import End, Rod, Segment
from impactlab.testing.contracts.common import PIECE, STRUCK, described


class BasisContract:
    """What every basis must keep: on a rod of two segments struck by a mass at its left end, 40 elements, 12 modes."""

    part: ClassVar[AbstractBasis]
    modes: ClassVar[int] = 12

    def mesh(self, right: str) -> Mesh:
        """Return the mesh of a rod of two segments."""
        soft = Segment(length=0.2, area=6e-4, young=7e10, density=2700.0)
        return Mesh(Rod("rod", (PIECE, soft), End("free"), End(right)), 40, "consistent", 0.0)  # type: ignore[arg-type]

    def reduced(self, right: str, modes: int | None = None) -> ReducedMesh:
        """Return the mesh in the coordinates of the basis."""
        mesh = self.mesh(right)
        span = self.part.span(mesh, modes or self.modes, STRUCK)
        return ReducedMesh(mesh, span.shapes, span.uncoupled)

    def test_it_says_what_it_is_and_where_it_comes_from(self) -> None:
        described(self.part)

    def test_it_has_as_many_coordinates_as_modes_and_rigid_motion(self) -> None:
        for right, rigid in (("free", 1), ("clamped", 0)):
            span = self.part.span(self.mesh(right), self.modes, STRUCK)
            assert span.shapes.shape[1] == self.modes + rigid
            assert span.closed is None or span.closed[1].shape == span.shapes.shape

    def test_its_coordinates_have_unit_mass_and_squared_frequencies(self) -> None:
        for right in ("free", "clamped"):
            reduced = self.reduced(right)
            shapes, mesh = reduced.shapes, reduced.mesh
            # Rounding of sums over forty coordinates; of the stiffness, relative to its largest entry.
            assert np.max(np.abs(shapes.T @ full(mesh.mass) @ shapes - np.eye(shapes.shape[1]))) < 1e-11
            squared = reduced.frequencies**2
            assert np.max(np.abs(shapes.T @ full(mesh.stiffness) @ shapes - np.diag(squared))) < 1e-11 * squared[-1]
            assert np.all(np.diff(squared) >= 0.0)
            assert (squared[0] == 0.0) == (right == "free")

    def test_the_rigid_motion_of_a_free_rod_is_exact(self) -> None:
        reduced = self.reduced("free")
        velocity = reduced.project_uniform()  # coordinates of unit velocity: the momentum of each, its mass being 1
        assert np.max(np.abs(reduced.shapes @ velocity - 1.0)) < 1e-11
        assert abs(velocity @ velocity / reduced.mesh.momentum_row().sum() - 1.0) < 1e-12
        assert np.max(np.abs(velocity[1:])) < 1e-11 * velocity[0]

    def test_its_frequencies_are_bounds_from_above_and_fall_with_more_modes(self) -> None:
        from scipy.linalg import eigh

        for right in ("free", "clamped"):
            mesh = self.mesh(right)
            exact = np.sqrt(np.abs(eigh(full(mesh.stiffness), full(mesh.mass), eigvals_only=True)))
            fewer, more = self.reduced(right).frequencies, self.reduced(right, 2 * self.modes).frequencies
            # Rayleigh and Ritz: no frequency of a smaller space lies below its own in a larger one. Rounding: the
            # eigenvalues of the whole mesh are good to the rounding of their largest.
            slack = 1e-13 * exact[-1] ** 2
            assert np.all(fewer**2 >= exact[: fewer.size] ** 2 - slack)
            assert np.all(more**2 >= exact[: more.size] ** 2 - slack)
            first = slice(int(right == "free"), 4)
            worst = [np.max(np.abs(found[first] / exact[first] - 1.0)) for found in (fewer, more)]
            assert worst[1] <= worst[0] + 1e-9
            assert worst[1] < 1e-3  # twenty-four modes, the first four frequencies

    def test_what_is_kept_and_what_is_left_out_are_the_static_answer(self) -> None:
        for right in ("free", "clamped"):
            reduced = self.reduced(right)
            rod = Rod("rod", (PIECE,), End("free"), End(right))
            body = ModalBody(rod, 0.0, reduced, paper_rule=False)
            elastic = reduced.frequencies > 0.0
            largest = abs(reduced.static(0.0, "displacement", 0.0))
            for x in np.linspace(0.0, 0.99, 6) * PIECE.length:
                kept = np.sum(
                    (reduced.row(float(x), "displacement") * reduced.row(0.0, "displacement"))[elastic]
                    / reduced.frequencies[elastic] ** 2
                )
                left = body.left_out(float(x), "displacement", 0.0)
                assert abs(kept + left - reduced.static(float(x), "displacement", 0.0)) < 1e-12 * largest
                if type(self.part).static_exact and right == "clamped":
                    # The condition of forty elements, 1e3, times the rounding of a small eigenvalue problem.
                    assert abs(left) < 1e-9 * largest

    def test_all_modes_are_the_whole_mesh(self) -> None:
        if not type(self.part).complete:
            return
        from scipy.linalg import eigh

        mesh = self.mesh("clamped")
        squared = eigh(full(mesh.stiffness), full(mesh.mass), eigvals_only=True)
        found = self.reduced("clamped", squared.size).frequencies ** 2
        assert np.max(np.abs(found - squared)) < 1e-10 * squared[-1]
