"""Random Hopkinson trains: striker, incident bar, specimen, transmission bar, in hard contact one behind the other."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from impactlab.exact.results.history import ContinuousHistory
from impactlab.exact.solve import solve
from impactlab.scene import Mass, Point, Probe, Rod, Segment
from impactlab.scene.method import Simulation
from tests.reference import lattice
from tests.reference.exact_scenes import FREE, HARD, point, scene

STEP = 2.0e-9  # s, of which all transits are whole multiples
FINER = 4  # steps of the lattice in one of these
EVERY = 250  # of these steps the lattice is compared
FOLLOWED = 40  # openings and closings: a specimen that rattles on magnifies what the lattice rounds
MATERIALS = ((2.1e11, 7850.0), (7.0e10, 2700.0), (1.1e11, 8900.0), (4.1e11, 3900.0), (3.0e9, 1200.0), (1.16e11, 4500.0))
NAMES = ("striker", "incident", "specimen", "transmission")


class Train(NamedTuple):
    """A train whose transits are whole numbers of lattice steps."""

    rods: tuple[Rod, ...]  # the first is the striker; three rods where a mass strikes
    mass: float  # kg, of a striking mass; 0 for a rod
    velocity: float  # m/s, of the striker
    gaps: tuple[float, ...]  # m, at the left of the bars

    @property
    def bodies(self) -> list[Mass | Rod]:
        """Striker, bars and specimen, from left to right."""
        return [*([Mass("striker", self.mass, self.velocity)] if self.mass else []), *self.rods]

    def scene(self, duration: float = 1.0e-3) -> Simulation:
        """Return the train as bodies in contact."""
        pairs = zip(self.bodies, self.bodies[1:], self.gaps, strict=False)
        return scene(self.bodies, [(face(a), point(b, "left"), gap, HARD) for a, b, gap in pairs], duration)

    def joined(self, duration: float = 1.0e-3) -> Simulation:
        """Return the same with the bars and the specimen as one rod of three segments."""
        first, bars = self.bodies[0], self.rods[-3:]
        one = Rod("train", tuple(each.segments[0] for each in bars), FREE, FREE)
        places = (bars[0].length, bars[0].length + bars[1].length)
        probes = tuple(Probe("train", x, kind) for x in places for kind in ("force", "displacement"))
        contact = (face(first), point(one, "left"), self.gaps[0], HARD)
        return scene([first, one], [contact], duration, probes=probes)


def face(body: Mass | Rod) -> Point:
    """Return the right face of a body."""
    return point(body, "right" if isinstance(body, Rod) else "")


def rod(name: str, young: float, density: float, area: float, steps: int, velocity: float = 0.0) -> Rod:
    """Return a rod whose transit is so many steps of the lattice."""
    length = steps * STEP * (young / density) ** 0.5
    return Rod(name, (Segment(length, area, young, density),), FREE, FREE, velocity)


def random_train(rng: np.random.Generator) -> Train:
    """Return a train: bars alike or not, a specimen of any area and material, a rod or a mass as striker, any gaps."""
    bar = MATERIALS[int(rng.integers(0, 3))]
    area = float(10.0 ** rng.uniform(-4.3, -2.9))
    velocity = float(10.0 ** rng.uniform(-0.5, 1.6))
    other = bar if rng.random() < 0.7 else MATERIALS[int(rng.integers(0, 3))]
    shapes = [
        ("incident", *bar, area, int(rng.integers(40_000, 150_000))),
        ("specimen", *MATERIALS[int(rng.integers(0, 6))], area * float(10.0 ** rng.uniform(-1.5, 0.5)),
         int(rng.integers(400, 8_000))),
        ("transmission", *other, area * float(rng.choice([1.0, 1.0, 0.7, 1.6])), int(rng.integers(40_000, 150_000))),
    ]  # fmt: skip
    rods = tuple(rod(*shape) for shape in shapes)
    gaps = [0.0, 0.0, 0.0]
    if rng.random() < 0.3:
        gaps[int(rng.integers(0, 3))] = velocity * float(10.0 ** rng.uniform(-6.5, -4.5))
    if rng.random() < 0.25:
        segment = rods[0].segments[0]
        mass = segment.density * segment.area * rods[0].length * float(10.0 ** rng.uniform(-1.5, 0.5))
        return Train(rods, mass, velocity, tuple(gaps))
    striker = rod(
        "striker", *bar, area * float(rng.choice([1.0, 1.0, 0.8, 1.3])), int(rng.integers(6_000, 50_000)), velocity
    )
    return Train((striker, *rods), 0.0, velocity, tuple(gaps))


def on_lattice(train: Train, duration: float = 1.0e-3) -> lattice.Answer:
    """Return the answer of the lattice after every EVERY steps."""
    delays = [FINER * round(each.length / each.segments[0].wave_speed / STEP) for each in train.rods]
    z = [each.segments[0].impedance for each in train.rods]
    gaps = [0.0, *train.gaps] if not train.mass else list(train.gaps)
    return lattice.run(
        FINER * round(duration / STEP), STEP / FINER, delays, z, [each.velocity for each in train.rods], gaps,
        train.mass, train.velocity if train.mass else 0.0, FINER * EVERY,
    )  # fmt: skip


class Differences(NamedTuple):
    """Largest differences of one train."""

    lattice_displacement: float  # of all faces up to event FOLLOWED, over the largest displacement
    lattice_impulse: float  # of all contacts up to then, over the largest impulse
    segments_force: float  # while the bars hold together, over the largest force
    segments_displacement: float
    together: float  # s, how long they do
    energy: float  # largest error of the balance, over the energy


def compare(train: Train, duration: float = 1.0e-3) -> Differences:
    """Return how far the exact solver is from the lattice and from the train with its bars as one rod."""
    history = solve(*train.scene(duration))
    book = history.energy
    energy = float(np.max(np.abs(book.balance))) / float(book.total[0])
    answer = on_lattice(train, duration)
    t = np.minimum(np.arange(answer.left.shape[1]) * EVERY * STEP, duration)
    dates = [event.time for event in history.events]
    known = int(np.searchsorted(t, dates[FOLLOWED])) if len(dates) > FOLLOWED else len(t)
    t = t[:known]
    size = max(float(np.max(np.abs(answer.left))), float(np.max(np.abs(answer.right))))
    apart = 0.0
    for i, each in enumerate(train.rods):
        for x, face in ((0.0, answer.left), (each.length, answer.right)):
            found = history.evaluate(t, f"displacement:{each.name}@{x!r}")
            apart = max(apart, float(np.max(np.abs(found - face[i, :known]))) / size)
    if train.mass:
        found = history.evaluate(t, "position:striker")
        apart = max(apart, float(np.max(np.abs(found - answer.striker[:known]))) / size)
    push, largest = 0.0, float(np.max(answer.impulse))
    for number, contact in enumerate(history.scene.contacts):
        row = answer.impulse[number if train.mass else number + 1]
        signal = history.signals.force(history.numbers[contact.name])
        mine = signal.integral(t, False) - signal.integral(np.zeros(1), False)
        push = max(push, float(np.max(np.abs(mine - row[:known]))) / largest)
    force, displacement, together = against_segments(train, history, duration)
    return Differences(apart, push, force, displacement, together, energy)


def against_segments(train: Train, history: ContinuousHistory, duration: float) -> tuple[float, float, float]:
    """Return the differences of forces and displacements from the bars as one rod, and until when they hold [s]."""
    if any(train.gaps[1:]):
        return 0.0, 0.0, 0.0
    scene = train.joined(duration)
    whole = solve(*scene)
    length = [each.length for each in train.rods[-3:]]
    places = (length[0], length[0] + length[1])
    t = np.linspace(0.0, duration, 20_001)[1:] - 1.3e-9
    forces = [whole.evaluate(t, f"force:train@{x!r}") for x in places]
    largest = max(float(np.max(np.abs(force))) for force in forces)
    pulled = np.flatnonzero((forces[0] < -1e-9 * largest) | (forces[1] < -1e-9 * largest))
    last = int(pulled[0]) - 1 if len(pulled) else len(t)
    apart = 0.0
    for x, contact, force in zip(places, history.scene.contacts[1:], forces, strict=True):
        jumps = whole.jumps(f"force:train@{x!r}")
        near = np.abs(t[:, None] - jumps[None, :]).min(axis=1) < 1e-8 if len(jumps) else np.zeros(len(t), bool)
        mine = history.evaluate(t, f"force:{contact.name}")
        apart = max(apart, float(np.max(np.abs(mine - force)[:last][~near[:last]], initial=0.0)) / largest)
    moved, size = 0.0, 0.0
    for name, at, x in (("incident", length[0], places[0]), ("specimen", length[1], places[1])):
        here = whole.evaluate(t[:last], f"displacement:train@{x!r}")
        mine = history.evaluate(t[:last], f"displacement:{name}@{at!r}")
        size = max(size, float(np.max(np.abs(here), initial=0.0)))
        moved = max(moved, float(np.max(np.abs(here - mine), initial=0.0)))
    return apart, moved / size if size else 0.0, float(t[last - 1]) if last else 0.0
