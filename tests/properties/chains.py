"""Random chains of links that strike a wall, as documents: mirrored, turned, and in other units."""

from __future__ import annotations

import math
from copy import deepcopy
from typing import Any

from hypothesis import assume
from hypothesis import strategies as st

import impactlab as il
from impactlab.testing.strategies import log_uniform
from tests.solving import in_steps

DURATION, STEPS = 0.1, 1000  # s
RATES = st.one_of(st.floats(-4.0, -0.2), st.floats(0.2, 4.0))  # rad/s
Document = dict[str, Any]


@st.composite
def bodies(draw: st.DrawFn, flexible: bool) -> Document:
    """Return a rigid bar or a beam that bends by a few percent of its length at most."""
    length = draw(st.floats(0.3, 1.0))
    if not flexible:
        return {"kind": "link", "length": length, "mass": draw(st.floats(0.1, 1.0))}
    height = length * draw(log_uniform(0.03, 0.08))
    material = {"young": draw(log_uniform(2e10, 2e11)), "density": draw(st.floats(1e3, 8e3))}
    return {
        "kind": "beam",
        "length": length,
        "section": {"width": 2.0 * height, "height": height},
        "material": material,
    }


def tip_velocity(parts: Document, links: list[Document], slides: bool) -> tuple[float, float]:
    """Return the velocity of the end [m/s] of the chain at t = 0, rigid."""
    x = y = rate = 0.0
    for number, link in enumerate(links):
        length, angle = parts[link["body"]]["length"], link["angle"]
        rate = link["drive"]["rate"] if "drive" in link else link.get("rate", rate)
        if slides and number == len(links) - 1:
            rate = -y / (length * math.cos(angle))
        x, y = x - length * rate * math.sin(angle), y + length * rate * math.cos(angle)
    return x, y


@st.composite
def chains(draw: st.DrawFn, contact: bool = True, slides: bool | None = None) -> Document:
    """Return one to three links, hinged, driven, clamped or on a slide; the end strikes a wall unless told not to."""
    count = draw(st.integers(1, 3))
    sliding = count > 1 and (draw(st.booleans()) if slides is None else slides)
    parts, links = {}, []
    for number in range(count):
        name, last = f"link{number}", sliding and number == count - 1
        bends = (
            number > 0 and parts[f"link{number - 1}"]["kind"] == "beam"
        )  # a link clamped to its end would bend it far
        kind = "hinge" if last or bends else draw(st.sampled_from(["hinge", "clamped"]))
        driven = number == 0 and draw(st.booleans())
        flexible = (kind == "clamped" and number == 0) or (draw(st.booleans()) and not (driven and kind == "hinge"))
        parts[name] = draw(bodies(flexible))
        link: Document = {"body": name, "angle": draw(st.floats(-3.0, 3.0))}
        if driven or (number == 0 and kind == "clamped"):
            link["drive"] = {"rate": draw(RATES)}
        elif kind == "hinge" and not last:
            link |= {"rate": draw(RATES), "torque": draw(st.floats(-0.5, 0.5))}
        if kind == "clamped":
            link["joint"] = "clamped"
        if flexible:
            link["axial_modes"] = draw(st.integers(0, 2))
        if draw(st.booleans()):
            link["end_mass"] = draw(st.floats(0.05, 0.5))
        links.append(link)
    if "drive" in links[0] and all(part["kind"] == "link" for part in parts.values()):
        assume(sliding is False and any("rate" in link for link in links[1:]))  # something is left free
    end: Any = "free"
    if sliding:
        links[-1]["angle"] = draw(st.floats(-0.6, 0.6)) + draw(st.sampled_from([0.0, math.pi]))
        end = {"slide": sum(parts[each["body"]]["length"] * math.sin(each["angle"]) for each in links)}
    document: Document = {
        "schema_version": 1,
        "bodies": parts,
        "mechanisms": {"chain": {"links": links, "end": end}},
        "gravity": [draw(st.floats(-5.0, 5.0)), draw(st.floats(-10.0, 10.0))],
        "solve": in_steps(DURATION, "midpoint", {"kind": "modal", "elements": 16, "modes": 4}, dt=DURATION / STEPS),
    }
    if contact:
        x, y = tip_velocity(parts, links, sliding)
        if sliding:
            y = 0.0
        speed = math.hypot(x, y)
        parts["wall"] = {"kind": "wall"}
        law = draw(st.sampled_from([{"kind": "penalty", "stiffness": 1e4}, {"kind": "hertz", "stiffness": 1e5}]))
        along = [x / speed, y / speed] if speed > 1e-3 else [1.0, 0.0]
        between = [f"{links[-1]['body']}.right", "wall"]
        gap = draw(st.floats(0.01, 0.3)) * speed * DURATION
        document["contacts"] = [{"between": between, "along": along, "gap": gap, "law": law}]
    return document


def mirrored(document: Document) -> Document:
    """Return the image of a chain across the x axis."""
    image = deepcopy(document)
    for link in image["mechanisms"]["chain"]["links"]:
        for key in ("angle", "rate", "torque"):
            if key in link:
                link[key] = -link[key]
        if "drive" in link:
            link["drive"]["rate"] *= -1.0
    if isinstance(end := image["mechanisms"]["chain"]["end"], dict):
        end["slide"] *= -1.0
    for vector in (image["gravity"], *(each["along"] for each in image["contacts"])):
        vector[1] = -vector[1]
    return image


def turned(document: Document, angle: float) -> Document:
    """Return a chain seen from axes that are turned back by an angle [rad]."""
    image, c, s = deepcopy(document), math.cos(angle), math.sin(angle)
    for link in image["mechanisms"]["chain"]["links"]:
        link["angle"] += angle
    for vector in (image["gravity"], *(each["along"] for each in image["contacts"])):
        vector[:] = [c * vector[0] - s * vector[1], s * vector[0] + c * vector[1]]
    return image


def in_other_units(document: Document, mass: float, length: float, time: float) -> Document:
    """Return the same chain with every kilogram, metre and second counted as so many."""
    image, acceleration = deepcopy(document), length / time**2
    for part in image["bodies"].values():
        if "length" in part:
            part["length"] *= length
        if part["kind"] == "link":
            part["mass"] *= mass
        if part["kind"] == "beam":
            part["section"] = {key: value * length for key, value in part["section"].items()}
            young, density = part["material"]["young"], part["material"]["density"]
            part["material"] = {"young": young * mass * acceleration / length**2, "density": density * mass / length**3}
    for link in image["mechanisms"]["chain"]["links"]:
        for key, factor in (("rate", 1.0 / time), ("torque", mass * acceleration * length), ("end_mass", mass)):
            if key in link:
                link[key] *= factor
        if "drive" in link:
            link["drive"]["rate"] /= time
    if isinstance(end := image["mechanisms"]["chain"]["end"], dict):
        end["slide"] *= length
    image["gravity"] = [acceleration * each for each in image["gravity"]]
    for each in image["contacts"]:
        each["gap"] *= length
        power = {"penalty": 1.0, "hertz": 1.5}[each["law"]["kind"]]
        each["law"]["stiffness"] *= mass * acceleration / length**power
    image["solve"]["duration"] *= time
    image["solve"]["step"]["dt"] *= time
    return image


def run(document: Document) -> Any:
    """Return the history of a chain."""
    return il.run(il.Case.from_dict(document))
