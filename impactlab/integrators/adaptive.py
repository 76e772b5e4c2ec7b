"""Adaptive integration of smooth contact by scipy's solvers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, final

from impactlab.integrators.base import AbstractAdaptive, Problem
from impactlab.types import option

# Declared energy gain over the tolerance. Measured: 330 over methods, mass ratios and three round trips
# (docs/bounds.md), 1500 elsewhere between steps, on interpolants.
GAIN_PER_TOLERANCE = 1e4


@final
@dataclass(frozen=True)
class Adaptive(AbstractAdaptive):
    """Adaptive integration (scipy): the step follows from an error estimate, and contact events are located.

    The force of a contact is that of its law at the gap and gap rate of the instant, so that any law whose force
    follows from these two is allowed, on bodies with constant matrices and on mechanisms. At each touch and opening the
    integration starts again. RK45 and DOP853 are explicit Runge-Kutta pairs of orders 5(4) and 8(5,3); Radau and BDF
    suit stiff scenes; LSODA switches between both. Without ``absolute_tolerance`` the relative one holds for it too.
    A step given by the case as dt or courant is the longest allowed; points_per_period has no meaning here.

    References
    ----------
    VirtanenEtAl2020 (the implementation); DormandPrince1980 (RK45); HairerNorsettWanner1993, II.5 and II.10 (DOP853);
    HairerWanner1996, IV.8 (Radau); ShampineReichelt1997 (BDF); Petzold1983 (LSODA).
    """

    examples = tuple({"method": method} for method in ("DOP853", "RK45", "Radau", "BDF", "LSODA"))
    citations = (
        "VirtanenEtAl2020",
        "DormandPrince1980",
        "HairerNorsettWanner1993",
        "HairerWanner1996",
        "ShampineReichelt1997",
        "Petzold1983",
    )

    method: Literal["RK45", "DOP853", "Radau", "BDF", "LSODA"] = option("DOP853", description="solver of scipy")
    relative_tolerance: float = option(
        1e-8, at_least=1e-13, at_most=1e-2, description="error of a step, over the value itself"
    )
    absolute_tolerance: float | None = option(
        None, above=0.0, at_most=1e-2, description="error of a step, over the speeds and travels of the scene"
    )
    most_steps: int = option(1_000_000, at_least=1, description="steps after which the run ends as failed")

    @property
    def gains_energy(self) -> float:
        return GAIN_PER_TOLERANCE * max(self.relative_tolerance, self.absolute_tolerance or 0.0)

    def load(self) -> None:
        self._kind()

    def solver(self, problem: Problem) -> Any:
        share = self.relative_tolerance if self.absolute_tolerance is None else self.absolute_tolerance
        implicit = {} if self.method in ("RK45", "DOP853") else {"jac": problem.jacobian}
        return self._kind()(
            problem.rates,
            problem.time,
            problem.state,
            problem.until,
            max_step=problem.longest,
            rtol=self.relative_tolerance,
            atol=share * problem.scale,
            **implicit,
        )

    def _kind(self) -> Any:
        """Return scipy's class of the solver."""
        from scipy import integrate

        return getattr(integrate, self.method)
