"""Coordinates of struck beams, three claims of the literature put to the test: beam-bases.md."""

from __future__ import annotations

import functools
import math
import re
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from impactlab.bases.base import AbstractBasis
from impactlab.bases.craig_bampton import CraigBampton
from impactlab.bases.eigenvectors import Eigenvectors
from impactlab.bases.ritz import Ritz
from impactlab.bases.striker_attached import StrikerAttached
from impactlab.bases.substructured import Substructured
from impactlab.contact.dispersive_identification import DispersiveIdentification
from impactlab.contact.impulse_momentum import ImpulseMomentum
from impactlab.contact.power_law import Hertz, LankaraniNikravesh
from impactlab.errors import CaseError, PairingError
from impactlab.history import AbstractHistory
from impactlab.integrators.newmark import Newmark
from impactlab.metrics import midpoints, relative_l2
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.report.figures.style import PALETTE, Margins, grid, log_axis
from impactlab.scene import Beam
from impactlab.scene.method import StepRule
from impactlab.types import Array
from studies.beams.scenes import DENSITY, RESISTANCE, YOUNG, beam, slender, struck
from studies.pages import Study, table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ELEMENTS = 100
BASES: dict[str, AbstractBasis] = {
    "eigenvectors": Eigenvectors(),
    "craig_bampton": CraigBampton(),
    "ritz": Ritz(),
    "striker_attached": StrikerAttached(),
    "substructured": Substructured(pieces=4, others=1),
}
COUNTS = (4, 6, 8, 12, 20, 40)
SPHERE = 4.0 / 3.0 * math.pi * 0.01**3 * DENSITY  # kg, radius 1 cm
STIFFNESS = 4.0 / 3.0 * YOUNG / (2.0 * (1.0 - 0.3**2)) * math.sqrt(0.01)  # N/m^(3/2), that sphere on a flat


class Struck(NamedTuple):
    """A soft impact on a beam, and the quantities compared."""

    name: str
    body: Beam
    x: float
    mass: float
    end: float  # s
    law: Any = Hertz(stiffness=STIFFNESS)


PINNED = Struck("sphere on a pinned beam, middle", beam(0.1535, "pinned", "pinned"), 0.07675, SPHERE, 2e-4)
TIP = Struck("mass on a cantilever's tip", beam(0.1535, "clamped", "free"), 0.1535, 0.06, 4e-4)
LANKARANI = LankaraniNikravesh(stiffness=STIFFNESS, restitution=0.8)
SCENES = (PINNED, TIP, TIP._replace(name="the same, Lankarani and Nikravesh's law", law=LANKARANI))


def run(scene: Struck, model: Any) -> AbstractHistory:
    """Return the history of a soft impact at 1 cm/s."""
    step = StepRule(dt=scene.end / 8000.0)
    return struck(scene.body, model, scene.law, scene.mass, scene.end, scene.x, velocity=0.01, step=step)


@functools.cache
def reference(scene: Struck) -> AbstractHistory:
    """Return the history on the same mesh with all its modes.

    It is the best that a basis of that mesh can reach.
    """
    return run(scene, Modal(ELEMENTS))


@functools.cache
def error(scene: Struck, name: str, count: int) -> float:
    """Return the relative L2 error of the force.

    NaN where the basis cannot be so small.
    """
    try:
        seen = run(scene, Modal(ELEMENTS, count, basis=BASES[name]))
    except CaseError:
        return math.nan
    t = midpoints(scene.end, 2000)
    force = f"force:{seen.scene.contacts[0].name}"
    return relative_l2(seen.evaluate(t, force), reference(scene).evaluate(t, force)) or 0.0


def share(value: float) -> str:
    """Return a share as percent."""
    return "-" if math.isnan(value) else f"{100.0 * value:.2g} %"


def number(value: float) -> str:
    """Return an error with two digits."""
    return "-" if math.isnan(value) else f"{value:.1e}"


def errors() -> str:
    """Return the table of errors against the number of coordinates."""
    rows = [
        [scene.name, name, *(number(error(scene, name, count)) for count in COUNTS)]
        for scene in SCENES
        for name in BASES
    ]
    return table(["scene", "basis", *(f"{count}" for count in COUNTS)], rows)


# A hard mass on a long beam: the first moments, in which little of the beam moves.

LONG = beam(2.0, "pinned", "pinned")
HARD_MASS = 0.05 * LONG.mass
HARD_END = (HARD_MASS / RESISTANCE) ** 2
MOMENT = 0.25 * HARD_END  # s, at which the energy is looked at
EARLY_COUNTS = (8, 12, 20, 40)
NEAR = 0.25  # m, half the length of the piece that is struck, of four


def hard(model: Any) -> AbstractHistory:
    """Return the history of a hard mass on the long beam.

    It strikes the middle; the field is kept at `MOMENT`.
    """
    step = StepRule(dt=HARD_END / 400.0)
    return struck(
        LONG, model, DispersiveIdentification(), HARD_MASS, HARD_END, 0.5 * LONG.length, step=step,
        integrator=Newmark(), snapshots=(MOMENT,),
    )  # fmt: skip


@functools.cache
def early(name: str, count: int) -> tuple[float, float]:
    """Return the mass's velocity error [v0] and the share of far motion.

    The error is the root mean square against erfcx. Far is beyond 0.25 m from the contact, and the share is that of the
    sum of v^2 over the mesh at `MOMENT`.
    """
    try:
        seen = hard(FiniteElement(200) if name == "mesh" else Modal(200, count, basis=BASES[name]))
    except (CaseError, PairingError):
        return math.nan, math.nan
    t = HARD_END * (np.arange(100) + 0.5) / 100.0
    apart = float(np.sqrt(np.mean((seen.evaluate(t, "velocity:hammer") - slender(HARD_MASS, 1.0, t)) ** 2)))
    field = seen.field("beam", MOMENT, "velocity")
    far = np.abs(field.x - 0.5 * LONG.length) > NEAR
    return apart, float(np.sum(field.values[far] ** 2) / np.sum(field.values**2))


def first_moments() -> str:
    """Return the table of the hard mass on the long beam."""
    rows = []
    for name in ("mesh", *BASES):
        cells = [early(name, 0 if name == "mesh" else count) for count in EARLY_COUNTS]
        rows.append([name, *(f"{number(a)}, {share(b)}" for a, b in cells)])
    return table(["basis", *(f"{count}: error, far away" for count in EARLY_COUNTS)], rows)


# Impulse and momentum: one kick at the middle of a pinned beam, in its analytic modes.

KICKED = beam(1.0, "pinned", "pinned")
KICKS = (5, 10, 20, 40, 80, 160, 320)


class Kick(NamedTuple):
    """The velocities after the first kick of a mass.

    The mass is that of the beam, at 1 m/s and restitution 1.
    """

    x: Array  # (n,) m
    velocity: Array  # (n,) m/s
    impulse: float  # N s
    width: float  # of the beam, over which the velocity is above half of its peak
    reach: float  # of the beam, the least width that holds all velocities above a tenth of the peak
    far: float  # share of the sum of v^2 beyond a tenth of the beam from the contact
    given: float  # share of the mass's energy that is in the beam


@functools.cache
def kick(modes: int) -> Kick:
    """Return the jumps of the generalised impulse-momentum equations: dv(x) = J sum phi_i(x) phi_i(x0)."""
    body = Modal(None, modes).build_beam(KICKED, 0.0)
    mass, x0 = KICKED.mass, 0.5 * KICKED.length
    at = body.row(x0, "displacement")
    impulse = 2.0 / (1.0 / mass + float(at @ at))
    x = np.linspace(0.0, KICKED.length, 4001)
    half = np.array([impulse * float(body.row(float(place), "displacement") @ at) for place in x[:2001]])
    velocity = np.concatenate((half, half[-2::-1]))  # the same on both sides of the middle
    size = np.abs(velocity) / velocity.max()
    halved, tenth = x[size > 0.5], x[size > 0.1]
    far = float(np.sum(velocity[np.abs(x - x0) > 0.1 * KICKED.length] ** 2) / np.sum(velocity**2))
    given = float(impulse**2 * (at @ at) / mass)
    return Kick(x, velocity, impulse, float(np.ptp(halved)), float(np.ptp(tenth)), far, given)


def first_kick_of_a_run(modes: int) -> float:
    """Return the first impulse of the package's own law [N s]."""
    seen = struck(KICKED, Modal(None, modes), ImpulseMomentum(restitution=1.0), KICKED.mass, 1e-5, 0.5)
    return float(next(event.impulse for event in seen.events if event.impulse is not None))


def kicks() -> str:
    """Return the table of first kicks."""
    rows = []
    for modes in KICKS:
        each = kick(modes)
        rows.append(
            [f"{modes}", f"{each.impulse / KICKED.mass:.4f}", f"{each.width:.4f} L", f"{each.reach:.3f} L",
             share(each.far), share(each.given)]
        )  # fmt: skip
    head = ["modes", "impulse [M v0]", "width at half height", "reach of a tenth", "motion beyond L/10", "energy given"]
    return table(head, rows)


# Figures.


def basis_figure() -> Figure:
    """Return the errors of the force against the number of coordinates."""
    figure, [panels] = grid(1, 2, 2.9, Margins(across=0.4), share=True)
    for axes, scene in zip(panels, (PINNED, TIP), strict=True):
        for colour, name in enumerate(BASES):
            points = [(count, error(scene, name, count)) for count in COUNTS]
            kept = [(count, value) for count, value in points if math.isfinite(value)]
            axes.loglog(*zip(*kept, strict=True), color=PALETTE[colour], marker="o", markersize=3.5)
        axes.set_title(scene.name)
        axes.set_xlabel("coordinates")
        log_axis(axes.yaxis)
        axes.set_xticks(COUNTS, [f"{count}" for count in COUNTS])
        axes.minorticks_off()
    panels[0].set_ylabel("error of the contact force")
    for colour, name in enumerate(BASES):
        panels[0].text(
            0.03, 0.34 - 0.065 * colour, name, color=PALETTE[colour], transform=panels[0].transAxes, fontsize=8.0
        )
    return figure


def kick_figure() -> Figure:
    """Return the velocities after a kick, and how the width falls."""
    figure, [[left, right]] = grid(1, 2, 2.7, Margins(across=0.8))
    for colour, modes in enumerate((5, 20, 80)):
        each = kick(modes)
        left.plot(each.x, each.velocity / each.velocity.max(), color=PALETTE[colour], linewidth=1.2)
        left.text(0.03, 0.93 - 0.08 * colour, f"{modes} modes", color=PALETTE[colour], transform=left.transAxes)
    left.set_xlabel("place  x / L")
    left.set_ylabel("velocity after the kick, scaled")
    names = ("width at half height, over L", "motion beyond L/10, share", "energy given, share", "impulse, over M v0")
    for colour, (name, of) in enumerate(
        zip(
            names,
            (lambda k: k.width, lambda k: k.far, lambda k: k.given, lambda k: k.impulse / KICKED.mass),
            strict=True,
        )
    ):
        right.loglog(KICKS, [of(kick(modes)) for modes in KICKS], color=PALETTE[3 + colour], marker="o", markersize=3.5)
        right.text(0.97, 0.93 - 0.08 * colour, name, color=PALETTE[3 + colour], transform=right.transAxes, ha="right")
    right.set_ylim(1e-3, 12.0)
    right.set_ylabel("share")
    right.set_xlabel("modes")
    for axis in (right.xaxis, right.yaxis):
        log_axis(axis)
    return figure


TEXT = """\
# Coordinates of struck beams: three claims of the literature

<!-- Written by `python -m studies beam_bases`; edit studies/beams/bases.py, not this page. -->

A beam that is struck may be described by a few coordinates, and the literature says which. Errors are relative to the
same mesh with all of its modes, so that they show the effect of the choice of coordinates only.

## Lee and Yoon: load-dependent Ritz vectors beat mode shapes

As EscalonaMayoDominguez1999 (p. 767) reports Lee and Yoon: for beams struck by a concentrated mass, Ritz vectors that
start from the load describe the motion better than mode shapes. Relative L2 error of the contact force, by number of
coordinates ({elements} elements, Hertz contact of a steel sphere of 1 cm, 1 cm/s; the third scene with the damped
contact of Lankarani and Nikravesh, which Lee and Yoon use):

{errors}

![Error against the number of coordinates](figures/beam_bases_errors.svg)

**{lee_yoon}**
The first Ritz vector is the static response to the load; mode shapes lack a share of this response that falls as
$1/N^3$. Craig and Bampton's coordinates, with one for the contact, include it too, and eigenvectors with the striker
attached are also better than mode shapes. {others}

## Wu and Haug: only the neighbourhood of the contact moves at first

WuHaug1990 cut the beam into substructures and describe the struck one finely, because only what lies near the contact
is excited at first. A hard mass in the middle of a pinned beam of 2 m, a twentieth of its weight. Root mean square
error of its velocity [$v_0$] against the infinite beam, $\\operatorname{{erfcx}}(\\kappa\\sqrt t)$, until it has lost
57 % of it; and how much of the beam's motion (sum of $v^2$) lies outside the middle quarter when a quarter of that time
is over:

{first_moments}

**{wu_haug}** Ritz vectors, which do not depend on the size of this neighbourhood, do as well with fewer.

Later the waves reach the other pieces, and the parts left out stay missing however fine the struck one is: in the
first scene above the error of the force is {later}.

## Palas and others: with all modes, an impulse moves only the point that it strikes

Palas1992. The generalised impulse-momentum equations give each mode its share of an impulse at once: the velocity jumps
by $J\\sum_i\\phi_i(x)\\,\\phi_i(x_0)$, all over the beam. Wu and Haug call that impossible; Palas and others reply
that with all modes the jump is local. A mass of the beam's own strikes the middle of a pinned beam, restitution 1,
analytic modes:

{kicks}

![Velocities after a kick](figures/beam_bases_kicks.svg)

**Both are right.** With few modes the whole beam moves at once. The width falls as $1/N$, and the motion beyond $L/10$
as $1/N$ too. But the mass that takes part falls in the same way, so that impulse and energy vanish as $1/N$: with all
modes one kick moves one point, and nothing is transferred. The momentum of an impact on a beam takes time, and many
kicks.
"""


def verdicts() -> dict[str, str]:
    """Return the results of the tables on the first two claims."""
    ratio = [error(scene, "eigenvectors", 8) / error(scene, "ritz", 8) for scene in SCENES]
    best = {name: max(error(scene, name, 12) for scene in SCENES) for name in BASES}
    order = sorted(best, key=lambda name: best[name])
    said = "Confirmed" if min(ratio) > 1.0 else "Not confirmed"
    local = early("mesh", 0)[1]
    forty = {name: early(name, 40)[0] for name in BASES}
    pays = "pays" if forty["substructured"] < min(forty["eigenvectors"], forty["craig_bampton"]) else "does not pay"
    floor = error(PINNED, "substructured", 20), error(PINNED, "substructured", 40), error(PINNED, "eigenvectors", 40)
    return {
        "lee_yoon": f"{said}: with 8 coordinates the error of Ritz vectors is {min(ratio):.0f} to {max(ratio):.0f} "
        "times smaller.",
        "others": "At 12 coordinates, largest error over the three scenes, best first: "
        + ", ".join(f"{name} {best[name]:.1e}" for name in order)
        + ".",
        "wu_haug": f"Confirmed for the first moments: in the mesh {share(local)} of the motion lies outside the middle "
        f"quarter, and the fine description of that quarter {pays}: with 40 coordinates the error is "
        + ", ".join(f"{forty[name]:.1e} ({name})" for name in sorted(forty, key=lambda name: forty[name]))
        + ".",
        "later": f"{floor[0]:.1e} with 20 coordinates, {floor[1]:.1e} with 40, where eigenvectors "
        f"come to {floor[2]:.1e}",
    }


def page(_: str) -> str:
    """Return the page."""
    return TEXT.format(elements=ELEMENTS, errors=errors(), first_moments=first_moments(), kicks=kicks(), **verdicts())


STUDY = Study(
    {"beam-bases.md": page},
    {"figures/beam_bases_errors": basis_figure, "figures/beam_bases_kicks": kick_figure},
    # Ritz vectors are orthogonalised one by one and lose digits: their last columns differ between processors.
    comparable=lambda text: re.sub(r"(?m)^(\|.*\britz \|).*$", r"\1", text),
)
