"""The families of descriptions that the automatic choice may take, with what is known of each before any run.

What is known are facts of the class: an order of convergence, and how its error hangs on the step and on the times of
the scene. The factors before them were measured on the paper's impact and its relatives (docs/automatic-choice.md); a
trial of two resolutions corrects them, so they decide how many trials are needed and never what error is stated.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from impactlab.contact.power_law import Hertz
from impactlab.exact.cost import predicted_s
from impactlab.models.mesh.bar_elements import elements_per_segment
from impactlab.refine.contact_times import rise_time
from impactlab.refine.described import has_one_answer, without_places
from impactlab.refine.descriptions import (
    ORDINARY,
    as_delay_line,
    as_implicit_mesh,
    as_lumped_mesh,
    as_rigid_bodies,
    as_waves,
    is_special,
)
from impactlab.refine.extrapolation import RATIO
from impactlab.scene.facts import is_a_delay_line, is_coupled, rods_of, shortest_transit, split_at_contacts
from impactlab.scene.method import Simulation, force_jumps, laws_of
from impactlab.scene.problem import Scene

EXACT_ERROR = 1e-9  # told of the exact solver, which is good to 1e-12 but for instants near a grazing touch
FIXED_S = 1.5e-4  # s, that any stepped run takes
NEXT_TO_NOTHING = 1.5
RESOLVING = 100  # elements a rod that damped fronts must be as wide as, to count as smooth
SETUP_EXACT_S, SETUP_LINE_S, SETUP_MESH_S = 1.5e-3, 6e-4, 8e-4


@dataclass(frozen=True)
class Family:
    """A description that can be refined by one number, its fineness."""

    name: str
    unit: str  # what the fineness counts
    run: Callable[[int], Simulation]
    seconds: Callable[[int], float]  # predicted time of solving
    error: Callable[[int], float]  # predicted
    order: float  # of its error in the fineness, from below
    safety: float  # by which an estimate from two resolutions is multiplied
    setup_s: float  # predicted
    doubt: float = 1.0  # by which its predicted cost is raised where families are compared: how rough its facts are
    coarsest: int = 16  # coarser pairs show no order yet
    witness: Callable[[int], Simulation] | None = None  # the same off the special step, where the family has that
    witness_error: Callable[[int], float] = lambda _n: 0.0  # at most, of the witness
    finest: int = 10_000_000
    multiple: int = 1  # that a fineness is of

    def words(self, fineness: int) -> str:
        """Return the candidate for people."""
        return f"{self.name}, {fineness} {self.unit}" if self.unit else self.name

    def fineness_for(self, error: float) -> int:
        """Return the least fineness whose predicted error, with safety, lies within an error."""
        low, high = self.coarsest, self.coarsest
        while self.safety * self.error(high) > error and high < self.finest:
            low, high = high, min(2 * high, self.finest)
        while high - low > max(1, low // 16):
            middle = (low + high) // 2
            low, high = (middle, high) if self.safety * self.error(middle) > error else (low, middle)
        return high

    def start_for(self, error: float) -> int:
        """Return the fineness to begin with: as for an error, or finer where that costs next to nothing."""
        needed = free = self.fineness_for(error)
        while self.seconds(2 * free) <= NEXT_TO_NOTHING * FIXED_S and free < self.finest:
            free *= 2
        return self.whole(max(needed, free))

    def coarser(self, fineness: int) -> tuple[int, int]:
        """Return two lower values of fineness, rising, by the golden section; half the coarsest is the least."""
        second = self.whole(max(round(fineness / RATIO), self.coarsest // 2 + 1))
        first = self.whole(max(round(second / RATIO), self.coarsest // 3))
        return (first, second) if first < second else (second, self.whole(second + 1))

    def whole(self, fineness: int) -> int:
        """Return the next fineness that the family may have."""
        return -(-fineness // self.multiple) * self.multiple


def exact(asked: Simulation) -> Family:
    """Return the exact solver; raises `CaseError` or `PairingError` with the reason where it does not serve."""
    seconds = predicted_s(*asked)
    waves = as_waves(asked)
    return Family(
        "continuous, from event to event",
        "",
        lambda _n: waves,
        lambda _n: seconds,
        lambda _n: EXACT_ERROR,
        0.0,
        1.0,
        SETUP_EXACT_S,
    )


def stepped(asked: Simulation) -> Iterator[Family]:
    """Give the families that step and serve a scene; none where its physics has no single answer."""
    if not has_one_answer(asked):
        return
    scene = split_at_contacts(asked.scene)
    asked = Simulation(scene, asked.method)
    rods, laws = rods_of(scene), laws_of(*asked)
    if not rods:
        yield _rigid(asked)
        return
    hard = any(law.hard for law in laws)
    stepped_law = any(not law.is_spring for law in laws)  # springs alone are solved exactly
    if not hard and stepped_law and is_a_delay_line(scene) and without_places(scene) == scene:
        yield _delay_line(asked)
    coupled = any(is_coupled(rod) for rod in rods)
    jumps = force_jumps(*asked)  # fronts on the mesh
    if not coupled:
        yield _explicit(asked, jumps, 1.0 if jumps and is_special(scene) else ORDINARY)
    yield _implicit(asked, jumps)


def shortest_element(scene: Scene, elements: int) -> float:
    """Return the time of a wave through the shortest element of meshes with so many elements a rod [s]."""
    return min(
        segment.length / segment.wave_speed / count
        for rod in rods_of(scene)
        for segment, count in zip(rod.segments, elements_per_segment(rod.segments, elements), strict=True)
    )


def _rise(asked: Simulation) -> float:
    scene, method = asked
    return min((rise_time(scene, method, contact) for contact in scene.contacts), default=scene.duration)


def _rigid(asked: Simulation) -> Family:
    rise, duration = _rise(asked), asked.scene.duration
    return Family(
        "rigid bodies",
        "steps",
        lambda n: as_rigid_bodies(asked, n),
        lambda n: FIXED_S + 2.5e-7 * n,
        lambda n: (duration / n) ** 2 / (rise * duration),
        order=2.0,
        safety=3.0,
        setup_s=SETUP_LINE_S,
        coarsest=40,
    )


def _delay_line(asked: Simulation) -> Family:
    scene = asked.scene
    rods, shortest, rise = len(rods_of(scene)), shortest_transit(scene), _rise(asked)
    # Elastic power laws set in softly; what damps with the indentation rate has a force with a kink.
    elastic = all(isinstance(law, Hertz) or law.is_spring for law in laws_of(*asked))
    factor = 0.25 if elastic else 2.5
    return Family(
        "stepped delay line",
        "steps in the shortest transit",
        lambda n: as_delay_line(asked, n),
        lambda n: FIXED_S + 2e-7 * (1 + rods) * n * scene.duration / shortest,
        lambda n: factor * (shortest / n) ** 2 / (rise * scene.duration),
        order=2.0,
        safety=2.0,
        setup_s=SETUP_LINE_S,
        # Half of it is even: transits of other rods are often whole multiples of half the shortest, and a wave that
        # arrives between two steps is less exact. Even and odd numbers of steps would not lie on one line.
        multiple=4,
    )


def _explicit(asked: Simulation, jumps: bool, courant: float) -> Family:
    scene = asked.scene
    rods, shortest, rise = len(rods_of(scene)), shortest_transit(scene), _rise(asked)
    special = jumps and courant == 1.0
    if special:
        # An opening falls between two steps now here, now there: an error may be nearly that of half the fineness.
        order, factor, safety = 2.0, 6.0, 4.0
    elif jumps:
        order, factor, safety = 1.0, 2.0, 3.0
    else:
        order, factor, safety = 2.0, 1.5, 2.0

    def error(n: int) -> float:
        h = shortest / n
        return factor * (h * h / (rise * scene.duration) if order == 2.0 else h / scene.duration)

    return Family(
        f"lumped mesh, central difference at courant {courant:g}",
        "elements a rod",
        lambda n: as_lumped_mesh(asked, n, courant),
        lambda n: FIXED_S + (1.5e-7 + 0.9e-9 * rods * n) * scene.duration / (courant * shortest_element(scene, n)),
        error,
        order,
        safety,
        setup_s=SETUP_MESH_S,
        doubt=1.5,
        witness=(lambda n: as_lumped_mesh(asked, n, ORDINARY)) if special else None,
        witness_error=lambda n: 6.0 * shortest / n / scene.duration,
    )


def _implicit(asked: Simulation, jumps: bool) -> Family:
    scene = asked.scene
    rods, shortest, rise = rods_of(scene), shortest_transit(scene), _rise(asked)
    damped = min((_damping_time(scene, rod.name) for rod in rods), default=0.0)

    def error(n: int) -> float:
        h = shortest / n
        if not jumps:
            return 1.5 * h * h / (rise * scene.duration)
        # Damping rounds the fronts over a time that grows with it; elements that resolve it converge at order 2.
        return (1.5 if damped == 0.0 else 0.5) * h / scene.duration * h / (h + 10.0 * damped)

    return Family(
        "consistent mesh, midpoint rule at courant 1/2",
        "elements a rod",
        lambda n: as_implicit_mesh(asked, n),
        lambda n: FIXED_S + (3e-7 + 7e-9 * len(rods) * n) * 2.0 * scene.duration / shortest_element(scene, n),
        error,
        2.0 if not jumps or damped > 0.0 else 1.0,
        safety=2.0 if not jumps or 10.0 * damped > shortest / RESOLVING else 4.0,
        setup_s=SETUP_MESH_S,
        doubt=1.5,
    )


def _damping_time(scene: Scene, name: str) -> float:
    rod = next(rod for rod in rods_of(scene) if rod.name == name)
    return rod.damping.stiffness + min(segment.viscosity / segment.young for segment in rod.segments)
