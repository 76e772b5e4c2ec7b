"""Derivatives of stepped runs by differences, against exact ones: an example, random scenes, located events."""

from __future__ import annotations

import math
import statistics
import warnings
from collections.abc import Iterable, Iterator
from functools import cache
from typing import Any, NamedTuple

import numpy as np

import impactlab as il
from impactlab import api
from impactlab.derivatives.differences import Difference, differences
from impactlab.derivatives.parameters import read_parameters
from impactlab.errors import ImpactlabError
from impactlab.sweeps.axes import at_point
from impactlab.sweeps.quantities import quantities_of, values
from studies.pages import Study, filled, percent, table

SCENES = 200
LOCATED = 40  # scenes run with dated and with located events
QUANTITIES = ("first_opening", "time_in_contact", "impulse", "peak_force", "final_velocity", "final_energy")
WEIGHTS = {1: 3 / 4, 2: -3 / 20, 3: 1 / 60}  # of a central difference of order six
WIDTH = 1e-4  # of the parameter, between its points
ROUNDING = 1e-9  # of a derivative, and of value over parameter: smaller errors are the exact run's own
LONG_STEPS, SHORT_STEPS = "exact modes, 2 steps a period", "exact modes, 10 steps a period"
STEPPERS: dict[str, tuple[str, str, str, tuple[float, ...]]] = {  # mesh, integrator, step rule and its values
    "central difference": ("lumped", "central_difference", "courant", (0.5, 0.9)),
    "Newmark": ("consistent", "newmark", "courant", (0.25, 0.5, 1.0)),
    "modes": ("modes", "newmark", "points_per_period", (10.0,)),
    LONG_STEPS: ("modes", "exact_modal", "points_per_period", (2.0,)),
    SHORT_STEPS: ("modes", "exact_modal", "points_per_period", (10.0,)),
}


class Drawn(NamedTuple):
    """A random stepped case, its exact counterpart, and the path of a parameter."""

    case: il.Case
    exact: il.Case
    path: str
    law: str  # spring or hard
    stepper: str


class Found(NamedTuple):
    """A derivative by differences beside the exact one, NaN where the exact contacts change."""

    drawn: Drawn
    difference: Difference
    true: float
    per_parameter: float  # value over parameter

    @property
    def within(self) -> bool:
        """Whether the exact derivative lies within three stated errors."""
        rounding = ROUNDING * (abs(self.true) + self.per_parameter)
        return abs(self.difference.derivative - self.true) <= 3.0 * self.difference.error + rounding


def draw(seed: int, steppers: Iterable[str], springs_only: bool = False) -> Drawn:
    """Return a mass that strikes a rod with a random end.

    The rod is free, clamped, with a dashpot, or with a wall behind it.
    """
    r = np.random.default_rng(seed)
    length, area, young, density = (
        r.uniform(0.2, 1.0),
        10 ** r.uniform(-4, -3),
        10 ** r.uniform(10.3, 11.4),
        r.uniform(2e3, 9e3),
    )
    speed, impedance, trip = (
        r.uniform(0.5, 5.0),
        math.sqrt(young * density) * area,
        2 * length * math.sqrt(density / young),
    )
    spring = springs_only or bool(r.random() < 0.65)
    far = str(r.choice(["clamped", "free", "dashpot", "wall"]))
    stepper = str(r.choice(list(steppers)))
    if far == "dashpot" and "modes" in stepper:
        far = "clamped"
    mesh, integrator, rule, steps = STEPPERS[stepper]
    elements = int(r.choice([100, 200, 400]))
    model: dict[str, Any] = {"kind": "finite_element", "elements": elements, "mass": mesh}
    if mesh == "modes":
        model = {"kind": "modal", "elements": elements // 2, "modes": 2 * elements // 5}
    solve = {"model": model, "integrator": {"kind": integrator}, "step": {rule: float(r.choice(steps))}}
    law: dict[str, Any] = {"kind": "addition_deletion" if stepper == "central difference" else "wave_identification"}
    if spring:
        law = {"kind": "penalty", "stiffness": float(young * area / length * 10 ** r.uniform(0.0, 1.5))}
        if r.random() < 0.4:
            law["damping"] = float(impedance * 10 ** r.uniform(-2, 0))
    end = (
        {"dashpot": float(impedance * r.uniform(0.3, 3.0))}
        if far == "dashpot"
        else "clamped"
        if far == "clamped"
        else "free"
    )
    rod = il.Rod(length=length, area=area, material={"young": young, "density": density}, ends={"right": end})
    bodies: dict[str, Any] = {
        "hammer": il.Mass(mass=length * area * density * 10 ** r.uniform(-0.7, 0.7), velocity=speed), "rod": rod
    }  # fmt: skip
    gap = float(r.uniform(0.02, 0.2) * speed * trip) if r.random() < 0.5 else 0.0
    contacts = [il.Contact("hammer", "rod.left", law, gap=gap)]
    if far == "wall":
        bodies["wall"] = il.Wall()
        contacts.append(il.Contact("rod.right", "wall", law, gap=float(r.uniform(0.1, 0.6) * speed * trip)))
    solve["duration"] = {"round_trips": float(r.uniform(2.0, 4.0))}
    case = il.Case(name=f"scene_{seed}", bodies=bodies, contacts=contacts, solve=solve)
    paths = [f"bodies.{key}" for key in ("hammer.mass", "hammer.velocity", "rod.length", "rod.area")]
    paths += [f"bodies.rod.material.{key}" for key in ("young", "density")]
    paths += ["contacts.0.gap"] * (gap > 0.0) + ["contacts.1.gap"] * (far == "wall")
    paths += [f"contacts.0.law.{key}" for key in law if key != "kind"]
    hard = [(f"contacts.{n}.law", law if spring else {"kind": "addition_deletion"}) for n in range(len(contacts))]
    exact = case.with_settings([("solve.model", {"kind": "continuous"}), *hard])
    return Drawn(case, exact, str(r.choice(paths)), "spring" if spring else "hard", stepper)


def true_derivatives(case: il.Case, path: str) -> list[float]:
    """Return derivatives of all values of an exact case.

    NaN where its contacts change within the difference.
    """
    at = read_parameters(case, [path])[0].value

    def run(value: float) -> tuple[list[float], tuple[Any, ...]]:
        scene, method = at_point(case, {path: value}).simulation()
        history = api.solve(scene, method)
        rows = values(history, quantities_of(scene, QUANTITIES, case.registry), case.registry)
        return [each for row in rows for each in row], tuple(
            (span.contact, span.end is None) for span in history.contacts
        )

    runs = {n: run(at * (1.0 + n * WIDTH)) for n in range(-3, 4)}
    if len({sequence for _, sequence in runs.values()}) > 1:
        return [math.nan] * len(runs[0][0])
    pairs = {n: (np.array(runs[n][0]) - np.array(runs[-n][0])) / (at * WIDTH) for n in WEIGHTS}
    return [float(each) for each in sum(weight * pairs[n] for n, weight in WEIGHTS.items())]


def compared(drawn: Drawn, case: il.Case | None = None) -> list[Found]:
    """Return all derivatives of a scene by its parameter."""
    case = case or drawn.case
    rows = differences(case, drawn.path, quantities_of(case.scene(), QUANTITIES, case.registry))
    found = [each for row in rows for each in row]
    at = abs(read_parameters(case, [drawn.path])[0].value)
    true = true_derivatives(drawn.exact, drawn.path)
    return [Found(drawn, each, exact, abs(each.value) / at) for each, exact in zip(found, true, strict=True)]


def scenes(
    count: int, first: int, steppers: Iterable[str], events: tuple[str, ...] = ("dated",)
) -> Iterator[list[list[Found]]]:
    """Give the results of so many random scenes, for each kind of events.

    Scenes whose own run is refused are skipped.
    """
    seed, names = first, list(steppers)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        while count > 0:
            seed += 1
            drawn = draw(seed, names, springs_only=len(events) > 1)
            try:
                yield [compared(drawn, drawn.case.with_("solve.events", kind)) for kind in events]
            except ImpactlabError:
                continue
            count -= 1


def line(name: str, found: list[Found]) -> list[str]:
    """Return the line of a table on derivatives.

    It has counts, share within three errors, median of the stated errors, and reasons.
    """
    given = [each for each in found if not each.difference.reason]
    known = [each for each in given if math.isfinite(each.true)]
    errors = [each.difference.error / abs(each.difference.derivative) for each in given if each.difference.derivative]
    median = statistics.median(errors) if errors else None
    reasons = [each.difference.reason for each in found]
    large = sum(reason.startswith("its error") for reason in reasons)
    sequence = sum(reason.startswith("the sequence") for reason in reasons)
    others = len(found) - len(given) - large - sequence
    share = f"{100.0 * sum(each.within for each in known) / len(known):.1f} %" if known else "-"
    return [
        name,
        f"{len(found)}",
        f"{len(given)}",
        share,
        percent(median),
        f"{large}",
        f"{sequence}",
        f"{others}",
    ]


HEAD = "scenes | derivatives | given | within 3 errors | median error | error too large | contacts change | other"


@cache
def random_scenes() -> tuple[Found, ...]:
    """Return the derivatives of all random scenes."""
    names = [name for name in STEPPERS if name not in (LONG_STEPS, SHORT_STEPS)]
    return tuple(each for (found,) in scenes(SCENES, 10_000, names) for each in found)


def by_method() -> str:
    """Return the table of random scenes by method and law."""
    found = random_scenes()
    lines = [line("all", list(found))]
    for name in dict.fromkeys(each.drawn.stepper for each in found):
        lines.append(line(name, [each for each in found if each.drawn.stepper == name]))
    for name, words in (("spring", "springs and dashpots in contact"), ("hard", "hard contact")):
        lines.append(line(words, [each for each in found if each.drawn.law == name]))
    return table(HEAD, lines)


def by_events() -> str:
    """Return the table of dated against located events, on the same scenes."""
    lines = []
    for stepper in (LONG_STEPS, SHORT_STEPS):
        pairs = list(scenes(LOCATED, 20_000, [stepper], ("dated", "located")))
        for number, kind in enumerate(("dated", "located")):
            lines.append(line(f"{stepper}, {kind}", [each for pair in pairs for each in pair[number]]))
    return table(HEAD, lines)


def struck(**solve: Any) -> il.Case:
    """Return the struck rod with a contact spring in units.

    These are E = rho = A = v0 = 1, T = 1.
    """
    rod = il.Rod(length=0.5, area=1.0, material={"young": 1.0, "density": 1.0}, ends={"right": "clamped"})
    return il.Case(
        name="struck",
        bodies={"hammer": il.Mass(mass=0.5, velocity=1.0), "rod": rod},
        contacts=[il.Contact("hammer", "rod.left", {"kind": "penalty", "stiffness": 20.0}, gap=0.05)],
        solve={"duration": {"round_trips": 2}, **solve},
    )


def narrow() -> str:
    """Return the table of central differences over a fifth of a step, around several middles."""
    rows = []
    for periods in (2, 10):
        for events in ("dated", "located"):
            case = struck(
                model={"kind": "modal", "elements": 200, "modes": 100},
                integrator={"kind": "exact_modal"},
                step={"points_per_period": periods},
                events=events,
            )
            opening, dt = (
                quantities_of(case.scene(), ["first_opening"], case.registry),
                api.prepare(case).dt or math.nan,
            )
            spread = []
            for path, at, rate in (("bodies.hammer.mass", 0.5, 1.087), ("contacts.0.gap", 0.05, 1.0)):
                ends = []
                for middle in at + 0.37 * np.arange(12) * dt / rate:
                    pair = []
                    for side in (-1, 1):
                        scene, method = case.with_(path, float(middle + side * 0.1 * dt / rate)).simulation()
                        pair.append(values(api.solve(scene, method), opening, case.registry)[0][0])
                    ends.append((pair[1] - pair[0]) / (0.2 * dt / rate))
                spread.append(f"{min(ends):.2f} to {max(ends):.2f}")
            rows.append([f"{periods} steps a period, {events}", *spread])
    exact = ["exact, at the first middle", "1.09", "1.00"]
    return table("events | opening by the mass | opening by the gap", [*rows, exact])


def example() -> str:
    """Return the table of the struck rod by the mass."""
    case = struck(
        model={"kind": "finite_element", "elements": 400, "mass": "lumped"},
        integrator={"kind": "central_difference"},
        step={"courant": 0.9},
    )
    drawn = Drawn(case, case.with_("solve.model", {"kind": "continuous"}), "bodies.hammer.mass", "spring", "")
    names = ["opening", "time in contact", "impulse", "peak force", "velocity of the mass after it"]
    lines = []
    for name, each in zip(names, compared(drawn), strict=False):
        scale = 1.0 / each.per_parameter * math.copysign(1.0, each.difference.value)
        by, error, true = (number * scale for number in (each.difference.derivative, each.difference.error, each.true))
        lines.append([name, f"{by:.4f}", f"{abs(error):.2g}", f"{true:.4f}"])
    return table("quantity | by differences | stated error | exact", lines)


STUDY = Study(
    {
        "sensitivities-stepped.md": filled(
            {"example": example, "scenes": by_method, "events": by_events, "narrow": narrow}
        )
    }
)
