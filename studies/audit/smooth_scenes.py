"""Random cases with damped rods and with beams."""

from __future__ import annotations

import math

from studies.audit import scenes
from studies.audit.scenes import Doc, Random, digits, spread


def damped(rng: Random, tolerance: float) -> Doc:
    """Return a case whose rods have Rayleigh damping or viscosity, under compliant contacts."""
    makers = (scenes.hammer_on_rod, scenes.hammer_on_rod, scenes.hammer_on_place, scenes.rod_on_rod, scenes.rod_on_wall)
    layout = makers[rng.integers(len(makers))](rng)
    share = layout.trip * spread(rng, 1e-3, 0.1)
    viscous = rng.random() < 0.5
    for body in layout.bodies.values():
        if body["kind"] == "rod":
            soften(rng, body, share, viscous, layout.trip)
    choose = scenes.power_on_rods if rng.random() < 0.6 else spring_on_rods
    contacts = [
        scenes.contact_of(rng, layout, faces, choose(rng, layout, faces), number)
        for number, faces in enumerate(layout.faces)
    ]
    wait = sum(contact.get("gap", 0.0) for contact in contacts) / layout.speed
    duration = digits(layout.trip * spread(rng, 1.0, 4.0) + wait)
    return scenes.finished(layout.bodies, contacts, duration, tolerance)


def soften(rng: Random, body: Doc, share: float, viscous: bool, trip: float) -> None:
    """Give a rod damping in proportion to its stiffness.

    It has it by its material or as a whole, and ends that are free or clamped.
    """
    for side, end in list(body.get("ends", {}).items()):
        if isinstance(end, dict):
            body["ends"][side] = "clamped"
    if viscous:
        ratio = digits(share, 3)
        for piece in scenes.pieces_of(body):
            piece["material"] = {**piece["material"], "viscosity": ratio * piece["material"]["young"]}
    else:
        body["damping"] = {"stiffness": digits(share)}
        if rng.random() < 0.3:
            body["damping"]["mass"] = digits(spread(rng, 0.01, 0.5) / trip)


def spring_on_rods(rng: Random, layout: scenes.Layout, faces: tuple[str, str]) -> Doc:
    """Return a spring, with a dashpot in some cases."""
    law = scenes.dashpot_on_rods(rng, layout, faces)
    if rng.random() < 0.6:
        return {"kind": "penalty", "stiffness": law["stiffness"]}
    return law


ENDS = (
    ("free", "free"),
    ("pinned", "pinned"),
    ("clamped", "free"),
    ("clamped", "clamped"),
    ("clamped", "pinned"),
    ("pinned", "free"),
)


def beam(rng: Random, tolerance: float) -> Doc:
    """Return a scene of a beam with compliant contacts.

    A mass strikes the beam, or the beam falls on a stop.
    """
    whole = spread(rng, 0.1, 0.6)
    height = digits(whole * spread(rng, 1 / 80, 1 / 15))
    young, density = scenes.STUFFS[rng.integers(len(scenes.STUFFS))]
    theory = "timoshenko" if rng.random() < 0.5 else "euler_bernoulli"
    left, right = ENDS[rng.integers(len(ENDS))]
    section = (
        {"diameter": height}
        if rng.random() < 0.3
        else {"width": digits(height * spread(rng, 0.7, 2.0)), "height": height}
    )
    body: Doc = {
        "kind": "beam",
        "theory": theory,
        "length": whole,
        "section": section,
        "material": {"young": young, "density": density, "poisson": 0.3},
        "ends": {"left": left, "right": right},
    }
    area = math.pi * height**2 / 4.0 if "diameter" in section else section["width"] * height
    own, speed = density * area * whole, spread(rng, 0.05, 3.0)
    period = 2.0 * whole**2 / math.pi / math.sqrt(young / density) * math.sqrt(12.0) / height
    lasts = period * spread(rng, 0.02, 0.4)
    if rng.random() < 0.25:
        body["damping"] = {"stiffness": digits(lasts * spread(rng, 1e-3, 0.1))}
    x = digits(whole * rng.uniform(0.1, 0.9))
    face = f"beam.at({x:g})"
    if right == "free" and rng.random() < 0.3:
        face = "beam.right"
    mass = digits(own * spread(rng, 0.05, 2.0))
    if left == right == "free" and rng.random() < 0.4:
        body["velocity"] = -speed
        bodies: Doc = {"stop": {"kind": "wall"}, "beam": body}
        between, mass = ["stop", face], 0.3 * own
    else:
        bodies = {"ball": {"kind": "mass", "mass": mass, "velocity": speed}, "beam": body}
        between = ["ball", face]
    depth = speed * lasts / 3.0
    if rng.random() < 0.6:
        law = scenes.power(rng, 1.25 * mass * speed**2 / depth**2.5, 1.5)
    else:
        k = mass * speed**2 / depth**2
        law = {"kind": "penalty", "stiffness": digits(k)}
        if rng.random() < 0.4:
            law["damping"] = digits(2.0 * spread(rng, 0.02, 0.8) * math.sqrt(k * mass))
    contact: Doc = {"between": between, "law": law}
    if rng.random() < 0.4:
        contact["gap"] = digits(depth * spread(rng, 0.05, 3.0))
    duration = digits(lasts * spread(rng, 1.2, 8.0) + contact.get("gap", 0.0) / speed)
    return scenes.finished(bodies, [contact], duration, tolerance)
