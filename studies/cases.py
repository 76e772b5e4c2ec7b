"""The cases with exact or converged solutions: cases.md.

It has one line per case and variant, and a sheet of forces.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

import impactlab as il
from impactlab.api import reference_of
from impactlab.casefile import Case
from impactlab.history import ContactSpan
from impactlab.refine.references.reference_record import Reference
from impactlab.report.figures import style
from impactlab.scene import ElasticBody, Rod, Scene, Wall
from impactlab.scene.method import Method
from studies.pages import CASES, Study, filled, table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLUMNS = 5
NOTHING = 1e-9  # of the largest speed or force: rounding


class Line(NamedTuple):
    """A case or variant with its solution."""

    case: Case
    scene: Scene
    method: Method
    reference: Reference


def answered(name: str) -> Iterator[Line]:
    """Return a case as written and each of its variants, with their solutions."""
    case = il.load_case(CASES / f"{name}.yaml")
    for each in (case, *(case.variant(variant) for variant in case.variant_names if variant != "base")):
        scene, method = each.simulation()
        moving = any(body.changes for body in scene.bodies.values())  # a mechanism: `fine` has more shapes, too
        reference = Reference("`fine`", il.run(each.method("fine"))) if moving else reference_of(scene, method)
        assert reference is not None, each.label
        yield Line(each, scene, method, reference)


@cache
def all_answered() -> dict[str, list[Line]]:
    """Return all cases with their variants, by name of the file."""
    return {file.stem: list(answered(file.stem)) for file in sorted(CASES.glob("*.yaml"))}


def number(value: float) -> str:
    """Return a number with six digits, powers of ten written out."""
    text = f"{value:.6g}"
    return text if "e" not in text else f"{value:.5e}".replace("e-0", "e-").replace("e+0", "e")


def opening(line: Line) -> str:
    """Return when the first contact opened [T, us]."""
    ends = [span.end for span in line.reference.history.contacts if span.end is not None]
    if not ends:
        return "never" if line.scene.contacts else "-"
    first = min(ends)
    trips = first / line.scene.round_trip
    return f"{number(trips)} T ({time(first)})" if math.isfinite(trips) else time(first)


def time(value: float) -> str:
    """Return a time with a prefix."""
    unit = style.scaled("s", value)
    return f"{number(value / unit.size)} {unit.label}"


def peak(line: Line) -> str:
    """Return the largest contact force."""
    if unbounded(line.scene, line.method):
        return "no bound at first"
    largest = max((span.peak_force or 0.0 for span in line.reference.history.contacts), default=0.0)
    if largest == 0.0:
        return "-"
    unit = style.scaled("N", largest)
    return f"{number(largest / unit.size)} {unit.label}"


def unbounded(scene: Scene, method: Method) -> bool:
    """Return whether a viscous rod is struck hard.

    Its force starts as t^-1/2, and a mesh only determines where it ends.
    """
    viscous = {n for n, b in scene.bodies.items() if isinstance(b, Rod) and any(s.viscosity > 0.0 for s in b.segments)}
    hard = [contact for contact in scene.contacts if method.laws[contact.name].hard]
    return any({contact.left.body, contact.right.body} & viscous for contact in hard)


def leaves(line: Line) -> str:
    """Return as text the mean final velocity of a moving body.

    It is the first body that moved at the start.
    """
    history = line.reference.history
    for name, body in line.scene.bodies.items():
        if isinstance(body, Wall) or body.velocity == 0.0:
            continue
        ends = (body.left, body.right) if isinstance(body, ElasticBody) else ()
        if any(end.kind not in ("free", "mass") for end in ends):
            return "-"
        mass = body.mass + sum(end.value for end in ends if end.kind == "mass")
        velocity = float(history.evaluate([history.duration], f"momentum:{name}")[0]) / mass
        return f"{name}: {number(0.0 if abs(velocity) < NOTHING * abs(body.velocity) else velocity)} m/s"
    return "-"


def told(reference: Reference) -> str:
    """Return the name of a reference, with its uncertainty."""
    return reference.name if reference.uncertainty == 0.0 else f"{reference.name}, {reference.uncertainty:.0e}"


def contacts(spans: tuple[ContactSpan, ...]) -> str:
    """Return how many periods of contact there are."""
    return str(len(spans)) if spans else "-"


def row(line: Line) -> str:
    """Return one line of the table."""
    case = line.case
    if case.variant_name == "base":
        what = f"[{case.name}](../cases/{case.name}.yaml) | {case.title}"
    else:
        what = f"{case.name} `{case.variant_name}` | {changes(case)}"
    cells = [told(line.reference), contacts(line.reference.history.contacts), opening(line), peak(line), leaves(line)]
    return f"{what} | " + " | ".join(cells)


def changes(case: Case) -> str:
    """Return the changes of a variant, as in the file."""
    given = case.checked.variants[case.variant_name]
    return ", ".join(
        f"{path.removeprefix('bodies.').removeprefix('contacts.0.')}: {plain(given[path])}" for path in given
    )


def plain(value: object) -> str:
    """Return a value as a case file writes it."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {plain(inner)}" for key, inner in value.items()) + "}"
    return f"{value:g}" if isinstance(value, float) else str(value)


def sheet(lines: dict[str, list[Line]]) -> Figure:
    """Draw the contact forces of all cases, one small panel each."""
    rows = -(-len(lines) // COLUMNS)
    margins = style.Margins(left=0.34, right=0.1, top=0.3, bottom=0.3, across=0.36, down=0.46)
    figure, axes = style.grid(rows, COLUMNS, 0.82, margins)
    panels = [axis for line in axes for axis in line]
    for axis, (name, group) in zip(panels, lines.items(), strict=False):
        draw(axis, name, group)
    for axis in panels[len(lines) :]:
        axis.set_axis_off()
    return figure


def draw(axis: object, name: str, group: list[Line]) -> None:
    """Draw the forces of one case and its variants into a panel."""
    from matplotlib.axes import Axes

    assert isinstance(axis, Axes)
    curves = []
    for place, line in enumerate(group):
        names = [f"force:{contact.name}" for contact in line.scene.contacts]
        loaded = [probe.channel for probe in line.scene.loaded_ends] if not names else []
        for rank, channel in enumerate(names or loaded):
            t, values = style.curve(line.reference.history, channel, line.scene.duration, 300)
            colour = style.INK if len(group) == 1 else style.PALETTE[place % len(style.PALETTE)]
            trip = line.scene.round_trip if math.isfinite(line.scene.round_trip) else line.scene.duration
            curves.append((t / trip, values, colour, 1.0 if rank == 0 else 0.6, bool(loaded)))
    start = 0.1 * float(curves[0][0][-1]) if unbounded(group[0].scene, group[0].method) else -1.0
    largest = max(float(values[t > start].max(initial=0.0)) for t, values, *_ in curves)
    later = max(float(values[t > 0.04 * t[-1]].max(initial=0.0)) for t, values, *_ in curves)
    if later < 0.1 * largest:  # a first force that is gone at once: cut it, as the rest would be a line on the floor
        largest = 3.0 * later
    largest = largest or 1.0  # N, where nothing ever met
    unit = style.scaled("m" if curves[0][4] else "N", largest)
    for t, values, colour, width, dashed in curves:
        axis.plot(t, values / unit.size, color=colour, linewidth=width, linestyle="--" if dashed else "-")
    axis.set_title(f"{name}  [{unit.label}]", fontsize=5.8, pad=3.0)
    axis.tick_params(labelsize=5.0, length=1.5, pad=1.5)
    axis.margins(x=0.0)
    head = 1.06 if len(group) == 1 else 1.3  # room for the names of variants
    axis.set_ylim(-0.05 * largest / unit.size, head * largest / unit.size)
    if len(group) > 1:
        for place, line in enumerate(group):
            said = "as written" if line.case.variant_name == "base" else line.case.variant_name
            axis.annotate(
                said,
                (0.02 if curves[0][4] else 0.985, 0.995 - (0.105 if len(group) < 6 else 0.09) * place),
                xycoords="axes fraction",
                fontsize=4.6 if len(group) < 6 else 4.0,
                ha="left" if curves[0][4] else "right",
                va="top",
                color=style.PALETTE[place % len(style.PALETTE)],
                bbox={"facecolor": style.PAPER, "edgecolor": "none", "alpha": 0.7, "pad": 0.4},
            )


def page(lines: dict[str, list[Line]]) -> str:
    """Return the table of the page, with the number of cases."""
    rows = [row(line) for group in lines.values() for line in group]
    head = "case | what it is | reference | contacts | first opening | peak force | exit velocity"
    return f"{len(lines)} cases, {len(rows)} scenes.\n\n{table(head, rows)}"


STUDY = Study(
    {"cases.md": filled({"cases": lambda: page(all_answered())})},
    {"figures/cases.png": lambda: sheet(all_answered())},
    comparable=lambda text: re.sub(r"converged, \S+", "converged", text),  # uncertainties differ between machines
)
