"""Hard contacts, springs with dashpots, and branches in the exact solver, and refusals of others."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np

from impactlab.errors import CaseError, PairingError
from impactlab.exact.setup.end_loads import check_loads
from impactlab.models.continuous.delay_line import dispersed
from impactlab.plugins import kind_of
from impactlab.scene.bodies import Rayleigh
from impactlab.scene.method import Method, sides
from impactlab.scene.problem import Point, Scene
from impactlab.scene.recent import KeepsResults
from impactlab.types import Branches

OVERLAP_TOL = 1.0e-9  # of the initial displacements: digits to which a preload and the gap that it closes are given
SAMPLES = 65  # of the displacement of a body at t = 0, for its size


class Bond(NamedTuple):
    """A contact in the exact solver: hard, bonded, spring with dashpot, or branches.

    The stiffness is -1 for a hard or bonded contact.
    """

    stiffness: float  # N/m
    damping: float  # N s/m
    face: int | None = None  # side whose balance gives the force of a hard contact: 0 left, 1 right
    turn: int = 0  # forces are found in this order: springs first, then each hard contact once its face has no other
    branches: Branches | None = None  # of which stiffness and damping are those of the first

    def rigid_scale(self, left: float, right: float) -> float:
        """Return force per velocity of a spring between rigid masses [N s/m].

        Masses are in kg, inf for fixed bodies.
        """
        stiffness = self.stiffness if self.branches is None else self.branches.elastic
        return max(self.damping, math.sqrt(stiffness / (1.0 / left + 1.0 / right)))


def bond(scene: Scene, method: Method, number: int) -> Bond:
    """Return a contact as hard, a spring, or branches.

    Raises `PairingError` if its law is none of them.
    """
    contact = scene.contacts[number]
    law = method.laws[contact.name]
    if law.hard:
        return Bond(-1.0, 0.0)
    branches = law.branches()
    if branches is not None:
        first = branches.branches[branches.first]
        return Bond(-1.0 if branches.rigid else first.stiffness, first.damping, branches=branches)
    constants = law.spring(*sides(scene, method, contact), math.nan)
    if constants is None or not all(math.isfinite(value) for value in constants):
        change = law.exact_remedy or "Use wave_identification, addition_deletion or penalty"
        raise PairingError(
            f"contact {contact.name}: the exact solver supports hard contacts, constant springs with dashpots, and "
            f"laws that are linear between changes of branch, but not '{kind_of(law)}' with these options",
            remedy=f"{change}, or a model that steps.",
            path=f"contacts.{number}.law",
        )
    return Bond(*constants)


def massless(scene: Scene, point: Point) -> bool:
    """Return whether a face, an inner point or a bare rod end, is without mass."""
    body = scene.bodies[point.body].waves
    if body is None or body.is_inner(point.x):
        return body is not None
    end = body.left if point.x <= 0.0 else body.right
    return end.kind != "clamped" and not (end.kind == "mass" and end.value > 0.0)


def check(scene: Scene, method: Method) -> list[Bond]:
    """Return the bonds of all contacts; raises `CaseError` or `PairingError`, with path and remedy."""
    if not scene.wave_bodies:
        raise CaseError("the scene has no rod; the exact solver needs one", path="bodies", remedy="Add a rod.")
    for any_body in scene.bodies.values():
        if any_body.rotation is not None:
            raise CaseError(
                f"'{any_body.name}' turns at {any_body.rotation.rate:.6g} rad/s, which disperses its waves; the "
                "exact solver needs waves that keep their shape",
                path=f"bodies.{any_body.name}.rotation",
                remedy="Use finite_element or modal.",
            )
    check_loads(scene)
    for body in scene.wave_bodies:
        if scene.gravity and not body.falls:
            raise CaseError(
                f"gravity does not act on the {body.kind} '{body.name}', but the exact solver applies it to all bodies",
                path="gravity",
                remedy="Use finite_element or modal, or leave gravity out.",
            )
        if body.is_damped:
            where = "damping" if body.damping != Rayleigh() else "material"
            raise CaseError(
                dispersed(body),
                path=f"bodies.{body.name}.{where}",
                remedy="Use finite_element or modal, or leave it undamped.",
            )
    bonds = []
    for number, contact in enumerate(scene.contacts):
        path = f"contacts.{number}"
        if any(scene.bodies[point.body].bends for point in contact.faces):
            raise CaseError(
                f"contact {contact.name} meets a beam; the exact solver supports only rods",
                path=path,
                remedy="Use a model that steps.",
            )
        kind = bond(scene, method, number)
        if not any(scene.bodies[point.body].moves for point in contact.faces):
            raise CaseError(f"contact {contact.name}: neither side can move", path=path, remedy="Leave it out.")
        if contact.left.body == contact.right.body:
            raise CaseError(f"contact {contact.name} connects a rod with itself", path=path, remedy="Name two bodies.")
        if kind.stiffness < 0.0:
            check_hard(scene, number, kind.branches is None)
        bonds.append(kind)
    return with_faces(scene, bonds)


bonds_of = KeepsResults(check, lambda _: True, limited=False)
"""`check`, whose last results are kept: a run asks for them before its network is built, and there."""


def check_hard(scene: Scene, number: int, opens: bool) -> None:
    """Raise `CaseError` where a hard contact has no face without mass.

    The force of such a contact, or of a bond, follows from the balance of this face.
    """
    contact, path = scene.contacts[number], f"contacts.{number}"
    bare = any(massless(scene, point) for point in contact.faces)
    if not bare and not opens:
        raise CaseError(
            f"contact {contact.name}: both faces have mass; the exact solver supports a bond only "
            "where one face has no mass",
            path=path,
            remedy="Give one body with the mass of both, or use a model that steps.",
        )
    if not bare:
        raise CaseError(
            f"contact {contact.name}: both faces have mass; the velocities after a hard impact of two masses "
            "depend on a coefficient of restitution, which a hard contact does not have",
            path=path,
            remedy="Use penalty, or let one face be the bare end of a rod.",
        )
    gap, slack = first_gap(scene, number)
    if opens and gap < -slack:
        raise CaseError(
            f"contact {contact.name}: gap {gap:g} "
            f"m{' with the initial displacement' if slack else ''}. Allowed in a hard contact: 0 or "
            "more",
            path=f"{path}.gap",
            remedy="Use penalty with overlap: allowed, or a gap of 0 or more.",
        )


def first_gap(scene: Scene, number: int) -> tuple[float, float]:
    """Return the gap at t = 0, with initial displacements, and its rounding [m]."""
    contact = scene.contacts[number]
    gap, size = contact.gap, 0.0
    for point, sign in ((contact.left, -1.0), (contact.right, 1.0)):
        body = scene.bodies[point.body].waves
        if body is not None and body.displacement is not None:
            moved = body.displacement(np.append(np.linspace(0.0, body.length, SAMPLES), point.x))
            gap, size = gap + sign * float(moved[-1]), max(size, float(np.abs(moved).max()))
    return gap, OVERLAP_TOL * size


def with_faces(scene: Scene, bonds: list[Bond]) -> list[Bond]:
    """Return the bonds with the bare faces of hard contacts, and order.

    The balance of its bare face gives the force of a hard contact.
    """
    bonds = list(bonds)
    found, waiting = balanced(scene, [number for number, kind in enumerate(bonds) if kind.stiffness < 0.0], massless)
    if waiting:
        names = " and ".join(scene.contacts[number].name for number in waiting)
        raise CaseError(
            f"contacts {names}: bodies with mass collide through faces without mass; their velocities "
            "after the impact depend on a coefficient of restitution, which a hard contact does not "
            "have",
            path=f"contacts.{waiting[-1]}",
            remedy="Use penalty for one of them, or give each face one contact.",
        )
    for turn, (number, faces) in enumerate(found.items(), start=1):
        _, side = min(faces)  # the most compliant face determines a force best
        bonds[number] = bonds[number]._replace(face=side, turn=turn)
    return bonds


def balanced(
    scene: Scene, hard: Iterable[int], bare: Callable[[Scene, Point], bool]
) -> tuple[dict[int, list[tuple[float, int]]], list[int]]:
    """Return the sides whose bare faces give forces, and the remaining contacts.

    Sides are by hard contact, in order; the remaining contacts have no such face. Several contacts may share a bare
    face (a striker on two rods side by side). Their forces follow one after the other, each from a face on which no
    other force is still unknown. Where none is left, two bodies with mass (or walls) meet through bare faces: they
    would strike each other as two masses do. ``bare`` is whether a face has no mass. Each side comes after its
    impedance [N s/m].
    """
    waiting, found = list(hard), dict[int, list[tuple[float, int]]]()
    sides = {number: scene.contacts[number].faces for number in waiting}
    while waiting:
        busy = [(point.body, point.x) for number in waiting for point in sides[number]]
        for number in waiting:
            free = [
                (scene.bodies[point.body].impedance_at(point.x), side)
                for side, point in enumerate(sides[number])
                if bare(scene, point) and busy.count((point.body, point.x)) == 1
            ]
            if free:
                found[number] = free
                waiting.remove(number)
                break
        else:
            break
    return found, waiting
