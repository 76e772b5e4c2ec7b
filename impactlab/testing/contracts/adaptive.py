"""Contract suite of adaptive integrators."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from impactlab.integrators.base import AbstractAdaptive, Problem
from impactlab.models.finite_element import FiniteElement
from impactlab.numerics.banded import full
from impactlab.scene.bodies import End, Rod
from impactlab.testing.contracts.common import PIECE, at_most, described
from impactlab.types import Array


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
