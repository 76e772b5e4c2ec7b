"""One suite per kind of part, to inherit in a plugin's tests.

    class TestMyLaw(ContactLawContract):
        part = MyLaw(stiffness=1e9)

pytest collects the inherited tests under your class. Nothing here needs pytest itself: `impactlab plugins --check`
runs the same suites (`impactlab.testing.verdict`), with the options that a part gives in ``examples``.
"""

from __future__ import annotations

import ctypes
import dataclasses
import math
from typing import Any, ClassVar

import numpy as np

from impactlab import plugins
from impactlab.banded import full, multiply, solve
from impactlab.bases.base import AbstractBasis
from impactlab.bases.reduced import ReducedMesh
from impactlab.cite import entries_for
from impactlab.contact.base import AbstractContactLaw
from impactlab.errors import CaseError
from impactlab.integrators.base import AbstractAdaptive, AbstractIntegrator, Problem, Stepper
from impactlab.models.base import AbstractDiscreteModel, AbstractRodModel, Face, Operators
from impactlab.models.finite_element import FiniteElement
from impactlab.models.mesh import Mesh
from impactlab.models.modal import Modal
from impactlab.models.modal_body import ModalBody
from impactlab.pointers import COMPILED, LawAddress
from impactlab.scene import End, Rod, Segment
from impactlab.types import Array, Level, Port, Reply, SideFacts

PIECE = Segment(length=0.3, area=9e-4, young=2.1e11, density=7900.0)
STRUCK = (Face(0.0, 0, PIECE.mass),)  # by a mass, at the left end
PORTS = 200  # random ones each test answers


def described(part: object) -> None:
    """Check what a listing, a summary and `impactlab cite` need of a part."""
    kind = type(part)
    assert plugins.describe(kind), f"{kind.__name__} has no docstring"
    assert len(plugins.describe(kind)) < 200
    citations = plugins.citations_of(kind)
    assert citations, f"{kind.__name__} cites no source"
    assert all(isinstance(key, str) and key for key in citations)
    unknown = [key for key in citations if not key.startswith("@") and key not in entries_for(kind)]
    assert not unknown, f"no entry in citations.bib for {', '.join(unknown)}"
    assert dataclasses.is_dataclass(part)
    assert all(field.metadata.get("description") for field in dataclasses.fields(part) if field.init)


class ContactLawContract:
    """What every contact law must keep. Override ``sides`` where the law serves other bodies."""

    part: ClassVar[AbstractContactLaw]
    dt: ClassVar[float] = 1e-7

    def sides(self) -> tuple[SideFacts, SideFacts]:
        """Return a mass on the left of a steel rod."""
        nothing, mass = math.nan, PIECE.mass
        hammer = SideFacts("mass", nothing, nothing, nothing, nothing, nothing, mass, 0.0, self.dt / mass)
        stiffness, z, c = PIECE.young * PIECE.area / (0.01 * PIECE.length), PIECE.impedance, PIECE.wave_speed
        rod = SideFacts("rod", z, c, PIECE.area, stiffness, PIECE.length, mass, 0.0, 0.4 / z)
        return hammer, rod._replace(left_out=0.5 / stiffness)

    def port(self, random: np.random.Generator, opened: bool = False) -> Port:
        """Return a port of a scheme whose force acts at the start or in the middle of the step, with random motions."""
        left, right = self.sides()
        start = type(self.part).begin(self.part, left, right, self.dt)
        port = Port()
        port.time, port.dt = 0.0, self.dt
        port.load_point = float(random.choice([0.0, 0.5, 1.0]))
        port.jump_in_force = 1.0 if port.load_point == 0.0 else float(random.integers(0, 2))
        port.in_contact = 0.0 if opened else float(random.integers(0, 2))
        for side, facts in ((port.left, left), (port.right, right)):
            side.displacement, side.velocity = random.normal(0.0, 1e-7), random.normal(0.0, 1.0)
            side.velocity_per_force = facts.velocity_per_force
            side.displacement_per_force = 0.5 * self.dt * facts.velocity_per_force
            side.velocity_per_impulse = facts.velocity_per_force / self.dt
            side.free_velocity = side.velocity + random.normal(0.0, 0.1)
            side.free_displacement = side.displacement + 0.5 * self.dt * (side.velocity + side.free_velocity)
        away = 1e-3 if opened else 0.0
        port.gap = away + port.right.displacement - port.left.displacement
        port.free_gap = away + port.right.free_displacement - port.left.free_displacement
        port.gap_rate = port.right.velocity - port.left.velocity
        port.free_gap_rate = port.right.free_velocity - port.left.free_velocity
        port.gap_per_force = port.left.displacement_per_force + port.right.displacement_per_force
        port.rate_per_force = port.left.velocity_per_force + port.right.velocity_per_force
        port.rate_per_impulse = port.left.velocity_per_impulse + port.right.velocity_per_impulse
        port.gap_per_impulse = self.dt * port.rate_per_impulse
        port.gap_per_projection = port.rate_per_impulse
        port.predicted_gap = port.gap + port.dt * port.gap_rate
        # The compliance over gap and pushed row is symmetric and positive, as that of a body is.
        port.pushed_per_push = 0.5 * right.element_stiffness
        port.pushed_per_force = port.gap_per_push = 0.3 * math.sqrt(port.gap_per_force * port.pushed_per_push)
        if not opened:
            port.pushed, port.free_pushed = random.normal(0.0, 4e4, 2)
        port.parameters[: len(start.parameters)] = start.parameters
        port.memory[: len(start.memory)] = start.memory
        for number, reading in enumerate(start.readings):
            scale = {"velocity": 1.0, "stress": 4e7, "force": 4e4, "strain": 2e-4, "displacement": 1e-7}
            port.readings[number] = random.normal(0.0, scale[reading.quantity])
        return port

    def reply_to(self, port: Port, address: int | None = None) -> Reply:
        """Return the law's reply, asked as plain Python or through a C address, as the loop asks."""
        reply = Reply()
        reply.memory[:] = port.memory[:]
        if address is None:
            type(self.part).respond(port, reply)
        else:
            kind = ctypes.CFUNCTYPE(None, ctypes.POINTER(Port), ctypes.POINTER(Reply))
            kind(address)(ctypes.byref(port), ctypes.byref(reply))
        return reply

    def test_it_says_what_it_is_and_where_it_comes_from(self) -> None:
        described(self.part)

    def test_its_facts_have_the_right_types(self) -> None:
        kind = type(self.part)
        assert isinstance(kind.needs, frozenset)
        assert all(isinstance(level, Level) for level in kind.needs)
        for fact in (
            kind.compiled,
            kind.answers_force,
            kind.trial_at_end,
            kind.fixed_step,
            kind.hard,
            kind.is_spring,
            kind.smooth,
            kind.holds_position,
        ):
            assert isinstance(fact, bool)
        assert kind.gains_energy >= 0.0

    def test_same_port_same_reply_and_the_port_is_left_alone(self) -> None:
        random = np.random.default_rng(1)
        for _ in range(PORTS):
            port = self.port(random)
            before = bytes(port)
            one, other = self.reply_to(port), self.reply_to(port)
            assert bytes(port) == before, "respond writes into its port"
            assert bytes(one) == bytes(other), "respond remembers something outside its memory"

    def test_it_never_pulls_and_never_books_a_negative_loss(self) -> None:
        random = np.random.default_rng(2)
        for _ in range(PORTS):
            reply = self.reply_to(self.port(random))
            assert reply.failed == 0.0
            assert reply.force >= 0.0
            assert reply.impulse >= 0.0
            # A law that pushes along a reading holds part of that body's own strain energy, of either sign.
            assert reply.stored >= 0.0 or reply.push != 0.0
            assert reply.unresolved >= 0.0
            assert reply.dissipated >= 0.0
            assert reply.in_contact in (0.0, 1.0)
            assert math.isfinite(reply.force + reply.impulse + reply.trial)

    def test_far_apart_it_answers_nothing(self) -> None:
        random = np.random.default_rng(3)
        for _ in range(PORTS):
            reply = self.reply_to(self.port(random, opened=True))
            assert reply.force == reply.impulse == reply.stored == reply.dissipated == reply.in_contact == 0.0

    def test_plain_compiled_and_called_back_it_answers_the_same(self) -> None:
        if not COMPILED:
            return  # there is only plain Python to compare with
        kind, random = type(self.part), np.random.default_rng(4)
        addresses = [LawAddress(kind.respond, as_compiled) for as_compiled in {False, kind.compiled}]
        for _ in range(PORTS):
            port = self.port(random)
            plain = self.reply_to(port)
            for address in addresses:
                reply = self.reply_to(port, address.value)
                assert address.raised is None
                for name in ("force", "impulse", "trial", "stored", "dissipated", "unresolved", "in_contact"):
                    one, other = float(getattr(plain, name)), float(getattr(reply, name))
                    # A compiler may contract a product and a sum: a few roundings of the terms, which may cancel.
                    size = {"stored": 1e-3, "dissipated": 1e-3, "unresolved": 1e-3}.get(name, 1e4)
                    assert abs(one - other) <= 1e-12 * max(abs(one), size), name


def face_row(system: Operators) -> Array:
    """Return a row over a system's coordinates to push along."""
    return np.cos(np.arange(system.load.size))


def stepped(stepper: Stepper, state: Array) -> Array:
    """Return the state after one step without contact."""
    after = state.copy()
    stepper.free(stepper.parameters, after)
    return after


class IntegratorContract:
    """What every integrator must keep. Override ``system`` where it steps other bodies."""

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

    def test_it_says_what_it_is_and_where_it_comes_from(self) -> None:
        described(self.part)

    def test_its_facts_have_the_right_types(self) -> None:
        kind = type(self.part)
        assert isinstance(kind.serves, frozenset)
        assert all(isinstance(level, Level) for level in kind.serves)
        assert kind.order >= 1
        assert all(0.0 <= point <= 1.0 for point in (kind.load_point, kind.velocity_point))
        for fact in (
            kind.any_dt,
            kind.jump_in_force,
            kind.projects_first,
            kind.force_in_accelerations,
            kind.needs_diagonal_mass,
            kind.needs_modes,
            kind.hard_constraint_gains,
        ):
            assert isinstance(fact, bool)

    def error(self, steps: int) -> float:
        """Return the relative error after a quarter of the longest period under a smooth force (1 - cos)/2."""
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
        """Return the order at which errors fall, and the errors: steps are halved until it says the same twice."""
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

    def test_force_response_is_that_of_a_load(self) -> None:
        system, dt = self.system(), 0.3 / self.modes()[0][-1]
        row, random = face_row(system), np.random.default_rng(5)
        n_dof = row.size
        moving = system._replace(displacement=random.normal(size=n_dof), velocity=random.normal(size=n_dof) * 1e5)
        force = 1e3 * float(np.max(np.abs(multiply(system.stiffness, moving.displacement))))
        bare = self.part.prepare(moving, row[None, :], dt)
        loaded = self.part.prepare(moving._replace(load=moving.load + force * row), row[None, :], dt)
        # Accelerations that hold the contact force met none before this step; the others know the load already.
        kept = bare if self.part.force_in_accelerations else loaded
        begun = np.concatenate((bare.state[: 2 * n_dof], kept.state[2 * n_dof :]))
        one = stepped(bare, bare.state) + force * bare.force_response[0]
        other = stepped(loaded, begun)
        for part in (slice(0, n_dof), slice(n_dof, 2 * n_dof)):
            # One step of six coordinates in two orders: some ten roundings of the largest.
            assert np.max(np.abs(one[part] - other[part])) < 1e-13 * np.max(np.abs(other[part]))

    def test_jump_is_the_inverse_mass_times_the_row(self) -> None:
        system = self.system()
        stepper = self.part.prepare(system, face_row(system)[None, :], 0.1 / self.modes()[0][-1])
        expected = solve(system.mass, face_row(system))
        assert np.max(np.abs(stepper.jump[0] - expected)) < 1e-14 * np.max(np.abs(expected))

    def test_impulse_response_is_a_step_from_the_jump(self) -> None:
        system, dt = self.system(), 0.3 / self.modes()[0][-1]
        still = system._replace(load=np.zeros_like(system.load))
        stepper = self.part.prepare(still, face_row(system)[None, :], dt)
        begun = stepper.state.copy()
        begun[stepper.jump.shape[1] : 2 * stepper.jump.shape[1]] += stepper.jump[0]
        difference = stepped(stepper, begun) - stepper.impulse_response[0]
        assert np.max(np.abs(difference)) < 1e-13 * np.max(np.abs(stepper.impulse_response[0]))

    def test_projection_moves_displacements_and_what_follows_from_them(self) -> None:
        system, dt = self.system(), 0.3 / self.modes()[0][-1]
        row, n_dof = face_row(system), system.load.size
        stepper = self.part.prepare(system, row[None, :], dt)
        moved = solve(system.mass, row)
        answer = stepper.projection_response[0]
        if self.part.projects_first:
            # It moves what the step begins from: the end is not where the projection left it.
            assert np.any(answer[n_dof : 2 * n_dof] != 0.0)
            return
        assert np.max(np.abs(answer[:n_dof] - moved)) < 1e-14 * np.max(np.abs(moved))
        assert not np.any(answer[n_dof : 2 * n_dof])
        begun = self.part.prepare(system._replace(displacement=system.displacement + moved), row[None, :], dt)
        rest = (begun.state - stepper.state)[2 * n_dof :]
        # Products of six coordinates in two orders.
        assert np.max(np.abs(answer[2 * n_dof :] - rest), initial=0.0) <= 1e-13 * np.max(np.abs(rest), initial=0.0)

    def largest_after(self, dt: float, steps: int) -> float:
        """Return how many times its start a free motion in the highest mode has grown."""
        frequencies, shapes = self.modes()
        system = self.system()._replace(displacement=shapes[:, -1], velocity=0.1 * frequencies[-1] * shapes[:, -1])
        stepper = self.part.prepare(system, np.zeros((0, system.load.size)), dt)
        state, largest, n_dof = stepper.state.copy(), 0.0, system.load.size
        for _ in range(steps):
            state = stepped(stepper, state)
            largest = max(largest, float(np.max(np.abs(state[:n_dof]))))
        return largest / float(np.max(np.abs(shapes[:, -1])))

    def test_it_is_stable_up_to_its_limit_and_not_beyond(self) -> None:
        limit = self.part.limit(self.system())
        if math.isinf(limit):
            assert self.largest_after(100.0 / self.modes()[0][-1], 500) < 1e3
            return
        # Two per cent below the limit of 2/w a leapfrog swings to 1/sin of a fifth: five times its start at most.
        assert self.largest_after(0.98 * limit, 500) < 20.0
        # Two per cent above, a step grows by e^0.4: 500 of them by more than 1e80.
        assert not self.largest_after(1.02 * limit, 500) < 1e6

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
        rise = np.max(np.array(energies) - np.minimum.accumulate(energies))
        assert rise < 1e-12 * energies[0]

    def test_a_retimed_stepper_is_one_prepared_for_that_step(self) -> None:
        system, dt = self.system(), 0.3 / self.modes()[0][-1]
        row = face_row(system)[None, :]
        retimed, fresh = self.part.prepare(system, row, dt), self.part.prepare(system, row, 0.37 * dt)
        assert (retimed.retime is not None) == self.part.any_dt
        if retimed.retime is None:
            return
        jump, force, impulse = retimed.jump.ravel(), retimed.force_response.ravel(), retimed.impulse_response.ravel()
        retimed.retime(retimed.parameters, 0.37 * dt, jump, force, impulse)
        for one, other in (
            (force, fresh.force_response),
            (impulse, fresh.impulse_response),
            (retimed.parameters, fresh.parameters),
        ):
            assert np.array_equal(one, other.ravel())


class AdaptiveContract:
    """What every adaptive integrator must keep, on the free motion of a rod that nothing holds."""

    part: ClassVar[AbstractAdaptive]

    def problem(self) -> tuple[Problem, Array, Array]:
        """Return half a period of a free-free rod that moves and rings in its first mode, its end, and its momentum."""
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

    def test_it_says_what_it_is_and_where_it_comes_from(self) -> None:
        described(self.part)

    def test_its_facts_have_the_right_types(self) -> None:
        assert self.part.gains_energy >= 0.0
        assert isinstance(self.part.most_steps, int)
        assert self.part.most_steps >= 1

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
            assert abs(float(momentum @ solver.y) / PIECE.mass - 1.0) < 1e-10
            assert steps < self.part.most_steps
        assert solver.status == "finished"
        assert solver.t == problem.until
        # Errors of steps add up; what a part declares for energies over a whole run is room for half a period.
        assert np.max(np.abs(solver.y - end) / problem.scale) < self.part.gains_energy

    def test_no_step_is_longer_than_allowed(self) -> None:
        problem, _, _ = self.problem()
        solver = self.part.solver(problem._replace(longest=problem.until / 50.0))
        while solver.status == "running":
            begin = solver.t
            solver.step()
            assert solver.t - begin <= problem.until / 50.0 * (1.0 + 1e-12)


class RodModelContract:
    """What every description of a rod must keep. ``complete``: it keeps all modes, so nothing is left out."""

    part: ClassVar[AbstractRodModel]
    complete: ClassVar[bool] = False
    frequency_error: ClassVar[float] = 2e-3  # of the first three modes: (k h)^2/24

    def rod(self, right: str = "free", velocity: float = 0.0) -> Rod:
        """Return a steel rod, its left end free."""
        return Rod("rod", (PIECE,), End("free"), End(right), velocity=velocity, model=self.part)  # type: ignore[arg-type]

    def built(self, right: str = "free", velocity: float = 0.0, gravity: float = 0.0) -> AbstractDiscreteModel:
        """Return the rod in coordinates, struck by a mass at its left end."""
        return self.part.build(self.rod(right, velocity), gravity, STRUCK)

    def test_it_says_what_it_is_and_where_it_comes_from(self) -> None:
        described(self.part)
        assert 0.0 < self.part.element_length(self.rod()) <= PIECE.length

    def test_a_model_that_does_not_step_says_so(self) -> None:
        if self.part.steps:
            assert self.built().operators().load.size > 0
            return
        remedy = ""
        try:
            self.built()
        except CaseError as error:
            remedy = error.remedy
        assert remedy, "a model that does not step refuses to be built, and says what to do"

    def test_mass_is_positive_and_stiffness_never_negative(self) -> None:
        for right in ("free", "clamped") if self.part.steps else ():
            system = self.built(right).operators()
            mass, stiffness = full(system.mass), full(system.stiffness)
            assert np.linalg.eigvalsh(mass)[0] > 0.0
            # Zero to rounding for the rigid motion of a free rod.
            assert np.linalg.eigvalsh(stiffness)[0] > -1e-12 * np.max(np.abs(stiffness))

    def test_a_free_rod_that_moves_as_a_whole(self) -> None:
        if not self.part.steps:
            return
        model = self.built(velocity=1.0)
        velocity = model.operators().velocity
        # Rounding of sums over a hundred coordinates.
        assert abs(float(model.momentum_row() @ velocity) - PIECE.mass) < 1e-11 * PIECE.mass
        for x in np.linspace(0.0, PIECE.length, 7):
            assert abs(float(model.row(float(x), "velocity") @ velocity) - 1.0) < 1e-11
            assert abs(float(model.row(float(x), "strain") @ velocity)) * PIECE.length < 1e-9

    def test_gravity_pushes_with_the_weight(self) -> None:
        if not self.part.steps:
            return
        model = self.built(gravity=9.81)
        system = model.operators()
        pushed = float(model.momentum_row() @ solve(system.mass, system.load))
        assert abs(pushed - 9.81 * PIECE.mass) < 1e-10 * PIECE.mass

    def test_pushed_slowly_it_carries_the_force_to_its_clamp(self) -> None:
        if not self.part.steps:
            return
        model = self.built("clamped")
        system = model.operators()
        still = solve(system.stiffness, model.row(0.0, "displacement"))
        # Exact in theory; the stiffness of a hundred elements has a condition number of 1e4.
        for x in np.linspace(0.05, 0.95, 7) * PIECE.length:
            stress = float(model.row(float(x), "stress") @ still) + model.left_out(float(x), "stress", 0.0)
            assert abs(stress * PIECE.area - 1.0) < 1e-8
            down = float(model.row(float(x), "displacement") @ still) + model.left_out(float(x), "displacement", 0.0)
            assert abs(down * PIECE.young * PIECE.area / (PIECE.length - x) - 1.0) < 1e-8

    def test_its_lowest_frequencies_are_those_of_the_rod(self) -> None:
        from scipy.linalg import eigh

        for right, shift in (("free", 0.0), ("clamped", 0.5)) if self.part.steps else ():
            system = self.built(right).operators()
            frequencies = np.sqrt(np.abs(eigh(full(system.stiffness), full(system.mass), eigvals_only=True)))
            elastic = frequencies[frequencies > 1e-4 * frequencies[-1]][:3]
            exact = self.part.exact_frequencies(self.rod(right), elastic.size)
            if exact is None:  # the classical bar
                exact = (np.arange(1, elastic.size + 1) - shift) * np.pi * PIECE.wave_speed / PIECE.length
            assert np.max(np.abs(elastic / exact - 1.0)) < self.frequency_error
            assert frequencies[-1] <= system.highest_frequency * (1.0 + 1e-9)

    def test_nothing_is_left_out_of_a_complete_model(self) -> None:
        for right in ("free", "clamped") if self.complete else ():
            model = self.built(right)
            for x in np.linspace(0.03, 0.97, 5) * PIECE.length:
                assert abs(model.left_out(float(x), "stress", 0.0)) * PIECE.area < 1e-8


class BasisContract:
    """What every basis must keep: on a rod of two segments struck by a mass at its left end, 40 elements, 12 modes."""

    part: ClassVar[AbstractBasis]
    modes: ClassVar[int] = 12

    def mesh(self, right: str) -> Mesh:
        """Return the mesh of a rod of two segments."""
        soft = Segment(length=0.2, area=6e-4, young=7e10, density=2700.0)
        return Mesh(Rod("rod", (PIECE, soft), End("free"), End(right)), 40, "consistent", 0.0)  # type: ignore[arg-type]

    def reduced(self, right: str, modes: int | None = None) -> ReducedMesh:
        """Return the mesh in the coordinates of the basis."""
        mesh = self.mesh(right)
        span = self.part.span(mesh, modes or self.modes, STRUCK)
        return ReducedMesh(mesh, span.shapes, span.uncoupled)

    def test_it_says_what_it_is_and_where_it_comes_from(self) -> None:
        described(self.part)

    def test_it_has_as_many_coordinates_as_modes_and_rigid_motion(self) -> None:
        for right, rigid in (("free", 1), ("clamped", 0)):
            span = self.part.span(self.mesh(right), self.modes, STRUCK)
            assert span.shapes.shape[1] == self.modes + rigid
            assert span.closed is None or span.closed[1].shape == span.shapes.shape

    def test_its_coordinates_have_unit_mass_and_squared_frequencies(self) -> None:
        for right in ("free", "clamped"):
            reduced = self.reduced(right)
            shapes, mesh = reduced.shapes, reduced.mesh
            # Rounding of sums over forty coordinates; of the stiffness, relative to its largest entry.
            assert np.max(np.abs(shapes.T @ full(mesh.mass) @ shapes - np.eye(shapes.shape[1]))) < 1e-11
            squared = reduced.frequencies**2
            assert np.max(np.abs(shapes.T @ full(mesh.stiffness) @ shapes - np.diag(squared))) < 1e-11 * squared[-1]
            assert np.all(np.diff(squared) >= 0.0)
            assert (squared[0] == 0.0) == (right == "free")

    def test_the_rigid_motion_of_a_free_rod_is_exact(self) -> None:
        reduced = self.reduced("free")
        velocity = reduced.project_uniform()  # coordinates of unit velocity: the momentum of each, its mass being 1
        assert np.max(np.abs(reduced.shapes @ velocity - 1.0)) < 1e-11
        assert abs(velocity @ velocity / reduced.mesh.momentum_row().sum() - 1.0) < 1e-12
        assert np.max(np.abs(velocity[1:])) < 1e-11 * velocity[0]

    def test_its_frequencies_are_bounds_from_above_and_fall_with_more_modes(self) -> None:
        from scipy.linalg import eigh

        for right in ("free", "clamped"):
            mesh = self.mesh(right)
            exact = np.sqrt(np.abs(eigh(full(mesh.stiffness), full(mesh.mass), eigvals_only=True)))
            fewer, more = self.reduced(right).frequencies, self.reduced(right, 2 * self.modes).frequencies
            # Rayleigh and Ritz: no frequency of a smaller space lies below its own in a larger one. Rounding: the
            # eigenvalues of the whole mesh are good to the rounding of their largest.
            slack = 1e-13 * exact[-1] ** 2
            assert np.all(fewer**2 >= exact[: fewer.size] ** 2 - slack)
            assert np.all(more**2 >= exact[: more.size] ** 2 - slack)
            first = slice(int(right == "free"), 4)
            worst = [np.max(np.abs(found[first] / exact[first] - 1.0)) for found in (fewer, more)]
            assert worst[1] <= worst[0] + 1e-9
            assert worst[1] < 1e-3  # twenty-four modes, the first four frequencies

    def test_what_is_kept_and_what_is_left_out_are_the_static_answer(self) -> None:
        for right in ("free", "clamped"):
            reduced = self.reduced(right)
            rod = Rod("rod", (PIECE,), End("free"), End(right))
            body = ModalBody(rod, 0.0, reduced, paper_rule=False)
            elastic = reduced.frequencies > 0.0
            largest = abs(reduced.static(0.0, "displacement", 0.0))
            for x in np.linspace(0.0, 0.99, 6) * PIECE.length:
                kept = np.sum(
                    (reduced.row(float(x), "displacement") * reduced.row(0.0, "displacement"))[elastic]
                    / reduced.frequencies[elastic] ** 2
                )
                left = body.left_out(float(x), "displacement", 0.0)
                assert abs(kept + left - reduced.static(float(x), "displacement", 0.0)) < 1e-12 * largest
                if type(self.part).static_exact and right == "clamped":
                    # The condition of forty elements, 1e3, times the rounding of a small eigenvalue problem.
                    assert abs(left) < 1e-9 * largest

    def test_all_modes_are_the_whole_mesh(self) -> None:
        if not type(self.part).complete:
            return
        from scipy.linalg import eigh

        mesh = self.mesh("clamped")
        squared = eigh(full(mesh.stiffness), full(mesh.mass), eigvals_only=True)
        found = self.reduced("clamped", squared.size).frequencies ** 2
        assert np.max(np.abs(found - squared)) < 1e-10 * squared[-1]


SUITES: dict[plugins.Group, type[Any]] = {
    plugins.LAWS: ContactLawContract,
    plugins.INTEGRATORS: IntegratorContract,
    plugins.MODELS: RodModelContract,
    plugins.BASES: BasisContract,
}
"""The suite of each kind of part."""


def suite_of(group: plugins.Group, kind: type[Any]) -> type[Any]:
    """Return the suite of a part: that of its group; an integrator that adapts its steps has its own."""
    return AdaptiveContract if issubclass(kind, AbstractAdaptive) else SUITES[group]
