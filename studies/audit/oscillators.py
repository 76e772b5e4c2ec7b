"""Bodies as oscillators under piecewise polynomial contact forces.

They are propagated without an error of the step.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from studies.audit.mesh import modes_of
from studies.audit.network import Doc, channel_of, law_of, place_of, whole_mass
from studies.audit.tables import STAGES, Array, gauss

POINTS, WEIGHTS, LAGRANGE, COLLOCATION, TOP = gauss()
AT = np.array([*POINTS, 1.0])


@dataclass
class System:
    """All oscillators of a scene, and the rows by which contacts and channels see them."""

    square: Array  # (modes,)
    damping: Array
    steady: Array  # (modes,) generalised force of gravity
    start: Array  # (modes,) rates at the start
    rows: Array  # (contacts + channels, modes): gaps less their values at rest, then displacements
    rest: Array  # (contacts,)
    channels: list[str]
    laws: list[tuple[int, tuple[float, ...]]]
    names: list[str]
    bodies: dict[str, str]  # channel -> body
    operators: dict[float, Operators] = field(default_factory=dict)


@dataclass
class Operators:
    """Operators of a step of one length.

    They are free motion, and the effect of force values at the stages.
    """

    free: Array  # (stages + 1, 2, 2, modes): displacement and rate from those at the start
    forced: Array  # (stages + 1, 2, stages, modes): from unit generalised forces at the stages
    constant: Array  # (stages + 1, 2, modes): from the steady force
    row_free: Array  # (2, stages + 1, rows, 2 * modes)
    row_forced: Array  # (2, stages + 1, rows, contacts, stages)
    row_constant: Array  # (2, stages + 1, rows)


def system_of(doc: Doc, count: int) -> System:
    """Return the oscillators of a scene with meshes of about so many elements a body."""
    faces = [[place_of(label, doc) for label in contact["between"]] for contact in doc["contacts"]]
    square, damping, steady, start = [], [], [], []
    rows: dict[tuple[str, float], tuple[int, Array]] = {}
    total, gravity = 0, float(doc.get("gravity", 0.0))
    for name, body in doc["bodies"].items():
        places = sorted({x for pair in faces for n, x in pair if n == name})
        if body["kind"] == "wall":
            continue
        if body["kind"] == "mass":
            root = float(body["mass"]) ** 0.5
            square.append(np.zeros(1))
            damping.append(np.zeros(1))
            steady.append(np.array([root * gravity]))
            start.append(np.array([root * float(body.get("velocity", 0.0))]))
            rows[(name, 0.0)] = (total, np.array([1.0 / root]))
        else:
            modes = modes_of(body, places, count)
            square.append(modes.square)
            damping.append(modes.damping)
            steady.append(modes.load * gravity)
            start.append(modes.rates)
            rows.update({(name, x): (total, shape) for x, shape in modes.shapes.items()})
        total += len(square[-1])

    def row(place: tuple[str, float]) -> Array:
        full = np.zeros(total)
        if place in rows:
            first, shape = rows[place]
            full[first : first + len(shape)] = shape
        return full

    gaps = [row(pair[1]) - row(pair[0]) for pair in faces]
    laws = [
        law_of(contact, (whole_mass(doc["bodies"][a[0]]), whole_mass(doc["bodies"][b[0]])))
        for contact, (a, b) in zip(doc["contacts"], faces, strict=True)
    ]
    moving = [place for pair in faces for place in pair if doc["bodies"][place[0]]["kind"] != "wall"]
    seen = {channel_of(*place, doc): place for place in moving}
    return System(
        *(np.concatenate(part) for part in (square, damping, steady, start)),
        np.array([*gaps, *(row(place) for place in seen.values())]),
        np.array([float(contact.get("gap", 0.0)) for contact in doc["contacts"]]),
        list(seen),
        laws,
        ["|".join(contact["between"]) for contact in doc["contacts"]],
        {name: place[0] for name, place in seen.items()},
    )


def exponentials(matrices: Array) -> Array:
    """Return the exponentials of small matrices, shape (n, m, m).

    They are computed by scaling and squaring of the Taylor series.
    """
    size = np.abs(matrices).sum(axis=2).max(axis=1)
    turns = np.maximum(0, np.ceil(np.log2(np.maximum(size, 1e-300) / 0.25))).astype(int)
    scaled = matrices / (2.0**turns)[:, None, None]
    result = np.eye(matrices.shape[1]) + np.zeros_like(scaled)
    for k in range(12, 0, -1):
        result = np.eye(matrices.shape[1]) + scaled @ result / k
    for turn in range(turns.max(initial=0)):
        more = turns > turn
        result[more] = result[more] @ result[more]
    return result


def operators(system: System, step: float) -> Operators:
    """Return the operators of a step by matrix exponentials.

    There is one for each oscillator with the polynomial that drives it.
    """
    if step in system.operators:
        return system.operators[step]
    n, order = len(system.square), 2 + STAGES
    # Displacements in units of the step times the rate: both rows then have the size of the phase of a step.
    generator = np.zeros((n, order, order))
    generator[:, 0, 1] = step
    generator[:, 1, 0] = -system.square * step
    generator[:, 1, 1] = -system.damping * step
    generator[:, 1, 2] = step
    for k in range(STAGES - 1):
        generator[:, 2 + k, 3 + k] = 1.0
    scale = np.maximum(np.sqrt(system.square), 1.0 / step)
    generator[:, 0, 1] *= scale  # state: scale * q, q'
    generator[:, 1, 0] /= scale
    taylor = (LAGRANGE * np.array([float(np.prod(range(1, k + 1))) for k in range(STAGES)])).T  # values -> derivatives
    free, forced, constant = (
        np.zeros((STAGES + 1, 2, 2, n)),
        np.zeros((STAGES + 1, 2, STAGES, n)),
        np.zeros((STAGES + 1, 2, n)),
    )
    for s, theta in enumerate(AT):
        whole = exponentials(generator * theta)
        whole[:, 0, :] /= scale[:, None]
        whole[:, :, 0] *= scale[:, None]
        free[s] = np.moveaxis(whole[:, :2, :2], 0, 2)
        push = whole[:, :2, 2:]
        forced[s] = np.moveaxis(push @ taylor, 0, 2)
        constant[s] = (push[:, :, 0] * system.steady[:, None]).T
    rows, gaps = system.rows, system.rows[: len(system.rest)]
    row_free = np.einsum("cm,sijm->iscjm", rows, free).reshape(2, STAGES + 1, len(rows), 2 * n)
    # A force pushes the left side down and the right side up, so it opens its gap: the same row twice.
    row_forced = np.einsum("cm,sikm,dm->iscdk", rows, forced, gaps, optimize=True)
    row_constant = np.einsum("cm,sim->isc", rows, constant)
    found = Operators(free, forced, constant, row_free, row_forced, row_constant)
    system.operators[step] = found
    return found
