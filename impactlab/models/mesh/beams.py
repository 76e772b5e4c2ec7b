"""A beam as a row of beam elements, for `finite_element` and for the shapes of `modal`."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import final

import numpy as np

from impactlab.errors import CaseError
from impactlab.models.base import Face, Operators
from impactlab.models.mesh.absorbing import laid_out
from impactlab.models.mesh.bar_elements import MassMatrix
from impactlab.models.mesh.base import NODE_TOL, AbstractMesh, null_space, part, quadratic_forms
from impactlab.models.mesh.beam_elements import (
    GAUSS_PLACES,
    PLACES,
    curvatures,
    deflections,
    lumped,
    matrices,
    rotations,
    shear_ratio,
    shear_strain,
    slope_of_curvature,
    stretched,
)
from impactlab.models.mesh.beam_runs import element_runs
from impactlab.models.mesh.beam_sides import missing_inside, sides_of
from impactlab.numerics.banded import grounded, multiply
from impactlab.scene.bodies import Beam, BeamSegment, End, Profile
from impactlab.types import QUANTITIES_OF_BEAM, Array, Quantity

MIN_STEADY = 1e-6  # of the rate squared, squared frequency of a beam that turns: a lower one is rounding
STEP = 1e-4  # of an element, over which the slope of an initial deflection is taken


@final
class BeamMesh(AbstractMesh):
    """A beam in deflections and rotations of its nodes, held ones left out.

    Deflection and rotation are those of elements without load between their nodes (`beam_elements`); bending moment and
    shear force jump between elements (`beam_sides`), and where segments join and at a contact are those on the right.
    Damping is Rayleigh's, that of the material, which here damps shear and bending alike, and the dashpots at the ends.
    At an infinite end the mesh goes on in an absorbing layer (`absorbing`). Of a beam that turns the stiffness is
    K + K_N - Omega^2 M, with K_N by the centrifugal tension and M the mass that the centrifugal force pulls along the
    motion.

    Parameters
    ----------
    beam : Beam
    elements : int
        Elements over the whole beam, shared among segments by the travel time of axial waves.
    mass : "consistent" or "lumped" (diagonal)
    gravity : float
        m/s2, along +u.
    order : int
        1.
    duration : float
        Of the run [s], which sets how long absorbing layers are at least.
    faces : tuple of Face
        Contacts of the beam.

    Raises `CaseError` for an ``order`` above 1 and for a redistributed mass, which only bars have.
    """

    motions = ("displacement", "rotation")

    def __init__(
        self,
        beam: Beam,
        elements: int,
        mass: MassMatrix,
        gravity: float,
        order: int = 1,
        duration: float = 0.0,
        faces: tuple[Face, ...] = (),
    ) -> None:
        check_options(beam, order, mass)
        self.body = self.beam = beam
        self._gravity, self.order, self.places = gravity, 1, ()
        self.lumped = mass == "lumped"
        self._layout = laid_out(beam, elements, self.lumped, duration)
        self._given = elements, mass, gravity
        self._faces, self.struck = faces, tuple(face.x for face in faces)
        self.lengths, self.of_segment = self._layout.lengths, self._layout.segment
        self.near = NODE_TOL * float(self.lengths.min())
        self.nodes: Array = self._layout.start + np.concatenate(([0.0], self.lengths.cumsum()))
        self.nodes[np.abs(self.nodes) < self.near] = 0.0
        self.nodes[np.abs(self.nodes - beam.length) < self.near] = beam.length
        self.ends: tuple[tuple[int, End], ...] = ((0, beam.left), (len(self.nodes) - 1, beam.right))
        held = [2 * node for node, end in self.ends if end.kind in ("clamped", "pinned")]
        held += [2 * node + 1 for node, end in self.ends if end.kind == "clamped"]
        is_kept = np.ones(2 * len(self.nodes), bool)
        is_kept[held] = False
        self._kept = is_kept.nonzero()[0]
        self._rows = {}
        self._tensions = self._centrifugal_tensions()
        whole = self._assembled()
        uniform = np.zeros(2 * len(self.nodes))
        uniform[::2] = 1.0
        self._uniform, self._momentum = uniform[self._kept], multiply(whole[0], uniform)[self._kept]
        cut = [part(matrix, self._kept) for matrix in whole]
        self.mass: Array = cut[0][:1] if self.lumped else cut[0]
        self.damping: Array = cut[1] if np.count_nonzero(cut[1][1:]) else cut[1][:1]
        self.stiffness: Array = cut[2]
        self._softened = cut[3]
        self.rigid, self.pins = self._rigid_motions()
        self._check_preload()

    def for_run(self, duration: float) -> BeamMesh:
        """Return the mesh with absorbing layers for a run of a duration [s].

        It is the mesh itself if no end is infinite.
        """
        if not any(end.kind == "infinite" for _, end in self.ends):
            return self
        elements, mass, gravity = self._given
        return BeamMesh(self.beam, elements, mass, gravity, duration=duration, faces=self._faces)

    def operators(self) -> Operators:
        rotation, turned = self.beam.rotation, None
        stated = self.stated(
            self.highest_of_elements(), self._uniform, self._gravity, self.at_ends("dashpot")[self._kept]
        )
        if rotation is not None:  # the centrifugal part of a row's sum would be lost beside the bending part
            softened = rotation.squared * self._softened
            ground = grounded(self.stiffness + softened) - multiply(softened, np.ones(softened.shape[1]))
            stated = stated._replace(ground_springs=ground)
            turned = self.beam.softening * self.mass[0] - softened[0]
        if self.lumped:  # only schemes for a lumped mass walk over elements
            stated = stated._replace(beam_elements=element_runs(self.beam, self._elastic, turned))
        return stated

    def element_matrices(self, number: int) -> tuple[Array, Array]:
        segment, h = self.beam.segments[self.of_segment[number]], float(self.lengths[number])
        each = matrices(segment, h)
        mass = np.diag(lumped(segment, h)) if self.lumped else each.mass
        pulled = self.beam.tension
        if self._tensions is not None:
            pulled += float(self._tensions[number].max())
        return each.stiffness + max(0.0, pulled) * each.tension, mass

    def left_out(self, x: float, quantity: Quantity, face: float) -> float:
        """Return the internal force at x that elements lack per force at ``face`` between nodes."""
        struck, at = self._place(face)
        if quantity not in ("bending_moment", "shear_force") or at in (0.0, 1.0):
            return 0.0
        sides = sides_of(self, self.nodes, (*self._place(x), x), quantity)
        return missing_inside(self, sides, (struck, at), quantity)

    def _place(self, x: float) -> tuple[int, float]:
        """Return the element that holds x [m], and the place in it (0 to 1)."""
        element = int(self.nodes.searchsorted(x + self.near, side="right")) - 1
        element = min(max(element, 0), len(self.lengths) - 1)
        place = (x - float(self.nodes[element])) / float(self.lengths[element])
        return element, 0.0 if abs(place) <= NODE_TOL else 1.0 if abs(place - 1.0) <= NODE_TOL else place

    def _row(self, x: float, quantity: Quantity) -> Array:
        row = np.zeros(2 * len(self.nodes))
        for number, at, share in sides_of(self, self.nodes, (*self._place(x), x), quantity):
            row[2 * number : 2 * number + 4] += share * self._of_element(number, at, quantity)
        return row[self._kept]

    def _of_element(self, number: int, place: float, quantity: Quantity) -> Array:
        """Return a quantity at a place of an element per coordinate of its nodes.

        The place is from 0 to 1, the result of shape (4,).
        """
        h, segment = float(self.lengths[number]), self.beam.segments[self.of_segment[number]]
        phi = shear_ratio(segment, h)
        if quantity == "displacement":
            return deflections(place, h, phi)
        if quantity == "rotation":
            return rotations(place, h, phi)
        if quantity == "bending_moment":
            return np.asarray(segment.bending_stiffness * curvatures(place, h, phi))
        if quantity == "shear_force":
            return np.asarray(-segment.bending_stiffness * slope_of_curvature(h, phi))
        raise no_such(quantity)

    def momentum_row(self) -> Array:
        return self._momentum

    def grid(self) -> Array:
        return self.nodes[(self.nodes >= 0.0) & (self.nodes <= self.beam.length)]

    def coordinates(self, profile: Profile) -> Array:
        """Return the coordinates of an initial deflection.

        A rotation is its slope, as without shear deformation.
        """
        step = STEP * float(self.lengths.min())
        inside = np.clip(self.nodes, 0.0, self.beam.length)  # in a layer the end's deflection and slope go on
        # Differences of second order, one-sided at the ends.
        middle = np.clip(inside, step, self.beam.length - step)
        low, mean, high = (profile(middle + shift) for shift in (-step, 0.0, step))
        slopes = (high - low) / (2.0 * step) + (high - 2.0 * mean + low) * (inside - middle) / step**2
        values = np.empty(2 * len(self.nodes))
        values[1::2] = slopes
        values[::2] = profile(inside) + slopes * (self.nodes - inside)
        return values[self._kept]

    def quotients(self, shapes: Array) -> Array:
        nodal = np.zeros((2 * len(self.nodes), shapes.shape[1]))
        nodal[self._kept] = shapes
        squares = np.zeros(shapes.shape[1])
        for at in self._layout.alike:
            h, segment = float(self.lengths[at[0]]), self.beam.segments[self.of_segment[at[0]]]
            phi = shear_ratio(segment, h)
            # The rigid motion of each element is taken off first: its remainder in a difference would be rounding.
            turn = (nodal[2 * at + 2] - nodal[2 * at]) / h
            local = np.array([nodal[2 * at + 1] - turn, nodal[2 * at + 3] - turn])
            for place in PLACES:
                bend = np.tensordot(curvatures(place, h, phi)[1::2], local, 1)
                squares += 0.5 * h * segment.bending_stiffness * np.square(bend).sum(axis=0)
            if phi > 0.0:
                sheared = np.tensordot(shear_strain(h, phi)[1::2], local, 1)
                squares += h * segment.shear_stiffness * np.square(sheared).sum(axis=0)
            if self.beam.tension != 0.0:
                pulled = matrices(segment, h).tension * self.beam.tension
                local = np.stack([nodal[2 * at] - nodal[2 * at], nodal[2 * at + 1], turn * h, nodal[2 * at + 3]])
                squares += np.einsum("ikj,il,lkj->j", local, pulled, local)
            if self._tensions is not None:
                pulled = stretched(segment, h, self._tensions[at])
                local = np.stack([np.zeros_like(turn), nodal[2 * at + 1], turn * h, nodal[2 * at + 3]])
                squares += np.einsum("ikj,kil,lkj->j", local, pulled, local)
        for node, end in self.ends:
            if end.kind == "spring":
                squares += end.value * nodal[2 * node] ** 2 + end.rotational * nodal[2 * node + 1] ** 2
        if self.beam.rotation is not None:
            squares -= self.beam.rotation.squared * quadratic_forms(self._softened, shapes)
        return squares

    def _centrifugal_tensions(self) -> Array | None:
        """Return tensions (n_elements, 4) [N] at the Gauss points; None for a beam at rest."""
        if self.beam.rotation is None:
            return None
        return self.beam.steady_beam(self.beam.rotation).tension(
            self.nodes[:-1, None] + self.lengths[:, None] * GAUSS_PLACES
        )

    def _softening(self, segment: BeamSegment, h: float) -> Array:
        """Return the part (4, 4) of an element's mass that the centrifugal force pulls.

        The pull is along the motion. In the plane of rotation it is the part of the deflection: a section that rotates
        keeps its distances from the axis. Across the plane it is the part of the rotation, by which the section's
        fibres move along the radius.
        """
        whole, moved = (
            np.diag(lumped(each, h)) if self.lumped else matrices(each, h).mass
            for each in (segment, replace(segment, rotary_inertia=0.0))
        )
        return moved if self.beam.softening else whole - moved

    def _assembled(self) -> tuple[Array, Array, Array, Array]:
        """Return mass, damping, stiffness and softening mass of all nodes and ends, (4, 2 n_nodes) each."""
        n, beam = 2 * len(self.nodes), self.beam
        mass, damping, stiffness, softened = np.zeros((4, n)), np.zeros((4, n)), np.zeros((4, n)), np.zeros((4, n))
        self._elastic = np.zeros((len(self.lengths), 4, 4))  # stiffness of each element
        for at in self._layout.alike:
            h, segment = float(self.lengths[at[0]]), beam.segments[self.of_segment[at[0]]]
            each = matrices(segment, h)
            own = np.diag(lumped(segment, h)) if self.lumped else each.mass
            self._elastic[at] = elastic = each.stiffness + beam.tension * each.tension
            if self._tensions is not None:
                pulled = stretched(segment, h, self._tensions[at])
                self._elastic[at] += pulled
            retardation, drag = float(self._layout.retardation[at[0]]), float(self._layout.drag[at[0]])
            turning = float(self._layout.turning[at[0]])
            blocks = [(mass, own), (stiffness, elastic)]
            if retardation or drag or turning:
                turned = np.diag([0.0, 0.5 * h, 0.0, 0.5 * h]) if self.lumped else each.tension
                blocks.append((damping, retardation * each.stiffness + drag * own + turning * turned))
            if self._tensions is not None:
                blocks.append((stiffness, np.moveaxis(pulled, 0, -1)))
                blocks.append((softened, self._softening(segment, h)))
            first, last = 2 * int(at[0]), 2 * int(at[-1]) + 1  # elements that are alike stand side by side
            for matrix, element in blocks:
                for i in range(4):
                    for j in range(i + 1):
                        matrix[i - j, first + j : last + j : 2] += element[i, j]
        for matrix, kind in ((mass, "mass"), (damping, "dashpot"), (stiffness, "spring")):
            matrix[0] += self.at_ends(kind)
        if beam.rotation is not None:
            softened[0] += self.at_ends("mass") * bool(beam.softening)
            stiffness -= beam.rotation.squared * softened
        if beam.damping.mass or beam.damping.stiffness:
            damping += beam.damping.mass * mass + beam.damping.stiffness * stiffness
        return mass, damping, stiffness, softened

    def _rigid_motions(self) -> tuple[Array, tuple[int, ...]]:
        """Return unstrained motions a + b x, mass-normalised, and coordinates that stop them."""
        strained = self.beam.tension != 0.0 or self.beam.rotation is not None
        rows = [[0.0, 1.0]] if strained else []  # a string under tension resists its rotation
        for node, end in self.ends:
            x = float(self.nodes[node]) / self.beam.length
            if end.kind in ("clamped", "pinned") or (end.kind == "spring" and end.value > 0.0):
                rows.append([1.0, x])
            if end.kind == "clamped" or end.rotational > 0.0:
                rows.append([0.0, 1.0])
        free = np.eye(2) if not rows else null_space(np.array(rows))
        motions = np.zeros((2 * len(self.nodes), free.shape[1]))
        motions[::2] = free[0] + np.outer(self.nodes / self.beam.length, free[1])
        motions[1::2] = free[1] / self.beam.length
        rigid: Array = motions[self._kept]
        for i in range(rigid.shape[1]):
            for j in range(i):
                rigid[:, i] -= rigid[:, j] * (rigid[:, j] @ multiply(self.mass, rigid[:, i]))
            rigid[:, i] /= np.sqrt(rigid[:, i] @ multiply(self.mass, rigid[:, i]))
        first, last = (int(np.searchsorted(self._kept, index)) for index in (0, 2 * len(self.nodes) - 2))
        if rigid.shape[1] == 2:
            return rigid, (first, last)
        if rigid.shape[1] == 1:
            ends = [(abs(rigid[i, 0]), i) for i in (first, min(last, len(rigid) - 1))]
            return rigid, (max(ends)[1],)
        return rigid, ()

    def _check_preload(self) -> None:
        """Raise `CaseError` where preload or rotation buckle the beam: its stiffness is then not positive."""
        rotation = self.beam.rotation
        if self.beam.tension >= 0.0 and rotation is None:
            return
        from scipy.linalg import LinAlgError, cholesky_banded

        grounded = self.stiffness.copy()
        grounded[0, list(self.pins)] *= 2.0
        if rotation is not None:
            grounded[: len(self.mass)] -= MIN_STEADY * rotation.squared * self.mass
        try:
            cholesky_banded(grounded, lower=True)
        except LinAlgError:
            if rotation is not None:
                raise buckled(self.beam) from None
            raise CaseError(
                f"the preload of {-self.beam.tension:.6g} N buckles '{self.beam.name}': its stiffness is not positive",
                remedy="Give a smaller compression, or a stiffer support.",
                path=f"bodies.{self.beam.name}.tension",
            ) from None


def check_options(beam: Beam, order: int, mass: MassMatrix) -> None:
    """Raise `CaseError` where a beam is given an option of bar elements."""
    if order > 1:
        raise CaseError(
            f"order {order} applies only to bar elements, but '{beam.name}' is a beam. Allowed: order 1",
            remedy="Leave order out, and give more elements.",
            path="solve.model.order",
        )
    if mass == "redistributed":
        raise CaseError(
            f"mass 'redistributed' applies only to bar elements, but '{beam.name}' is a beam",
            remedy="Give mass: consistent or lumped.",
            path="solve.model.mass",
        )


def buckled(beam: Beam) -> CaseError:
    """Return the error of a beam that has no stable steady state under rotation."""
    rate = math.nan if beam.rotation is None else beam.rotation.rate
    return CaseError(
        f"at {rate:.6g} rad/s '{beam.name}' buckles under its centrifugal force, or swings about "
        "its support: its stiffness is not positive",
        remedy="Give a lower rate, or clamp the end nearer to the axis.",
        path=f"bodies.{beam.name}.rotation",
    )


def no_such(quantity: str) -> CaseError:
    """Return the error of a quantity that no beam has."""
    return CaseError(
        f"a beam has no {quantity}. Allowed: {', '.join(QUANTITIES_OF_BEAM)}",
        remedy="Name one of these.",
        path="probes",
    )
