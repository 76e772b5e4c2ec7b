"""Static rest of a pile in its soil, the minimum of a convex energy, by Newton steps with line search."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from impactlab.errors import CaseError, ImpactlabError
from impactlab.piling.pile import Pile, soil_laws
from impactlab.scene.bodies.segmented import PLACE_ROUNDING
from impactlab.scene.method import Simulation
from impactlab.types import Array

MAX_TURNS = 200  # Newton steps; each changes which pieces yield, and a pile has as many as pieces
FORCE_TOL = 1e-12  # of the static capacity: forces on every piece that are left over at rest
MIN_SLOPE = 1e-9  # of the stiffest soil: keeps the matrix regular where all soil yields


class Rest(NamedTuple):
    """A pile at static rest, in values at its nodes.

    Nodes are the ends, the joints of its segments and the places of its soil links.
    """

    x: Array  # (n,) m from the left end
    displacement: Array  # (n,) m, positive along +x
    force: Array  # (n - 1,) N in the pile between the nodes, compression positive
    sets: dict[str, float]  # m, by name of the contact
    soil: dict[str, float]  # N, static resistances by name of the contact, against driving positive


def rest_of(run: Simulation, pile: Pile, sets: dict[str, float], start: float) -> Rest:
    """Return the static rest of a pile that nothing but its soil holds.

    Parameters
    ----------
    run, pile
        The scene and its pile; no weight acts.
    sets : dict
        Of the soil links after a blow [m].
    start : float
        A displacement of the pile [m] to begin with, positive along +x.

    Raises
    ------
    CaseError
        If something other than soil holds or loads the pile.
    """
    check_at_rest(run, pile)
    x = _nodes(pile)
    at = np.array([int(np.searchsorted(x, pile.place(contact))) for contact in pile.soil])
    laws = list(soil_laws(run, pile).values())
    stiffness = np.array([law.capacity / law.quake for law in laws])
    upper = np.array([law.capacity for law in laws])
    lower = np.array([-law.capacity if law.tension else 0.0 for law in laws])
    before = np.array([sets[contact.name] for contact in pile.soil])
    gap = np.array([contact.gap for contact in pile.soil])
    side = np.array([1.0 if contact.left.body == pile.body.name else -1.0 for contact in pile.soil])
    springs = _springs(pile, x)
    matrix = np.diag(np.r_[springs, 0.0] + np.r_[0.0, springs]) - np.diag(springs, 1) - np.diag(springs, -1)

    def soil(u: Array) -> tuple[Array, Array]:
        trial = stiffness * (side * u[at] - gap - before)
        held = np.clip(trial, lower, upper)
        return held, np.where(held == trial, stiffness, MIN_SLOPE * stiffness.max())

    def left_over(u: Array) -> Array:
        return matrix @ u + np.bincount(at, side * soil(u)[0], x.size)

    u = np.full(x.size, start)
    for _ in range(MAX_TURNS):
        rest = left_over(u)
        if np.abs(rest).max() <= FORCE_TOL * upper.sum():
            break
        tangent = matrix + np.diag(np.bincount(at, soil(u)[1], x.size))
        step = -np.linalg.solve(tangent, rest)
        u = u + _share(left_over, u, step) * step
    else:
        raise ImpactlabError(
            f"the static equilibrium of pile {pile.body.name!r} was not found: "
            f"{np.abs(rest).max():.3g} N remain unbalanced",
            remedy="Check the capacities and quakes of its soil.",
        )
    forces = soil(u)[0]
    against = pile.direction * side * forces  # a force of a contact presses the body on its left towards -x
    trial = stiffness * (side * u[at] - gap - before)
    moved = np.where(
        (lower < 0.0) | (trial > 0.0), (trial - forces) / stiffness, 0.0
    )  # a toe that lifts keeps its hole
    names = [contact.name for contact in pile.soil]
    return Rest(
        x=x,
        displacement=u,
        force=-springs * np.diff(u),
        sets=dict(zip(names, (before + moved).tolist(), strict=True)),
        soil=dict(zip(names, against.tolist(), strict=True)),
    )


def _nodes(pile: Pile) -> Array:
    """Return the nodes of the pile, where the strain jumps, (n,) [m].

    They are the places of soil links, the ends and the joints of segments.
    """
    places = np.unique([0.0, pile.body.length, *(pile.place(contact) for contact in pile.soil)])
    joints = np.cumsum([segment.length for segment in pile.body.segments[:-1]])
    apart = [np.abs(places - joint).min() > PLACE_ROUNDING * pile.body.length for joint in joints]
    return np.union1d(places, joints[apart]) if any(apart) else places


def check_at_rest(run: Simulation, pile: Pile) -> None:
    """Raise `CaseError` where something other than soil holds or loads the pile at rest."""
    others = [c for c in run.scene.contacts if run.method.laws[c.name].two_sided and c not in pile.soil]
    wrong = next((c.name for c in others if pile.body.name in (c.left.body, c.right.body)), "")
    text, remedy = "", "Let links with the law smith alone hold the pile, without gravity."
    if pile.below:
        remedy = (
            "Join sections without play as segments of one rod; splices and cracks are taken by `blow`, "
            "`bearing_graph` and `match`."
        )
        text, path = f"{pile.named} are several rods, and the static equilibrium is found for a pile of one", "bodies"
    elif not pile.soil:
        text, path = "no soil holds the pile, so that it has no static equilibrium", "contacts"
    elif wrong:
        text, path = f"the link {wrong!r} holds the pile in addition to its soil", "contacts"
    elif pile.body.is_held or any(end.is_loaded for _, end in pile.body.ends):
        text, path = "an end of the pile is held or loaded", f"bodies.{pile.body.name}.ends"
    elif run.scene.gravity != 0.0:
        text, path = "gravity is given, and the static equilibrium between blows is computed without weight", "gravity"
    if text:
        raise CaseError(text, remedy=remedy, path=path)


def _springs(pile: Pile, x: Array) -> Array:
    """Return the static stiffness [N/m] of the pile between places, shape (n - 1,)."""
    ends = np.cumsum([0.0, *(segment.length for segment in pile.body.segments)])
    compliance = np.array([0.0, *(s.length / (s.young * s.area) for s in pile.body.segments)]).cumsum()
    return np.asarray(1.0 / np.diff(np.interp(x, ends, compliance)))


def _share(left_over: Callable[[Array], Array], u: Array, step: Array) -> float:
    """Return the share of a Newton step of least energy, the zero of a rising function."""

    def slope(share: float) -> float:
        return float(step @ left_over(u + share * step))

    return 1.0 if slope(1.0) <= 0.0 or slope(0.0) >= 0.0 else float(brentq(slope, 0.0, 1.0))
