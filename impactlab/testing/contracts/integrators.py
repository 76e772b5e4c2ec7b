"""Contract suites of integrators, with fixed and with adaptive steps."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np

from impactlab.errors import PairingError
from impactlab.integrators.base import AbstractAdaptive, AbstractIntegrator, Problem
from impactlab.models.base import AbstractRodModel, Operators
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.numerics.banded import full, multiply, solve
from impactlab.scene.bodies import End, Rod
from impactlab.stepper import Stepper
from impactlab.testing.contracts.common import PIECE, at_most, described
from impactlab.types import Array

GROWING = 500  # steps of a free motion whose growth is looked at
PUSHED = 20  # random steps under a contact force, each from another state


def face_row(system: Operators) -> Array:
    """Return a row over a system's coordinates to push along."""
    return np.cos(np.arange(system.load.size))


def stepped(stepper: Stepper, state: Array, force: float = 0.0) -> Array:
    """Return the state after one step under a contact force [N] on the first port."""
    after = state.copy()
    stepper.free(stepper.parameters, after)
    return after + force * stepper.force_response[0] if force else after


def free_mass(load: float, velocity: float) -> Operators:
    """Return a mass of 2 kg in one coordinate, under a constant load [N] from t = 0."""
    one = np.ones((1, 1))
    start = np.array([load]), np.zeros(1), np.array([velocity])
    return Operators(2.0 * one, 0.0 * one, 0.0 * one, *start, 0.0, 0.0, True, True)


def energy_of(stepper: Stepper, state: Array) -> float:
    """Return the energy [J] that a scheme measures."""
    out = np.zeros(3)
    stepper.measure(stepper.parameters, state, out)
    return float(out[0])


def momentum_of(stepper: Stepper, state: Array) -> float:
    """Return the momentum [N s] of `free_mass` as a run reads it."""
    out = np.zeros(3)
    stepper.measure(stepper.parameters, state, out)
    return float(out[2] if stepper.whole_momentum else 2.0 * state[1] + out[2])


class IntegratorContract:
    """Properties of every integrator. Override ``system`` where it steps other bodies."""

    part: ClassVar[AbstractIntegrator]

    def system(self) -> Operators:
        """Return a clamped rod in coordinates that the integrator accepts."""
        model: AbstractRodModel = Modal(None, 6) if self.part.needs_modes else FiniteElement(6, "lumped")
        return model.build(Rod("rod", (PIECE,), End("free"), End("clamped")), 0.0).operators()

    def modes(self) -> tuple[Array, Array]:
        """Return frequencies [rad/s] and mass-normalised shapes (n_dof, n_dof) of the system."""
        from scipy.linalg import eigh

        squared, shapes = eigh(full(self.system().stiffness), full(self.system().mass))
        return np.sqrt(squared), shapes

    def test_it_has_a_description_and_a_source(self) -> None:
        described(self.part)

    def test_its_facts_have_the_right_types(self) -> None:
        kind = type(self.part)
        assert kind.order >= 1, f"order is {kind.order}"
        assert all(0.0 <= point <= 1.0 for point in (kind.load_point, kind.velocity_point))
        for fact in (kind.any_dt, kind.jump_in_force, kind.projects_first, kind.needs_diagonal_mass, kind.needs_modes):
            assert isinstance(fact, bool)

    def error(self, steps: int) -> float:
        """Return the relative error after a quarter period under a smooth force."""
        frequencies, shapes = self.modes()
        system = self.system()
        end = 0.5 * np.pi / frequencies[0]
        speed, row = 2.0 * np.pi / end, shapes[:, 0] @ full(system.mass)
        stepper = self.part.prepare(system, row[None, :], end / steps)
        state = stepper.state.copy()
        for k in range(steps):
            force = 0.5 * (1.0 - math.cos(speed * (k + self.part.load_point) * end / steps))
            state = stepped(stepper, state) + force * stepper.force_response[0]
        push, w = shapes.T @ row, frequencies
        turn, driven = np.cos(w * end), math.cos(speed * end)
        exact = shapes @ (0.5 * push * ((1.0 - turn) / w**2 - (driven - turn) / (w**2 - speed**2)))
        return float(np.linalg.norm(state[: exact.size] - exact) / np.linalg.norm(exact))

    def measured_order(self) -> tuple[float, list[float]]:
        """Return the order of errors, and the errors, by halved steps."""
        first = max(40, math.ceil(2.0 * 0.5 * np.pi / self.modes()[0][0] / min(self.part.limit(self.system()), 1.0)))
        errors, orders = [self.error(first)], [math.inf]
        for halvings in range(1, 7):
            errors.append(self.error(first * 2**halvings))
            orders.append(math.log2(errors[-2] / errors[-1]))
            if abs(orders[-1] - orders[-2]) < 0.05:
                break
        return orders[-1], errors

    def test_its_order_is_the_declared_one(self) -> None:
        measured, errors = self.measured_order()
        # An order that moves by less than 0.05 from one halving to the next is as near to its limit, or nearer.
        assert abs(measured - self.part.order) < 0.1, f"measured order {measured:.3f}, errors {errors}"

    def test_it_damps_the_first_mode_or_refuses_damping(self) -> None:
        frequencies, shapes = self.modes()
        system, rate = self.system(), 0.2 * frequencies[0]
        damping = rate * system.mass  # every mode u'' + rate u' + w^2 u = 0
        damped = system._replace(damping=damping, ground_dashpots=None, displacement=shapes[:, 0].copy())
        turn = math.sqrt(frequencies[0] ** 2 - 0.25 * rate**2)  # rad/s
        end = 0.5 * np.pi / turn
        steps = max(100, math.ceil(2.0 * end / min(self.part.limit(damped), 1.0)))
        try:
            stepper = self.part.prepare(damped, np.zeros((0, system.load.size)), end / steps)
        except PairingError:
            return
        state, n_dof = stepper.state.copy(), system.load.size
        for _ in range(steps):
            state = stepped(stepper, state)
        velocity = float(shapes[:, 0] @ full(system.mass) @ state[n_dof : 2 * n_dof])
        exact = -(frequencies[0] ** 2 / turn) * math.exp(
            -0.5 * rate * end
        )  # the rate of its displacement, at its largest
        # Without damping it is larger by 17 %; a scheme of first order is off by some 2 % after 100 steps.
        what = "the relative error of the velocity of a damped mode (a scheme without damping raises PairingError)"
        at_most(abs(velocity / exact - 1.0), 0.04, what)

    def test_force_response_is_that_of_a_load(self) -> None:
        system, dt = self.system(), 0.3 / self.modes()[0][-1]
        row, random = face_row(system), np.random.default_rng(5)
        n_dof = row.size
        moving = system._replace(displacement=random.normal(size=n_dof), velocity=random.normal(size=n_dof) * 1e5)
        force = 1e3 * float(np.max(np.abs(multiply(system.stiffness, moving.displacement))))
        bare = self.part.prepare(moving, row[None, :], dt)
        loaded = self.part.prepare(moving._replace(load=moving.load + force * row), row[None, :], dt)
        # A force in the equation of motion met none before this step; accelerations beside it include the load already.
        kept = bare if self.part.step(moving, dt).force is None else loaded
        begun = np.concatenate((bare.state[: 2 * n_dof], kept.state[2 * n_dof :]))
        one = stepped(bare, bare.state) + force * bare.force_response[0]
        other = stepped(loaded, begun)
        for part in (slice(0, n_dof), slice(n_dof, 2 * n_dof)):
            # One step of six coordinates in two orders: some ten roundings of the largest.
            size = float(np.max(np.abs(other[part])))
            at_most(float(np.max(np.abs(one[part] - other[part]))), 1e-13 * size, "the difference of both states")

    def test_its_velocities_belong_to_the_declared_point_of_the_step(self) -> None:
        """Compare them with v0 + a t: a scheme of second order is exact at a constant acceleration."""
        if self.part.order < 2:
            return  # half a step is within its error
        dt, steps, start, rate = 0.1, 5, 0.7, 1.5
        stepper = self.part.prepare(free_mass(2.0 * rate, start), np.ones((1, 1)), dt)
        state = stepper.state.copy()
        for _ in range(steps):
            state = stepped(stepper, state)
        point = (float(state[1]) - start) / (rate * dt) - (steps - 1)
        # Rounding of a few steps, over a step's change of the velocity.
        text = f"velocity_point is {self.part.velocity_point:g}, but at a constant acceleration the velocity after"
        assert abs(point - self.part.velocity_point) < 1e-9, f"{text} a step is that at {point:.4g} of it"

    def test_it_kicks_then_drifts_if_declared(self) -> None:
        """Rows of beads are stepped by these formulas in place of its code."""
        if not self.part.kicks_then_drifts:
            return
        dt, force, load = 0.1, 5.0, 3.0
        stepper = self.part.prepare(free_mass(load, 0.7), np.ones((1, 1)), dt)
        before = stepper.state.copy()
        after = stepped(stepper, before, force)
        kicked = before[1] + dt * (force + load) / 2.0
        # Two products and two sums.
        text = "kicks_then_drifts is True, but a step of a free mass under F is not v += dt F/m, then u += dt v"
        assert abs(after[1] - kicked) < 1e-14, text
        assert abs(after[0] - before[0] - dt * kicked) < 1e-14, text
        assert self.part.load_point == 0.0, "kicks_then_drifts: its force acts at the start, load_point = 0"

    def test_a_force_and_an_impulse_give_their_momentum(self) -> None:
        dt, steps, force, impulse = 0.1, 5, 5.0, 3.0
        stepper = self.part.prepare(free_mass(0.0, 0.7), np.ones((1, 1)), dt)
        start = momentum_of(stepper, stepper.state)
        struck = stepped(stepper, stepper.state) + impulse * stepper.impulse_response[0]
        pushed = stepper.state.copy()
        for _ in range(steps):
            pushed = stepped(stepper, pushed, force)
        for state, given, name in ((struck, impulse, "an impulse"), (pushed, steps * dt * force, "a force")):
            if name == "a force" and self.part.momentum_point is not None:
                continue  # its momentum includes impulses still to come, which follow the force
            error = abs(momentum_of(stepper, state) - start - given)
            at_most(error, 1e-13 * given, f"the error of the momentum given by {name} [N s]")

    def excess(self, load_point: float) -> float:
        """Return the largest gain of energy beyond the work of a force, over the energy.

        ``load_point`` is the place in the step to which the work belongs: a force at the start works over half of the
        steps before and after it, with their velocities, any other over the path of the face.
        """
        system, dt, random = self.system(), 0.3 / self.modes()[0][-1], np.random.default_rng(7)
        row, n_dof, gains = face_row(system), system.load.size, []
        answer = float(row @ solve(system.mass, row))
        for _ in range(PUSHED):
            begun = random.normal(size=n_dof), random.normal(size=n_dof) * 0.3 / dt
            stepper = self.part.prepare(system._replace(displacement=begun[0], velocity=begun[1]), row[None, :], dt)
            state = stepped(stepper, stepped(stepper, stepper.state))
            size = float(np.linalg.norm(state[n_dof : 2 * n_dof])) / dt / math.sqrt(answer)
            force = 0.1 * size * float(random.normal())
            after, energy = stepped(stepper, state, force), energy_of(stepper, state)
            faces = [(row @ each[:n_dof], row @ each[n_dof : 2 * n_dof]) for each in (state, after)]
            (u, v), (u_after, v_after) = faces
            path = 0.5 * dt * (v + v_after) if load_point == 0.0 else u_after - u
            allowed = force * path + self.part.force_gain * (dt * force) ** 2 * answer
            gains.append((energy_of(stepper, after) - energy - allowed) / energy)
        return float(max(gains))

    def test_a_force_adds_no_more_than_its_work(self) -> None:
        """Compare the work over the path that the loop books for the declared `load_point`."""
        found = self.excess(self.part.load_point)
        # Rounding of products of six coordinates, each with the square of the state.
        if found <= 1e-12:
            return
        declared = f"load_point = {self.part.load_point:g}"
        text = f"a contact force adds {found:.3g} of the energy beyond its work, with {declared}"
        assert self.part.gains_energy > 0.0, f"{text}, and gains_energy is 0"
        if self.part.order < 2:  # a false point leaves the order of any other scheme at one
            other = 0.5 if self.part.load_point == 0.0 else 0.0
            assert self.excess(other) > 1e-12, f"{text}, and nothing with {other:g}"

    def test_projection_moves_displacements_and_what_follows_from_them(self) -> None:
        system, dt = self.system(), 0.3 / self.modes()[0][-1]
        row, n_dof = face_row(system), system.load.size
        stepper = self.part.prepare(system, row[None, :], dt)
        moved = solve(system.mass, row)
        response = stepper.projection_response[0]
        if self.part.projects_first:
            # The projection moves the start of the step: its end lies elsewhere.
            assert np.any(response[n_dof : 2 * n_dof] != 0.0)
            return
        error = float(np.max(np.abs(response[:n_dof] - moved)))
        at_most(error, 1e-14 * float(np.max(np.abs(moved))), "the error of the displacement per projection [1/kg]")
        assert not np.any(response[n_dof : 2 * n_dof])
        begun = self.part.prepare(system._replace(displacement=system.displacement + moved), row[None, :], dt)
        rest = (begun.state - stepper.state)[2 * n_dof :]
        # Products of six coordinates in two orders.
        error = float(np.max(np.abs(response[2 * n_dof :] - rest), initial=0.0))
        at_most(
            error, 1e-13 * float(np.max(np.abs(rest), initial=0.0)), "the error of values derived from displacements"
        )

    def growth(self, dt: float) -> float:
        """Return the growth factor of free motion in the highest mode, after `GROWING` steps."""
        frequencies, shapes = self.modes()
        system = self.system()._replace(displacement=shapes[:, -1], velocity=0.1 * frequencies[-1] * shapes[:, -1])
        stepper = self.part.prepare(system, np.zeros((0, system.load.size)), dt)
        state, largest, n_dof = stepper.state.copy(), 0.0, system.load.size
        for _ in range(GROWING):
            state = stepped(stepper, state)
            largest = max(largest, float(np.max(np.abs(state[:n_dof]))))
        return largest / float(np.max(np.abs(shapes[:, -1])))

    def test_it_is_stable_up_to_its_limit_and_not_beyond(self) -> None:
        limit = self.part.limit(self.system())
        if math.isinf(limit):
            at_most(self.growth(100.0 / self.modes()[0][-1]), 1e3, "the growth of the highest mode")
            return
        # Two per cent below the limit of 2/w a leapfrog swings to 1/sin of a fifth: five times its start at most.
        at_most(self.growth(0.98 * limit), 20.0, "the growth of the highest mode below the limit")
        # Two per cent above, a step grows by e^0.4: 500 of them by more than 1e80.
        grown = self.growth(1.02 * limit)
        assert not grown < 1e6, f"beyond its limit the highest mode grows by {grown:.4g} only: the limit is too low"

    def test_energy_of_a_free_motion_never_rises(self) -> None:
        system, random = self.system(), np.random.default_rng(6)
        shape = self.modes()[1] @ random.normal(size=system.load.size)
        stepper = self.part.prepare(
            system._replace(displacement=shape), np.zeros((0, shape.size)), 0.5 / self.modes()[0][-1]
        )
        state, energies, out = stepper.state.copy(), [], np.zeros(3)
        for _ in range(300):
            state = stepped(stepper, state)
            stepper.measure(stepper.parameters, state, out)
            energies.append(out[0])
        # 300 steps of six coordinates: rounding.
        rise = float(np.max(np.array(energies) - np.minimum.accumulate(energies)))
        at_most(rise, 1e-12 * energies[0], "the rise of the energy [J]")

    def test_a_retimed_stepper_is_one_prepared_for_that_step(self) -> None:
        system, dt = self.system(), 0.3 / self.modes()[0][-1]
        row = face_row(system)[None, :]
        retimed, fresh = self.part.prepare(system, row, dt), self.part.prepare(system, row, 0.37 * dt)
        assert (retimed.retime is not None) == self.part.any_dt
        if retimed.retime is None:
            return
        retimed.retime(retimed.parameters, 0.37 * dt)
        begun = np.cos(np.arange(fresh.state.size))
        assert np.array_equal(stepped(retimed, begun), stepped(fresh, begun))


class AdaptiveContract:
    """Properties of every adaptive integrator, on the free motion of a rod that nothing holds."""

    part: ClassVar[AbstractAdaptive]

    def problem(self) -> tuple[Problem, Array, Array]:
        """Return half a period of a moving, ringing free rod, its end and momentum."""
        from scipy.linalg import eigh

        system = FiniteElement(6, "lumped").build(Rod("rod", (PIECE,), End("free"), End("free")), 0.0).operators()
        stiffness, mass = full(system.stiffness), full(system.mass)
        n_dof, (squared, shapes) = system.load.size, eigh(stiffness, mass)
        frequency, shape = float(np.sqrt(squared[1])), shapes[:, 1] / np.max(np.abs(shapes[:, 1]))
        matrix = np.zeros((2 * n_dof, 2 * n_dof))
        matrix[:n_dof, n_dof:] = np.eye(n_dof)
        matrix[n_dof:, :n_dof] = -np.linalg.solve(mass, stiffness)
        until = np.pi / frequency
        begun = np.concatenate((shape / frequency, np.ones(n_dof)))
        scale = np.concatenate((np.full(n_dof, 1.0 / frequency), np.ones(n_dof)))

        def rates(time: float, state: Array) -> Array:  # noqa: ARG001
            return np.asarray(matrix @ state)

        def jacobian(time: float, state: Array) -> Array:  # noqa: ARG001
            return matrix

        problem = Problem(rates, jacobian, 0.0, until, begun, scale, until)
        end = np.concatenate((until - shape / frequency, np.ones(n_dof)))
        return problem, end, np.concatenate((np.zeros(n_dof), mass.sum(axis=0)))

    def test_it_has_a_description_and_a_source(self) -> None:
        described(self.part)

    def test_its_facts_have_the_right_types(self) -> None:
        assert self.part.gains_energy >= 0.0, f"gains_energy is {self.part.gains_energy}"
        assert isinstance(self.part.most_steps, int)
        assert self.part.most_steps >= 1, f"most_steps is {self.part.most_steps}"

    def test_it_reaches_the_end_and_keeps_momentum(self) -> None:
        problem, end, momentum = self.problem()
        solver, steps = self.part.solver(problem), 0
        while solver.status == "running":
            begin = solver.t
            solver.step()
            steps += 1
            assert begin < solver.t <= problem.until
            assert solver.t_old == begin
            inside = solver.dense_output()(np.array([begin, solver.t]))
            assert inside.shape == (end.size, 2)
            # A linear sum of the state that nothing changes: rounding, whatever the tolerance.
            at_most(abs(float(momentum @ solver.y) / PIECE.mass - 1.0), 1e-10, "the relative error of the momentum")
            at_most(steps, self.part.most_steps - 1, "the number of steps")
        assert solver.status == "finished"
        assert solver.t == problem.until
        # Errors of steps add up; the bound that a part declares for energies over a run is room for half a period.
        error = float(np.max(np.abs(solver.y - end) / problem.scale))
        at_most(error, self.part.gains_energy, "the error at the end, over the scale of each coordinate,")

    def test_no_step_is_longer_than_allowed(self) -> None:
        problem, _, _ = self.problem()
        solver = self.part.solver(problem._replace(longest=problem.until / 50.0))
        while solver.status == "running":
            begin = solver.t
            solver.step()
            at_most(solver.t - begin, problem.until / 50.0 * (1.0 + 1e-12), "a step [s]")
