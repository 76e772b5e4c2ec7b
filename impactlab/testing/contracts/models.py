"""Contract suite of rod and beam models."""

from __future__ import annotations

import dataclasses
from typing import ClassVar

import numpy as np

from impactlab.bases.beams.modes import BeamModes
from impactlab.errors import CaseError, PairingError
from impactlab.models.base import AbstractDiscreteModel, AbstractRodModel, Face
from impactlab.models.continuous.base import AbstractSelfStepping
from impactlab.numerics.banded import full, grounded, solve
from impactlab.scene.bodies import Beam, End, Rod, Rotation
from impactlab.testing.contracts.common import BAR, PIECE, STRUCK, at_most, described
from impactlab.types import Array

HIGHEST = "the highest frequency [rad/s], by its bound,"


def is_full(matrix: Array) -> bool:
    """Return whether a matrix is full: square and symmetric, as bands are not.

    It is False for a small one.
    """
    return matrix.shape[0] == matrix.shape[1] > 2 and bool(np.array_equal(matrix, matrix.T)) and bool(matrix.any())


class RodModelContract:
    """Properties of every model of a rod.

    ``complete``: it keeps all modes, so nothing is left out.
    """

    part: ClassVar[AbstractRodModel]
    complete: ClassVar[bool] = False
    frequency_error: ClassVar[float] = 2e-3  # of the first three modes: (k h)^2/24

    def rod(self, right: str = "free", velocity: float = 0.0) -> Rod:
        """Return a steel rod, its left end free."""
        return Rod("rod", (PIECE,), End("free"), End(right), velocity=velocity)  # type: ignore[arg-type]

    def built(self, right: str = "free", velocity: float = 0.0, gravity: float = 0.0) -> AbstractDiscreteModel:
        """Return the rod in coordinates, struck by a mass at its left end."""
        made = self.part.build(self.rod(right, velocity), gravity, STRUCK)
        assert isinstance(made, AbstractDiscreteModel), f"`build` returned {made}, and no AbstractDiscreteModel"
        return made

    def in_coordinates(
        self, right: str = "free", velocity: float = 0.0, gravity: float = 0.0
    ) -> AbstractDiscreteModel | None:
        """Return the rod as `built` does; None where it steps by itself."""
        if isinstance(self.built(), AbstractSelfStepping):
            return None
        return self.built(right, velocity, gravity)

    def test_it_has_a_description_and_a_source(self) -> None:
        described(self.part)
        assert 0.0 < self.part.element_length(self.rod()) <= PIECE.length

    def test_if_it_steps_by_itself_it_takes_the_momentum_and_the_work_of_a_push(self) -> None:
        model = self.built()
        if isinstance(model, AbstractSelfStepping):
            takes_a_push(model, 0.0)
        else:
            assert model.operators().load.size > 0

    def test_of_segments_it_takes_those_of_a_push_inside_or_refuses_them(self) -> None:
        """A model without segments or inner contacts refuses them with a remedy."""
        segments = PIECE, dataclasses.replace(PIECE, length=0.2, area=1.5 * PIECE.area)
        body, x = Rod("rod", segments, End("free"), End("free")), 0.1
        remedy = ""
        try:
            model = self.part.build(body, 0.0, (Face(x, 0, PIECE.mass),))
        except (PairingError, CaseError) as error:
            model, remedy = None, error.remedy
        assert model is not None or remedy, "a model without segments refuses with a remedy"
        if isinstance(model, AbstractSelfStepping):
            takes_a_push(model, x)

    def test_its_matrices_are_bands_and_its_rows_fit_them(self) -> None:
        model = self.in_coordinates()
        if model is None:
            return
        system = model.operators()
        n_dof = system.load.size
        for name in ("mass", "damping", "stiffness"):
            matrix = np.asarray(getattr(system, name))
            bands = matrix.ndim == 2 and matrix.shape[1] == n_dof and not is_full(matrix)
            text = f"{name} has the shape {matrix.shape}, and must be lower bands (bandwidth + 1, {n_dof}): row i of it"
            assert bands, f"{text} holds diagonal -i"
            assert np.all(np.isfinite(matrix)), f"{name} has values that are not finite"
        for name in ("load", "displacement", "velocity"):
            assert np.shape(getattr(system, name)) == (n_dof,), f"{name} must have the shape ({n_dof},), as load"
        for row in (model.row(0.0, "displacement"), model.row(0.5 * PIECE.length, "strain"), model.momentum_row()):
            assert row.shape == (n_dof,), f"a row has the shape {row.shape}, and must have ({n_dof},), as load"

    def test_mass_is_positive_and_stiffness_never_negative(self) -> None:
        for right in ("free", "clamped"):
            model = self.in_coordinates(right)
            if model is None:
                return
            system = model.operators()
            mass, stiffness = full(system.mass), full(system.stiffness)
            assert np.linalg.eigvalsh(mass)[0] > 0.0
            # Zero to rounding for the rigid motion of a free rod.
            lowest = float(np.linalg.eigvalsh(stiffness)[0])
            at_most(-lowest, 1e-12 * float(np.max(np.abs(stiffness))), "minus the least eigenvalue of the stiffness")

    def test_a_free_rod_moves_as_a_whole(self) -> None:
        model = self.in_coordinates(velocity=1.0)
        if model is None:
            return
        velocity = model.operators().velocity
        # Rounding of sums over a hundred coordinates.
        error = abs(float(model.momentum_row() @ velocity) - PIECE.mass)
        at_most(error, 1e-11 * PIECE.mass, "the error of the momentum at 1 m/s [kg m/s]")
        for x in np.linspace(0.0, PIECE.length, 7):
            error = abs(float(model.row(float(x), "velocity") @ velocity) - 1.0)
            at_most(error, 1e-11, f"the error of the velocity 1 m/s at x = {x:.4g} m")
            strained = abs(float(model.row(float(x), "strain") @ velocity))
            at_most(strained * PIECE.length, 1e-9, f"the strain rate at x = {x:.4g} m, times the length [m/s]")

    def test_gravity_pushes_with_the_weight(self) -> None:
        model = self.in_coordinates(gravity=9.81)
        if model is None:
            return
        system = model.operators()
        pushed = float(model.momentum_row() @ solve(system.mass, system.load))
        at_most(abs(pushed - 9.81 * PIECE.mass), 1e-10 * PIECE.mass, "the error of the weight [N]")

    def test_a_force_on_its_end_is_a_load_there(self) -> None:
        """A model that cannot hold it on a struck face refuses it with a remedy."""
        bare, rod = self.in_coordinates("clamped"), self.rod("clamped")
        if bare is None:
            return
        remedy = ""
        try:
            model = self.part.build(dataclasses.replace(rod, left=End("free", force=2.5)), 0.0, STRUCK)
        except (PairingError, CaseError) as error:
            model, remedy = None, error.remedy
        assert model is not None or remedy, "a model without such loads refuses with a remedy"
        if model is None:
            return
        wanted = 2.5 * bare.row(0.0, "displacement")
        off = float(np.max(np.abs(model.operators().load - wanted)))
        at_most(off, 1e-12 * float(np.max(np.abs(wanted))), "the error of the load [N]")

    def test_pushed_slowly_it_carries_the_force_to_its_clamp(self) -> None:
        model = self.in_coordinates("clamped")
        if model is None:
            return
        system = model.operators()
        still = solve(system.stiffness, model.row(0.0, "displacement"))
        # Exact in theory; the stiffness of a hundred elements has a condition number of 1e4.
        for x in np.linspace(0.05, 0.95, 7) * PIECE.length:
            stress = float(model.row(float(x), "stress") @ still) + model.left_out(float(x), "stress", 0.0)
            at_most(abs(stress * PIECE.area - 1.0), 1e-8, f"the error of the force 1 N inside, at x = {x:.4g} m")
            down = float(model.row(float(x), "displacement") @ still) + model.left_out(float(x), "displacement", 0.0)
            error = abs(down * PIECE.young * PIECE.area / (PIECE.length - x) - 1.0)
            at_most(error, 1e-8, f"the relative error of the displacement at x = {x:.4g} m")

    def test_its_lowest_frequencies_are_those_of_the_rod(self) -> None:
        from scipy.linalg import eigh

        for right, shift in (("free", 0.0), ("clamped", 0.5)):
            model = self.in_coordinates(right)
            if model is None:
                return
            system = model.operators()
            frequencies = np.sqrt(np.abs(eigh(full(system.stiffness), full(system.mass), eigvals_only=True)))
            elastic = frequencies[frequencies > 1e-4 * frequencies[-1]][:3]
            exact = self.part.exact_frequencies(self.rod(right), elastic.size)
            if exact is None:  # the classical bar
                exact = (np.arange(1, elastic.size + 1) - shift) * np.pi * PIECE.wave_speed / PIECE.length
            error = float(np.max(np.abs(elastic / exact - 1.0)))
            at_most(error, self.frequency_error, f"the relative error of the first frequencies, {right} at the right,")
            at_most(frequencies[-1], system.highest_frequency * (1.0 + 1e-9), HIGHEST)

    def test_it_is_the_same_for_any_partner_if_declared(self) -> None:
        """A run takes such bodies from the one before it, where only the mass of a striker differs."""
        if self.part.reads_partners or isinstance(self.built(), AbstractSelfStepping):
            return
        heavier = STRUCK[0]._replace(partner_mass=3.0 * PIECE.mass)
        one, other = (self.part.build(self.rod(), 0.0, (face,)) for face in (*STRUCK, heavier))
        text = "reads_partners is False, but with another mass that strikes the rod its {} differs"
        for name in ("mass", "damping", "stiffness", "velocity"):
            same = np.array_equal(getattr(one.operators(), name), getattr(other.operators(), name))
            assert same, text.format(name)
        rows = one.row(0.0, "displacement"), other.row(0.0, "displacement")
        assert np.array_equal(rows[0], rows[1]), text.format("row")

    def test_a_rod_that_turns_is_softened_if_declared(self) -> None:
        """Compare squared frequencies: rotation takes its rate squared from each (the motion is along the radius)."""
        from scipy.linalg import eigh

        if not self.part.serves_rotation:
            return
        still = self.built("clamped").operators()
        turned = dataclasses.replace(self.rod("clamped"), rotation=Rotation(0.1 * PIECE.wave_speed / PIECE.length))
        system = self.part.build(turned, 0.0, STRUCK).operators()
        one, other = (eigh(full(each.stiffness), full(each.mass), eigvals_only=True) for each in (still, system))
        error = float(np.max(np.abs(one[:3] - other[:3] - turned.softening)))
        # Static shapes of a basis change with the rotation, and the frequencies of a reduction with them by far less.
        text = (
            "serves_rotation: the error of the first squared frequencies, those at rest less the rate squared, [1/s2]"
        )
        at_most(error, 1e-3 * turned.softening, text)
        ground, stated = grounded(system.stiffness), system.springs_to_ground()
        at_most(
            float(np.max(np.abs(ground - stated))),
            1e-9 * float(np.max(np.abs(system.stiffness))),
            "serves_rotation: the error of `springs_to_ground` [N/m]",
        )

    def test_nothing_is_left_out_of_a_complete_model(self) -> None:
        for right in ("free", "clamped") if self.complete else ():
            model = self.built(right)
            for x in np.linspace(0.03, 0.97, 5) * PIECE.length:
                left_out = abs(model.left_out(float(x), "stress", 0.0)) * PIECE.area
                at_most(left_out, 1e-8, f"the force left out of 1 N at x = {x:.4g} m")

    def beam(self, left: str, right: str, gravity: float = 0.0, speed: float = 0.0) -> AbstractDiscreteModel | None:
        """Return a Timoshenko beam struck by a mass at its left end.

        It is None where the model steps it by itself. A model without beams refuses with a remedy. Options of a rod's
        mesh alone are refused like that too.
        """
        ends = End(left), End(right)  # type: ignore[arg-type]
        beam = Beam("beam", (BAR,), *ends, velocity=speed, theory="timoshenko")
        remedy = ""
        try:
            model = self.part.build_beam(beam, gravity, STRUCK)
        except (PairingError, CaseError) as error:
            model, remedy = None, error.remedy
        assert model is not None or remedy, "a model without beams refuses with a remedy"
        return None if isinstance(model, AbstractSelfStepping) else model

    def test_a_free_beam_moves_as_a_whole_or_beams_are_refused(self) -> None:
        model = self.beam("free", "free", gravity=9.81, speed=1.0)
        if model is None:
            return
        system = model.operators()
        assert np.linalg.eigvalsh(full(system.mass))[0] > 0.0
        # Rounding of sums over a hundred nodes; quantities that are derivatives divide by their distance.
        error = abs(float(model.momentum_row() @ system.velocity) - BAR.mass)
        at_most(error, 1e-10 * BAR.mass, "the error of the momentum at 1 m/s [kg m/s]")
        pushed = float(model.momentum_row() @ solve(system.mass, system.load))
        at_most(abs(pushed - 9.81 * BAR.mass), 1e-9 * BAR.mass, "the error of the weight [N]")
        for x in np.linspace(0.0, BAR.length, 7):
            error = abs(float(model.row(float(x), "velocity") @ system.velocity) - 1.0)
            at_most(error, 1e-9, f"the error of the velocity 1 m/s at x = {x:.4g} m")
            turned = abs(float(model.row(float(x), "rotation") @ system.velocity)) * BAR.length
            at_most(turned, 1e-7, f"the rate of rotation at x = {x:.4g} m, times the length [m/s]")

    def test_a_beam_pushed_slowly_bends_and_shears_or_beams_are_refused(self) -> None:
        model = self.beam("free", "clamped")
        if model is None:
            return
        still = solve(model.operators().stiffness, model.row(0.0, "displacement"))
        ei, kga, length = BAR.bending_stiffness, BAR.shear_stiffness, BAR.length
        for x in np.linspace(0.0, 0.9, 7) * length:
            down = float(model.row(float(x), "displacement") @ still) + model.left_out(float(x), "displacement", 0.0)
            exact = (2.0 * length**3 - 3.0 * length**2 * x + x**3) / (6.0 * ei) + (length - x) / kga
            # Exact, as no load acts between nodes; the stiffness of a hundred elements has a condition number of 1e7.
            at_most(abs(down / exact - 1.0), 1e-6, f"the relative error of the deflection at x = {x:.4g} m")
            moment = float(model.row(float(x), "bending_moment") @ still) + model.left_out(
                float(x), "bending_moment", 0
            )
            at_most(abs(moment - x), 1e-6 * length, f"the error of the bending moment at x = {x:.4g} m [N m]")
            shear = float(model.row(float(x), "shear_force") @ still) + model.left_out(float(x), "shear_force", 0.0)
            at_most(abs(abs(shear) - 1.0), 1e-6, f"the error of the shear force 1 N at x = {x:.4g} m")

    def test_its_lowest_frequencies_are_those_of_the_beam_or_beams_are_refused(self) -> None:
        from scipy.linalg import eigh

        for left, right in (("free", "free"), ("free", "clamped"), ("pinned", "pinned")):
            model = self.beam(left, right)
            if model is None:
                return
            system = model.operators()
            squared = np.abs(eigh(full(system.stiffness), full(system.mass), eigvals_only=True))
            exact = BeamModes(Beam("beam", (BAR,), End(left), End(right)), 3).frequencies  # type: ignore[arg-type]
            frequencies = np.sqrt(squared[: exact.size])
            # The error of linear deflections, (k h)^2/24, and the rounding of a hundred elements.
            limit, text = (
                10.0 * self.frequency_error * exact[-1],
                f"the error of a frequency [rad/s], {left} and {right},",
            )
            at_most(float(np.max(np.abs(frequencies - exact))), limit, text)
            at_most(float(np.sqrt(squared[-1])), system.highest_frequency * (1.0 + 1e-9), HIGHEST)


def takes_a_push(model: AbstractSelfStepping, x: float) -> None:
    """Push a body at x [m] and check its momentum and energy."""
    dt = float(model.fitting(0.02 * PIECE.length / PIECE.wave_speed)[0])
    row = model.row(x, "displacement")
    stepper = model.stepper(row[None, :], dt)
    state, before, after = stepper.state.copy(), np.zeros(3), np.zeros(3)
    stepper.measure(stepper.parameters, state, before)
    start = float(row @ state[: row.size])
    steps, force = 37, 3.0
    for _ in range(steps):
        stepper.free(stepper.parameters, state)
        state += force * stepper.force_response[0]
    stepper.measure(stepper.parameters, state, after)
    moved = float(row @ state[: row.size]) - start
    # Waves that have not met the far end, or have been reflected: sums of a few dozen terms.
    pushed, work = steps * dt * force, force * moved
    at_most(abs(after[2] - before[2] - pushed), 1e-12 * pushed, "the error of the momentum of a push [N s]")
    at_most(abs(after[0] - before[0] - work), 1e-12 * work, "the error of the energy of a push [J]")
