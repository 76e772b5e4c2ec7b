"""Random cases by seed, as a user would write them.

Their families are named after the contact and the bodies.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

Doc = dict[str, Any]
Random = np.random.Generator

TOLERANCES = (1e-2, 1e-3, 1e-4)
STUFFS = ((2.1e11, 7900.0), (7.0e10, 2700.0), (1.1e11, 8900.0), (3.0e9, 1200.0), (1.1e11, 4430.0))
HYSTERETIC = ("hunt_crossley", "lankarani_nikravesh", "flores")


class Drawn(NamedTuple):
    """One case of a family."""

    family: str
    number: int
    doc: Doc


def digits(value: float, count: int = 6) -> float:
    """Return a number with as many digits as a user writes."""
    return float(f"{value:.{count}g}")


def spread(rng: Random, low: float, high: float) -> float:
    """Return a number whose logarithm is uniform."""
    return digits(math.exp(rng.uniform(math.log(low), math.log(high))))


def stuff(rng: Random) -> Doc:
    """Return a material."""
    young, density = STUFFS[rng.integers(len(STUFFS))]
    return {"young": young, "density": density}


def segment(rng: Random) -> Doc:
    """Return a piece of a rod."""
    return {"length": spread(rng, 0.05, 0.4), "area": spread(rng, 1e-4, 1.2e-3), "material": stuff(rng)}


def rod(rng: Random, pieces: int | None = None, near: float | None = None) -> Doc:
    """Return a rod; `near` is the largest ratio of the impedances of its pieces."""
    count = pieces or int(rng.choice([1, 1, 1, 2, 2, 3]))
    parts = [segment(rng) for _ in range(count)]
    if near is not None:
        for part in parts[1:]:
            part["material"] = parts[0]["material"]
            part["area"] = digits(parts[0]["area"] * spread(rng, 1.0 / near, near))
    return {"kind": "rod", **parts[0]} if count == 1 else {"kind": "rod", "segments": parts}


def pieces_of(body: Doc) -> list[Doc]:
    """Return the pieces of a rod."""
    return list(body.get("segments", [body]))


def transit(body: Doc) -> float:
    """Return the time of a wave from end to end [s]."""
    return sum(p["length"] * math.sqrt(p["material"]["density"] / p["material"]["young"]) for p in pieces_of(body))


def impedance(body: Doc) -> float:
    """Return the impedance of the first piece [N s/m]."""
    first = pieces_of(body)[0]
    return float(first["area"] * math.sqrt(first["material"]["density"] * first["material"]["young"]))


def mass(body: Doc) -> float:
    """Return the mass of a body [kg]."""
    if body["kind"] == "mass":
        return float(body["mass"])
    return float(sum(p["length"] * p["area"] * p["material"]["density"] for p in pieces_of(body)))


def stiffness(body: Doc) -> float:
    """Return EA/L of a rod [N/m]."""
    return 1.0 / sum(p["length"] / (p["area"] * p["material"]["young"]) for p in pieces_of(body))


def length(body: Doc) -> float:
    """Return the length of a rod [m]."""
    return float(sum(p["length"] for p in pieces_of(body)))


def end(rng: Random, body: Doc) -> Any:
    """Return the support of the far end of a rod."""
    kind = rng.choice(["free", "free", "clamped", "spring", "dashpot", "mass"])
    if kind == "spring":
        return {"spring": digits(stiffness(body) * spread(rng, 0.1, 10.0))}
    if kind == "dashpot":
        return {"dashpot": digits(impedance(body) * spread(rng, 0.2, 4.0))}
    if kind == "mass":
        return {"mass": digits(mass(body) * spread(rng, 0.05, 2.0))}
    return str(kind)


class Layout(NamedTuple):
    """Bodies in a row and the faces that may meet, in order of their meeting."""

    bodies: Doc
    faces: list[tuple[str, str]]
    speed: float
    trip: float  # s, the longest round trip


def hammer_on_rod(rng: Random) -> Layout:
    """Return a mass that strikes the end of a rod."""
    bar = rod(rng)
    bar["ends"] = {"right": end(rng, bar)}
    speed = spread(rng, 0.2, 10.0)
    hammer = {"kind": "mass", "mass": digits(mass(bar) * spread(rng, 0.05, 8.0)), "velocity": speed}
    return Layout({"hammer": hammer, "bar": bar}, [("hammer", "bar.left")], speed, 2.0 * transit(bar))


def hammer_on_place(rng: Random) -> Layout:
    """Return a mass that strikes a rod on the way."""
    bar = rod(rng)
    bar["ends"] = {"left": end(rng, bar), "right": end(rng, bar)}
    speed, x = spread(rng, 0.2, 10.0), digits(length(bar) * rng.uniform(0.15, 0.85))
    hammer = {"kind": "mass", "mass": digits(mass(bar) * spread(rng, 0.05, 4.0)), "velocity": speed}
    return Layout({"hammer": hammer, "bar": bar}, [("hammer", f"bar.at({x:g})")], speed, 2.0 * transit(bar))


def rod_on_rod(rng: Random) -> Layout:
    """Return two rods, or three, in a row."""
    speed, count = spread(rng, 0.2, 10.0), int(rng.choice([2, 2, 3]))
    bodies = {name: rod(rng) for name in ("one", "two", "three")[:count]}
    bodies["one"]["velocity"] = speed
    last = list(bodies)[-1]
    bodies[last]["ends"] = {"right": end(rng, bodies[last])}
    faces = [(f"{a}.right", f"{b}.left") for a, b in itertools.pairwise(bodies)]
    return Layout(bodies, faces, speed, 2.0 * max(transit(b) for b in bodies.values()))


def rod_on_wall(rng: Random) -> Layout:
    """Return a rod that flies against a wall; sometimes there is a wall behind it."""
    speed, bar = spread(rng, 0.2, 10.0), rod(rng)
    bar["velocity"] = speed
    bodies, faces = {"bar": bar, "wall": {"kind": "wall"}}, [("bar.right", "wall")]
    if rng.random() < 0.3:
        bodies["back"] = {"kind": "wall"}
        faces.append(("back", "bar.left"))
    return Layout(bodies, faces, speed, 2.0 * transit(bar))


def mass_between(rng: Random) -> Layout:
    """Return a rod that drives a mass into another rod or a wall."""
    speed, bar = spread(rng, 0.2, 10.0), rod(rng)
    bar["velocity"] = speed
    block = {"kind": "mass", "mass": digits(mass(bar) * spread(rng, 0.05, 4.0))}
    bodies, faces = {"bar": bar, "block": block}, [("bar.right", "block")]
    other = rod(rng)
    bodies["anvil"] = other
    faces.append(("block", "anvil.left"))
    return Layout(bodies, faces, speed, 2.0 * max(transit(bar), transit(other)))


LAYOUTS: tuple[Callable[[Random], Layout], ...] = (
    hammer_on_rod,
    hammer_on_rod,
    hammer_on_place,
    rod_on_rod,
    rod_on_rod,
    rod_on_wall,
    mass_between,
)


def contact_of(rng: Random, layout: Layout, faces: tuple[str, str], law: Doc | None, number: int) -> Doc:
    """Return a contact, half of the first ones closed at start.

    Others have a gap.
    """
    contact: Doc = {"between": list(faces)}
    reach = layout.speed * layout.trip
    if rng.random() < 0.5:
        contact["gap"] = digits(reach * spread(rng, 1e-3, 0.3 if number == 0 else 0.1))
    if faces[0] == "back":
        contact["gap"] = digits(reach * spread(rng, 0.05, 0.5))
    if law is not None:
        contact["law"] = law
    return contact


def sides(layout: Layout, faces: tuple[str, str]) -> list[Doc]:
    """Return the bodies of a contact."""
    return [layout.bodies[label.partition(".")[0]] for label in faces]


def on_rods(rng: Random, law: Callable[[Random, Layout, tuple[str, str]], Doc | None], tolerance: float) -> Doc:
    """Return a case with a rod and contacts of a law."""
    layout = LAYOUTS[rng.integers(len(LAYOUTS))](rng)
    contacts = [
        contact_of(rng, layout, faces, law(rng, layout, faces), number) for number, faces in enumerate(layout.faces)
    ]
    wait = sum(c.get("gap", 0.0) for c in contacts) / layout.speed
    duration = digits(layout.trip * spread(rng, 1.2, 6.0) + wait)
    return finished(layout.bodies, contacts, duration, tolerance)


def finished(bodies: Doc, contacts: list[Doc], duration: float, tolerance: float) -> Doc:
    """Return a case of its blocks."""
    solve = {"duration": duration, "tolerance": tolerance}
    return {"schema_version": 1, "bodies": bodies, "contacts": contacts, "solve": solve}


def hard_or_spring(rng: Random, layout: Layout, faces: tuple[str, str]) -> Doc | None:
    """Return hard contact, or a spring."""
    if rng.random() < 0.6:
        return None
    least = min(stiffness(body) for body in sides(layout, faces) if body["kind"] == "rod")
    return {"kind": "penalty", "stiffness": digits(least * spread(rng, 0.1, 30.0))}


def power_on_rods(rng: Random, layout: Layout, faces: tuple[str, str]) -> Doc:
    """Return a power law about as soft as the rods.

    It is so within a factor of ten.
    """
    bars = [body for body in sides(layout, faces) if body["kind"] == "rod"]
    exponent = 1.5 if rng.random() < 0.6 else digits(rng.uniform(1.0, 2.5), 3)
    force = min(impedance(bar) for bar in bars) * layout.speed * rng.uniform(0.2, 1.5)
    depth = layout.speed * layout.trip * spread(rng, 0.02, 0.5)
    return power(rng, force / depth**exponent, exponent)


def power(rng: Random, factor: float, exponent: float) -> Doc:
    """Return Hertz's law or one of those with hysteresis."""
    kind = str(rng.choice(["hertz", "hertz", *HYSTERETIC]))
    law = {"kind": kind, "stiffness": digits(factor), "exponent": exponent}
    if kind != "hertz":
        law["restitution"] = digits(rng.uniform(0.3, 1.0), 3)
    return law


def dashpot_on_rods(rng: Random, layout: Layout, faces: tuple[str, str]) -> Doc:
    """Return a spring and dashpot."""
    bars = [body for body in sides(layout, faces) if body["kind"] == "rod"]
    k = digits(min(stiffness(bar) for bar in bars) * spread(rng, 0.3, 20.0))
    if rng.random() < 0.25:
        return {"kind": "khulief_shabana", "stiffness": k, "restitution": digits(rng.uniform(0.3, 0.95), 3)}
    damping = digits(min(impedance(bar) for bar in bars) * spread(rng, 0.02, 1.5))
    return {"kind": "penalty", "stiffness": k, "damping": damping}


def rigid(rng: Random, law: Callable[[Random, float, float, float], Doc], tolerance: float) -> Doc:
    """Return two to five bodies in a row.

    The first one moves, the last one is sometimes a wall.
    """
    speed, count = spread(rng, 0.1, 10.0), int(rng.choice([1, 1, 2, 2, 3, 4]))
    names = [f"m{i}" for i in range(count)]
    size = spread(rng, 0.01, 10.0)
    bodies: Doc = {name: {"kind": "mass", "mass": digits(size * spread(rng, 0.2, 5.0))} for name in names}
    bodies["m0"]["velocity"] = speed
    if count == 1 or rng.random() < 0.3:
        bodies["wall"] = {"kind": "wall"}
    rate = spread(rng, 1e2, 1e5)
    contacts = []
    for a, b in itertools.pairwise(bodies):
        weights = [mass(bodies[n]) for n in (a, b) if bodies[n]["kind"] == "mass"]
        reduced = 1.0 / sum(1.0 / w for w in weights)
        contact: Doc = {"between": [a, b], "law": law(rng, reduced, speed, rate * spread(rng, 0.5, 2.0))}
        if rng.random() < 0.6:
            contact["gap"] = digits(speed / rate * spread(rng, 0.01, 3.0))
        contacts.append(contact)
    wait = sum(c.get("gap", 0.0) for c in contacts) / speed
    case = finished(bodies, contacts, digits(wait + (3.0 + count) / rate * spread(rng, 0.6, 2.0)), tolerance)
    if "wall" in bodies and rng.random() < 0.3:
        case["gravity"] = 9.81
    return case


def compliant(rng: Random, reduced: float, speed: float, rate: float) -> Doc:
    """Return any compliant law between rigid bodies whose contact lasts some 1/rate."""
    if rng.random() < 0.15:
        return {"kind": "penalty", "stiffness": digits(reduced * rate**2)}
    exponent = 1.5 if rng.random() < 0.6 else digits(rng.uniform(1.0, 2.5), 3)
    depth = speed / rate
    return power(rng, 0.5 * (exponent + 1.0) * reduced * speed**2 / depth ** (exponent + 1.0), exponent)


def dashpot_between(rng: Random, reduced: float, speed: float, rate: float) -> Doc:
    """Return a spring and dashpot between rigid bodies."""
    del speed
    k = digits(reduced * rate**2)
    if rng.random() < 0.3:
        return {"kind": "khulief_shabana", "stiffness": k, "restitution": digits(rng.uniform(0.2, 0.98), 3)}
    return {"kind": "penalty", "stiffness": k, "damping": digits(2.0 * spread(rng, 0.02, 1.2) * math.sqrt(k * reduced))}


def dashpot(rng: Random, tolerance: float) -> Doc:
    """Return spring and dashpot, between rigid bodies or on rods."""
    if rng.random() < 0.5:
        return rigid(rng, dashpot_between, tolerance)
    return on_rods(rng, dashpot_on_rods, tolerance)


def scan() -> Iterator[Drawn]:
    """Yield a ball that meets a wall with spring and dashpot.

    There are 41 gaps, three damping ratios, and three tolerances.
    """
    gaps = [0.0, *(digits(3e-6 * 1.13**i * (1.0 + 0.37 * math.sin(12.9 * i)), 4) for i in range(40))]
    grid = itertools.product(gaps, (0.1, 0.3, 0.6), TOLERANCES)
    for number, (gap, zeta, tolerance) in enumerate(grid):
        law = {"kind": "penalty", "stiffness": 1.0e6, "damping": digits(2000.0 * zeta)}
        bodies = {"ball": {"kind": "mass", "mass": 1.0, "velocity": 1.0}, "wall": {"kind": "wall"}}
        contacts = [{"between": ["ball", "wall"], "gap": gap, "law": law}]
        yield Drawn("scan", number, finished(bodies, contacts, 5.0e-3, tolerance))


def scan_rods() -> Iterator[Drawn]:
    """Yield a hammer that meets a rod of two pieces.

    There are 15 gaps, three dashpots, and three tolerances.
    """
    gaps = [0.0, *(digits(3e-6 * 1.4**i * (1.0 + 0.37 * math.sin(12.9 * i)), 4) for i in range(14))]
    steel, brass = {"young": 2.1e11, "density": 7900.0}, {"young": 1.1e11, "density": 8900.0}
    for number, (gap, share, tolerance) in enumerate(itertools.product(gaps, (0.1, 0.5, 1.0), TOLERANCES)):
        pieces = [
            {"length": 0.21, "area": 4.0e-4, "material": steel},
            {"length": 0.13, "area": 5.0e-4, "material": brass},
        ]
        law = {"kind": "penalty", "stiffness": 2.0e8, "damping": digits(16000.0 * share)}
        bodies = {
            "hammer": {"kind": "mass", "mass": 0.3, "velocity": 2.0},
            "bar": {"kind": "rod", "segments": pieces, "ends": {"right": {"dashpot": 9000.0}}},
        }
        contacts = [{"between": ["hammer", "bar.left"], "gap": gap, "law": law}]
        yield Drawn("scan_rods", number, finished(bodies, contacts, 5.0e-4, tolerance))
