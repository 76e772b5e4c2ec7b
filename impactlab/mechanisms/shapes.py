"""Shapes of a flexible link, from its meshes.

They bend between its hinges or from its root, and stretch from its root.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from impactlab.bases.shapes import constraint_modes, eigenvectors, fixed_modes
from impactlab.errors import CaseError
from impactlab.mechanisms.integrals import Integrals, Shapes, gauss_points, integrals, shortening
from impactlab.models.mesh.bars import Mesh
from impactlab.models.mesh.base import AbstractMesh
from impactlab.models.mesh.beams import BeamMesh
from impactlab.numerics.banded import full
from impactlab.scene.bodies import End, Link, Rod, Segment
from impactlab.types import Array, Quantity

SAME_NODE = 1e-9  # of an element


class FlexibleLink(NamedTuple):
    """A flexible link in its shapes."""

    integrals: Integrals
    frequency: float  # rad/s, the highest of its bending and stretching shapes
    meshes: tuple[BeamMesh, Mesh]
    shapes: tuple[Array, Array]  # (n_dof, nb) and (n_dof, na) over the meshes
    shortening: Array  # (elements + 1, nb, nb) at the nodes

    def place(self, x: float) -> Array:
        """Return psi, phi and S at x [m], flat.

        S between nodes is that of the element's own slopes.
        """
        bent, stretched = self.meshes
        node = int(np.searchsorted(bent.nodes, x + SAME_NODE * bent.lengths[0], side="right")) - 1
        upto = self.shortening[node]
        rest = x - float(bent.nodes[node])
        if rest > SAME_NODE * bent.lengths[0]:
            points, weights = np.polynomial.legendre.leggauss(5)
            for point, weight in zip(points, weights, strict=True):
                slope = bent.row(float(bent.nodes[node]) + 0.5 * rest * (1.0 + point), "rotation") @ self.shapes[0]
                upto = upto + 0.5 * rest * weight * np.outer(slope, slope)
        psi = stretched.row(x, "displacement") @ self.shapes[1]
        return np.concatenate((psi, bent.row(x, "displacement") @ self.shapes[0], upto.ravel()))


def read(mesh: AbstractMesh, places: Array, quantity: Quantity, shapes: Array) -> Array:
    """Return a quantity of shapes at places, (n_places, n_shapes), in parts that fit the memory."""
    return np.array([mesh.row(place, quantity) @ shapes for place in places]).reshape(len(places), shapes.shape[1])


@lru_cache(maxsize=8)
def flexible_link(link: Link, elements: int, bending_modes: int) -> FlexibleLink:
    """Return a link in shapes of its meshes.

    A hinged link bends as a beam pinned at both ends, a clamped one as a cantilever; it stretches as a rod clamped at
    its root, in the static shape of a force on its end and modes with the end held (Craig and Bampton 1968).
    """
    beam = link.beam
    if beam is None:
        raise ValueError("a rigid link has no shapes")
    hinged = link.joint == "hinge"
    ends = (End("pinned"), End("pinned")) if hinged else (End("clamped"), End("free"))
    bent = BeamMesh(replace(beam, left=ends[0], right=ends[1]), elements, "consistent", 0.0)
    segments = tuple(Segment(each.length, each.area, each.young, each.density) for each in beam.segments)
    stretched = Mesh(Rod(beam.name, segments, End("clamped"), End("free")), elements, "consistent", 0.0)
    for count, mesh, name in ((bending_modes, bent, "modes"), (link.axial_modes, stretched, "axial_modes")):
        if count > mesh.mass.shape[1]:
            raise CaseError(
                f"{count} {name} of link '{link.name}', and its mesh of {elements} elements has {mesh.mass.shape[1]}",
                remedy="Give fewer, or more elements.",
                path=f"solve.models.{link.name}",
            )
    phi = eigenvectors(bent, bending_modes)
    psi = np.zeros((stretched.mass.shape[1], 0))
    if link.axial_modes:
        end = stretched.mass.shape[1] - 1
        inside = np.arange(end)
        psi = np.hstack(
            (constraint_modes(stretched, np.array([end])), fixed_modes(stretched, inside, link.axial_modes - 1))
        )
    x, _ = gauss_points(bent.nodes)
    slopes = read(bent, x, "rotation", phi)
    axial_stiffness = psi.T @ full(stretched.stiffness) @ psi
    bending = bent.quotients(phi)
    shapes = Shapes(
        nodes=bent.nodes,
        density=np.array([beam.segments[number].density * beam.segments[number].area for number in bent.of_segment]),
        axial=read(stretched, x, "displacement", psi),
        bending=read(bent, x, "displacement", phi),
        slopes=slopes,
        axial_end=stretched.row(beam.length, "displacement") @ psi,
        bending_end=bent.row(beam.length, "displacement") @ phi,
        root_slopes=bent.row(0.0, "rotation") @ phi,
        end_slopes=bent.row(beam.length, "rotation") @ phi,
        axial_stiffness=axial_stiffness,
        bending_stiffness=bending,
    )
    highest = float(np.sqrt(bending.max(initial=0.0)))
    if link.axial_modes:
        mass = psi.T @ full(stretched.mass) @ psi
        highest = max(highest, float(np.sqrt(np.linalg.eigvals(np.linalg.solve(mass, axial_stiffness)).real.max())))
    whole = integrals(shapes)
    return FlexibleLink(whole, highest, (bent, stretched), (phi, psi), shortening(bent.nodes, slopes)[1])
