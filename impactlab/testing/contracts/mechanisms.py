"""Contract suites of mechanisms: equations of motion, and parts named in cases."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, ClassVar, NamedTuple

import numpy as np

from impactlab.mechanisms.base import AbstractMechanism, Motion
from impactlab.mechanisms.equations import MechanismEquations
from impactlab.mechanisms.model import midpoint_gain, numbers_of, stepper_of
from impactlab.numerics.addresses import DERIVE, FREE, MEASURE, TERMS, call, entered, in_python, kernel_address
from impactlab.numerics.compiling import ENTRY
from impactlab.testing.contracts.common import at_most, described
from impactlab.types import Array

GRAVITY = (1.5, -9.81)  # m/s2
STATES = 12
TURNED = 0.3  # rad or m, by which rigid coordinates leave their start
TIME = 0.3  # s, at which terms are taken


@ENTRY
def taken(
    address: int, parameters: Array, t: float, p: Array, v: Array, mass: Array, force: Array, rows: Array,
    values: Array, rates: Array,
) -> None:  # fmt: skip
    """Take compiled terms from Python."""
    call(address, parameters, t, p, v, mass, force, rows, values, rates)


@ENTRY
def moved(free: int, derive: int, measure: int, parameters: Array, state: Array, book: Array) -> None:
    """Take a step for each row of a book, and write energy and work there."""
    for k in range(book.shape[0]):
        call(free, parameters, state)
        call(derive, parameters, state)
        call(measure, parameters, state, book[k])


class Terms(NamedTuple):
    """The terms at one state."""

    mass: Array  # (n, n)
    force: Array  # (n,)
    rows: Array  # (r, n)
    values: Array  # (r + 1,)
    rates: Array  # (r,)


class EquationsContract:
    """Properties of the equations of motion of every mechanism."""

    part: ClassVar[AbstractMechanism]
    duration: ClassVar[float] = 0.0  # s, of the free motion; 0: until a radian is turned, or ten of the first periods
    steps: ClassVar[int] = 400  # of the free motion

    def motion(self) -> Motion:
        """Return the mechanism in numbers, under gravity."""
        return self.part.motion(GRAVITY)

    def states(self) -> Iterator[tuple[Array, Array]]:
        """Yield random states about that at t = 0.

        Their energy of deformation is that of the motion, or of 1 rad/s.
        """
        motion, random = self.motion(), np.random.default_rng(11)
        n, stiffness = motion.position.size, np.diag(motion.stiffness)
        mass = self.taken(motion, motion.position, motion.velocity).mass
        moving = 0.5 * float(motion.velocity @ mass @ motion.velocity)
        if moving == 0.0:
            moving = 0.5 * float(np.sum(np.diag(mass)[stiffness == 0.0])) or 1.0
        energy = moving / n
        size = np.where(stiffness > 0.0, np.sqrt(energy / np.where(stiffness > 0.0, stiffness, 1.0)), TURNED)
        for _ in range(STATES):
            p = motion.position + size * random.normal(size=n)
            yield p, motion.velocity + np.sqrt(energy / np.diag(mass)) * random.normal(size=n)

    def taken(self, motion: Motion, p: Array, v: Array, *, plain: bool = False, readings_only: bool = False) -> Terms:
        """Return the terms at a state; ``plain`` as Python runs them."""
        n, r = p.size, len(self.part.readings)
        mass = np.full(0 if readings_only else n * n, np.nan)
        out = Terms(mass, np.full(n, np.nan), np.full(r * n, np.nan), np.full(r + 1, np.nan), np.full(r, np.nan))
        terms: Any = type(self.part).terms
        if plain:
            in_python(terms)(motion.parameters, TIME, p, v, *out)
        else:
            entered(taken, kernel_address(terms, TERMS), motion.parameters, TIME, p, v, *out)
        return out._replace(mass=mass.reshape(-1, n), rows=out.rows.reshape(r, n))

    def test_its_numbers_have_the_right_shapes(self) -> None:
        motion = self.motion()
        n = motion.position.size
        assert n > 0
        assert motion.velocity.shape == (n,)
        assert motion.stiffness.shape == (n, n)
        largest = float(np.max(np.abs(motion.stiffness)))
        skew = float(np.max(np.abs(motion.stiffness - motion.stiffness.T)))
        at_most(skew, 1e-12 * largest, "the difference of the stiffness and its transpose")
        assert motion.parameters.ndim == 1
        assert motion.rate > 0.0 or np.any(motion.stiffness)
        assert all(0 <= drive.coordinate < n for drive in motion.drives)

    def test_terms_depend_on_the_state_alone(self) -> None:
        motion = self.motion()
        states = list(self.states())
        first = [self.taken(motion, p.copy(), v.copy()) for p, v in states]
        for (p, v), before in reversed(list(zip(states, first, strict=True))):
            kept = p.copy(), v.copy()
            again = self.taken(motion, p, v)
            assert all(np.array_equal(a, b) for a, b in zip(before, again, strict=True)), "they remember a state"
            assert np.array_equal(p, kept[0]), "they change the position"
            assert np.array_equal(v, kept[1]), "they change the velocity"

    def test_readings_are_the_same_without_the_mass_matrix(self) -> None:
        motion = self.motion()
        for p, v in self.states():
            whole, part = self.taken(motion, p, v), self.taken(motion, p, v, readings_only=True)
            assert np.array_equal(whole.rows, part.rows)
            assert np.array_equal(whole.values[:-1], part.values[:-1])
            assert np.array_equal(whole.rates, part.rates)

    def test_plain_python_and_compiled_code_agree(self) -> None:
        motion = self.motion()
        for p, v in self.states():
            for one, other in zip(self.taken(motion, p, v), self.taken(motion, p, v, plain=True), strict=True):
                size = float(np.max(np.abs(other)))  # sums in another order
                at_most(float(np.max(np.abs(one - other))), 1e-12 * size, "the difference of its terms")

    def test_its_mass_matrix_is_symmetric_and_positive(self) -> None:
        motion = self.motion()
        for p, v in self.states():
            mass = self.taken(motion, p, v).mass
            size = np.sqrt(np.outer(np.diag(mass), np.diag(mass)))
            assert np.all(np.diag(mass) > 0.0)
            at_most(float(np.max(np.abs(mass - mass.T) / size)), 1e-12, "the asymmetry of the mass matrix")
            assert np.linalg.eigvalsh(mass / size)[0] > 0.0

    def test_rows_are_derivatives_of_the_values(self) -> None:
        motion = self.motion()
        for p, v in self.states():
            terms = self.taken(motion, p, v)
            size = 1.0 / np.sqrt(np.diag(terms.mass))  # of a coordinate in which 1 J moves at sqrt(2)/s
            for i, scale in enumerate(size):
                step = 1e-4 * scale / max(size) * TURNED
                found = np.zeros_like(terms.values)
                for factor, at in ((8.0, 1.0), (-8.0, -1.0), (-1.0, 2.0), (1.0, -2.0)):  # of fourth order
                    moved = p.copy()
                    moved[i] += at * step
                    found += factor * self.taken(motion, moved, v).values / (12.0 * step)
                largest = max(float(np.max(np.abs(terms.rows[:, i]))), float(np.max(np.abs(terms.values))))
                # Rounding of values over the step, and the fourth order of small steps.
                error = float(np.max(np.abs(found[:-1] - terms.rows[:, i])))
                at_most(error, 1e-6 * largest + 1e-14 * largest / step, f"the error of coordinate {i}")

    def test_rates_are_rows_times_velocities(self) -> None:
        motion = self.motion()
        for p, v in self.states():
            terms = self.taken(motion, p, v)
            scale = np.abs(terms.rows) @ np.abs(v)
            assert np.all(np.abs(terms.rates - terms.rows @ v) <= 1e-12 * scale)

    def test_adaptive_steps_solve_its_equations(self) -> None:
        """Check M p'' = force + rows^T F for all coordinates without a drive.

        1 N or N m acts on each reading.
        """
        motion = self.motion()
        n, numbers = motion.position.size, numbers_of(self.part, motion, np.zeros((0, 0)), 0.0)
        equations = MechanismEquations("it", numbers, motion.position, motion.velocity)
        free = np.setdiff1d(np.arange(n), [drive.coordinate for drive in motion.drives])
        for p, v in self.states():
            terms = self.taken(motion, p, v)
            displacement, velocity, forces = equations.at(TIME, p, v)
            assert np.array_equal(displacement, np.concatenate((p, terms.values[:-1])))
            assert np.array_equal(velocity, np.concatenate((v, terms.rates)))
            forces[n:] += 1.0
            a, _ = equations.accelerations(TIME, v, forces)
            pushed = terms.force + terms.rows.sum(axis=0)
            size = np.abs(terms.mass) @ np.abs(a) + np.abs(terms.force) + np.abs(terms.rows).sum(axis=0)
            assert np.all(np.abs(terms.mass @ a - pushed)[free] <= 1e-10 * size[free].max())

    def whole(self, motion: Motion) -> float:
        """Return the duration of the free motion [s]."""
        return self.duration or (1.0 / motion.rate if motion.rate > 0.0 else 20.0 * math.pi / motion.frequency)

    def bound(self) -> float:
        """Return the declared bound on the energy gain of free motion, for the longer of two steps."""
        motion = self.motion()
        return midpoint_gain(motion, self.whole(motion) / self.steps, impulses=False)

    def errors(self) -> tuple[float, float]:
        """Return the relative energy error of free motion for two steps.

        It is the largest change of energy less work, over the largest of both.
        """
        motion = self.motion()
        found = []
        for halvings in (0, 1):
            steps = self.steps * 2**halvings
            stepper = stepper_of(self.part, motion, np.zeros((0, 0)), self.whole(motion) / steps)
            kernels = (stepper.free, FREE), (stepper.derive, DERIVE), (stepper.measure, MEASURE)
            book = np.zeros((steps, 3))
            entered(moved, *(kernel_address(*each) for each in kernels), stepper.parameters, stepper.state, book)
            found.append(float(np.ptp(book[:, 0] - book[:, 1]) / np.max(np.abs(book[:, :2]))))
        return found[0], found[1]

    def test_free_motion_keeps_its_energy_to_second_order_or_better(self) -> None:
        coarse, fine = self.errors()
        if coarse > 1e-11:  # else rounding
            assert math.log2(coarse / fine) > 1.9 or fine < 1e-11, f"errors {coarse:.3g}, {fine:.3g}"
        at_most(fine, 1e-3, "the relative change of its energy")


class MechanismContract(EquationsContract):
    """Properties of every mechanism that a case names."""

    def test_it_has_a_description_and_a_source(self) -> None:
        described(self.part)

    def test_its_readings_have_names_of_their_own(self) -> None:
        names = [reading.name for reading in self.part.readings]
        assert len(set(names)) == len(names), f"a name is given twice in {', '.join(names)}"
        assert all(name.isidentifier() for name in names), f"names are words of letters, digits and _, not {names}"
        assert any(not reading.is_angle for reading in self.part.readings), "no reading is a position: nothing can meet"

    def test_its_declared_bound_holds_in_free_motion(self) -> None:
        at_most(self.errors()[0], self.bound(), "the relative change of its energy")
