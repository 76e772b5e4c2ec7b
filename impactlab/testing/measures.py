"""Figures that a check of a part measures: orders, energies, stable steps, times."""

from __future__ import annotations

import dataclasses
import math
import time as clock
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import eigh

from impactlab import simulate
from impactlab.bases.base import AbstractBasis
from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.base import AbstractContactLaw
from impactlab.errors import CaseError, ImpactlabError, PairingError, StepError
from impactlab.history.base import AbstractHistory
from impactlab.integrators.base import AbstractAdaptive, AbstractIntegrator, AbstractScheme
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.newmark import Newmark
from impactlab.mechanisms.base import AbstractMechanism
from impactlab.models.base import AbstractDiscreteModel, AbstractRodModel, Face, Operators
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.numerics.banded import full
from impactlab.plugins import BASES, INTEGRATORS, LAWS, MECHANISMS, MODELS, Group, kind_of
from impactlab.scene.bodies import End, Rod
from impactlab.scene.method import Simulation, StepRule
from impactlab.simulate.planning.pairing import energy_bound
from impactlab.testing.contracts import PIECE, AdaptiveContract, IntegratorContract, MechanismContract
from impactlab.testing.scenes import mass_on_rod, simulation
from impactlab.testing.trace import run_in_cuts, run_sampled

ROUNDING = 1e-11  # of the energy, in a thousand steps of some coordinates
REPEATS = 3  # of a timed run, the least of which counts


class Measured(NamedTuple):
    """One figure of a part; ``remark`` gives its case, or why it has no value."""

    name: str
    value: float | None
    unit: str = "1"
    declared: float | None = None
    ok: bool = True
    remark: str = ""


def measured(name: str, unit: str, take: Callable[[], Measured]) -> Measured:
    """Return a measured figure, or the reason why it could not be measured."""
    try:
        with np.errstate(all="ignore"):  # steps beyond the limit are meant to diverge
            return take()._replace(name=name, unit=unit)
    except (PairingError, CaseError) as error:
        return Measured(name, None, unit, remark=f"not in this case: {error.text}"[:200])
    except Exception as error:  # noqa: BLE001 - a part that raises
        return Measured(name, None, unit, ok=False, remark=f"{type(error).__name__}: {str(error)[:200]}")


CLAMPED = Rod("rod", (PIECE,), End("free"), End("clamped"))


def struck(
    model: AbstractRodModel,
    law: AbstractContactLaw,
    integrator: AbstractIntegrator | None,
    points: float = 10.0,
    trips: float = 3.0,
    weight: float = 1.0,
) -> Simulation:
    """Return the paper's impact under a mass of ``weight`` rods at 1 m/s."""
    rule = StepRule(points_per_period=points)
    return mass_on_rod(model, law, integrator, rule, mass_ratio=weight, round_trips=trips)


def walked(simulation: Simulation) -> AbstractHistory:
    """Return the history of a run, even if its energy grows beyond the bound."""
    return run_in_cuts(simulation, lambda step: step + 100_000)


def least_ms(action: Callable[[], object]) -> float:
    """Return the least time [ms] of an action over a few calls after the first."""
    times = []
    for _ in range(1 + REPEATS):
        began = clock.perf_counter()
        action()
        times.append(clock.perf_counter() - began)
    return 1e3 * min(times[1:])


def step_time(simulation: Simulation) -> tuple[float, int]:
    """Return the cost [s] of a step, and the number of steps measured.

    From runs of one and of three durations, each the fastest of a few: costs paid once per run cancel.
    """
    found = []
    for factor in (1.0, 3.0):
        times, steps = [], 0
        for _ in range(REPEATS):
            history = simulate.run(*simulation.but(duration=factor * simulation.scene.duration))
            times.append(history.cost.solve_s)
            steps = history.cost.steps
        found.append((min(times), steps))
    (short, few), (long, many) = found
    return max(0.0, long - short) / max(1, many - few), many


def of_adaptive(part: AbstractAdaptive) -> Iterator[Measured]:
    """Yield the figures of an integrator that chooses its own steps."""
    suite = type("Suite", (AdaptiveContract,), {"part": part})()

    def walked() -> tuple[float, int, float]:
        """Return the error at the end, the steps, and the time of one [s]."""
        problem, end, _ = suite.problem()
        began, solver, steps = clock.perf_counter(), part.solver(problem), 0
        while solver.status == "running" and steps < part.most_steps:
            solver.step()
            steps += 1
        spent = clock.perf_counter() - began
        return float(np.max(np.abs(solver.y - end) / problem.scale)), steps, spent / steps

    def error() -> Measured:
        found, steps, _ = walked()
        return Measured("", found, remark=f"half a period of a free rod in {steps} steps")

    yield measured("error of a free motion", "1", error)
    yield measured("cost per step", "us", lambda: Measured("", 1e6 * min(walked()[2] for _ in range(REPEATS))))


def of_integrator(part: AbstractScheme) -> Iterator[Measured]:
    """Yield the figures of an integrator."""
    if isinstance(part, AbstractAdaptive):
        yield from of_adaptive(part)
    elif isinstance(part, AbstractIntegrator):
        yield from of_stepping(part)


def of_stepping(part: AbstractIntegrator) -> Iterator[Measured]:
    """Yield the figures of an integrator that takes steps of one length."""
    suite = type("Suite", (IntegratorContract,), {"part": part})()

    def order() -> Measured:
        value = suite.measured_order()[0]
        return Measured("", value, declared=float(part.order), ok=abs(value - part.order) < 0.1)

    def drift() -> Measured:
        system, random = suite.system(), np.random.default_rng(6)
        frequencies, shapes = suite.modes()
        moving = system._replace(displacement=shapes @ random.normal(size=system.load.size))
        stepper = part.prepare(moving, np.zeros((0, system.load.size)), 0.5 / frequencies[-1])
        state, out = stepper.state.copy(), np.zeros(4)
        stepper.measure(stepper.parameters, state, out)
        before = float(out[0])
        for _ in range(1000):
            stepper.free(stepper.parameters, state)
        stepper.measure(stepper.parameters, state, out)
        value = float(out[0]) / before - 1.0
        return Measured("", value, ok=value < ROUNDING, remark="all modes, dt = 0.5/w_max")

    def stable() -> Measured:
        limit, highest = part.limit(suite.system()), float(suite.modes()[0][-1])
        if math.isinf(limit):
            held = suite.growth(100.0 / highest) < 1e3
            return Measured("", None, ok=held, remark=f"no limit declared; {'' if held else 'not '}stable at 100/w_max")
        low, high = 0.5, 2.0
        for _ in range(12):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if suite.growth(middle * limit) < 1e3 else (low, middle)
        # Just beyond the limit a mode needs more than 500 steps to grow a thousandfold.
        return Measured("", low * limit * highest, declared=limit * highest, ok=0.98 < low < 1.02)

    def cost() -> Measured:
        model = Modal(None, 200) if part.needs_modes else FiniteElement(400, "lumped")
        rod = dataclasses.replace(CLAMPED, displacement=lambda x: 1e-6 * np.cos(0.5 * np.pi * x / PIECE.length))
        spent, steps = step_time(simulation("free", {"rod": rod}, (), 4.0 * rod.round_trip, part, model=model))
        n_dof = model.build(rod, 0.0).operators().load.size
        return Measured("", 1e9 * spent / n_dof, remark=f"{n_dof} coordinates, {steps} steps")

    yield measured("order on a smooth problem", "1", order)
    yield measured("energy change in 1000 free steps", "1", drift)
    yield measured("largest stable w_max dt", "1", stable)
    yield measured("cost per step and coordinate", "ns", cost)


def partners(law: AbstractContactLaw) -> tuple[AbstractIntegrator, AbstractRodModel]:
    """Return the first integrator and model that support the law, or raise the last refusal."""
    refusal: ImpactlabError | None = None
    for integrator in (Newmark(), CentralDifference(), ExactModal()):
        for model in (Modal(None, 40), FiniteElement(40, "lumped")):
            try:
                simulate.prepare(*struck(model, law, integrator))
            except (PairingError, CaseError) as error:
                refusal = refusal or error
            else:
                return integrator, model
    assert refusal is not None
    raise refusal


def of_law(part: AbstractContactLaw) -> Iterator[Measured]:
    """Yield the figures of a contact law."""

    def energy(gained: bool) -> Measured:
        integrator, model = partners(part)
        impact = struck(model, part, integrator)
        book, bound = run_sampled(impact).energy, energy_bound(*impact, integrator)
        remark = f"mass on a clamped rod, alpha 1, {kind_of(model)}, {kind_of(integrator)}"
        if not gained:
            return Measured("", book.largest_loss, remark=remark + "; beyond the booked losses")
        ok = book.largest_gain <= bound
        remark += "" if ok else "; the bound is `gains_energy` of the class"
        return Measured("", book.largest_gain, declared=bound, ok=ok, remark=remark)

    def order() -> Measured:
        integrator, _ = partners(part)
        model = FiniteElement(12, "lumped") if integrator.needs_diagonal_mass else Modal(None, 12)
        fine = walked(struck(model, part, integrator, 640.0, 0.9))
        times = np.linspace(0.0, 0.99 * fine.duration, 400)
        exact, errors = fine.evaluate(times, "position:hammer"), []
        for points in (20.0, 40.0, 80.0):
            history = walked(struck(model, part, integrator, points, 0.9))
            errors.append(float(np.max(np.abs(history.evaluate(times, "position:hammer") - exact))))
        value = math.log2(errors[0] / errors[2]) / 2.0 if errors[2] > 0.0 else math.inf
        return Measured("", value, remark="place of the mass, 12 modes, 20 to 80 points per period, against 640")

    def cost() -> Measured:
        integrator, _ = partners(part)
        model = FiniteElement(10, "lumped") if integrator.needs_diagonal_mass else Modal(None, 10)
        impact = struck(model, part, integrator, 20.0, 30.0, weight=1e4)  # stays in contact
        try:
            with_law, steps = step_time(impact)
        except StepError as error:
            return Measured("", None, remark=f"the timed run ended: {error.text}"[:200])
        without, _ = step_time(impact.but(contacts=()))
        return Measured("", 1e9 * (with_law - without), remark=f"{steps} steps, over the same without contact")

    yield measured("largest gain of energy", "1", lambda: energy(True))
    yield measured("largest loss of energy", "1", lambda: energy(False))
    yield measured("order on an impact", "1", order)
    yield measured("cost per step", "ns", cost)


def of_model(part: AbstractRodModel) -> Iterator[Measured]:
    """Yield the figures of a rod model."""

    def lowest(model: AbstractRodModel) -> float:
        system = model.build(CLAMPED, 0.0).operators()
        found = float(np.sqrt(eigh(full(system.stiffness), full(system.mass), eigvals_only=True)[0]))
        own = model.exact_frequencies(CLAMPED, 1)
        exact = 0.5 * math.pi * PIECE.wave_speed / PIECE.length if own is None else float(own[0])
        return found / exact - 1.0

    def order() -> Measured:
        fields = {field.name for field in dataclasses.fields(part)}  # type: ignore[arg-type] # parts are dataclasses
        if "elements" not in fields or not part.has_mesh:
            return Measured("", None, remark="no mesh to refine: a mesh has an option `elements`")
        changes: dict[str, Any] = {"modes": None} if "modes" in fields else {}
        errors = [lowest(dataclasses.replace(part, elements=n, **changes)) for n in (10, 20, 40)]  # type: ignore[type-var]
        return Measured("", math.log2(abs(errors[1] / errors[2])), remark="10, 20, 40 elements, clamped rod")

    def setup() -> Measured:
        return Measured("", least_ms(lambda: part.build(CLAMPED, 0.0).operators()))

    def cost() -> Measured:
        spent, steps = step_time(struck(part, AdditionDeletion(), Newmark()).but(contacts=(), duration=1e-3))
        n_dof = part.build(CLAMPED, 0.0).operators().load.size
        return Measured("", 1e9 * spent / n_dof, remark=f"newmark, {n_dof} coordinates, {steps} steps")

    def exact() -> Measured:
        spent = least_ms(lambda: simulate.run(*struck(part, AdditionDeletion(), None)))
        return Measured("", spent, remark="the paper's impact, from event to event")

    if part.exact:
        yield measured("time of a run without steps", "ms", exact)
        return
    yield measured("error of the lowest frequency", "1", lambda: Measured("", lowest(part)))
    yield measured("order of the lowest frequency", "1", order)
    yield measured("time to build", "ms", setup)
    yield measured("cost per step and coordinate", "ns", cost)


def of_basis(part: AbstractBasis) -> Iterator[Measured]:
    """Yield the figures of a basis on a clamped rod.

    The rod has 100 elements and is struck by its own mass.
    """
    faces = (Face(0.0, 0, PIECE.mass),)

    def system(modes: int) -> tuple[AbstractDiscreteModel, Operators]:
        model = Modal(100, modes, basis=part).build(CLAMPED, 0.0, faces)
        return model, model.operators()

    def frequency() -> Measured:
        found = np.sqrt(system(12)[1].stiffness[0, 3])
        full_mesh = np.sqrt(Modal(100).build(CLAMPED, 0.0).operators().stiffness[0, 3])
        return Measured("", float(found / full_mesh - 1.0), remark="12 modes, against the whole mesh")

    def left_out() -> Measured:
        model, operators = system(12)
        row = model.row(0.0, "displacement")
        kept = float(np.sum(row**2 / operators.stiffness[0]))
        share = model.left_out(0.0, "displacement", 0.0)
        return Measured("", share / (kept + share), remark="12 modes, steady force at the contact")

    def setup() -> Measured:
        return Measured("", least_ms(lambda: system(12)), remark="100 elements, 12 modes")

    yield measured("error of the fourth frequency", "1", frequency)
    yield measured("share of the static compliance left out", "1", left_out)
    yield measured("time to build", "ms", setup)


def of_mechanism(part: AbstractMechanism) -> Iterator[Measured]:
    """Yield the figures of a mechanism: energy of free motion, order of error."""
    suite = type("Suite", (MechanismContract,), {"part": part})()

    def energy() -> Measured:
        error, bound = suite.errors()[0], suite.bound()
        return Measured("", error, declared=bound, ok=error <= bound, remark=f"{suite.steps} steps")

    def order() -> Measured:
        coarse, fine = suite.errors()
        return Measured("", math.log2(coarse / fine), declared=2.0)

    yield measured("error of the energy in free motion", "1", energy)
    yield measured("order of that error", "1", order)


MEASURES: dict[Group, Callable[[Any], Iterator[Measured]]] = {
    LAWS: of_law,
    INTEGRATORS: of_integrator,
    MODELS: of_model,
    BASES: of_basis,
    MECHANISMS: of_mechanism,
}
"""The figures of each kind of part."""
