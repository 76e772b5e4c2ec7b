"""The methods that the page compares.

Each is a law, a scheme and a model, with its step.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import impactlab as il
from impactlab import simulate
from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.augmented_lagrangian import AugmentedLagrangian
from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.energy_conserving import EnergyConserving
from impactlab.contact.impedance_residual import ImpedanceResidual
from impactlab.contact.nitsche import Nitsche
from impactlab.contact.paoli_schatzman import PaoliSchatzman
from impactlab.contact.penalty import Penalty
from impactlab.contact.velocity_complementarity import VelocityComplementarity
from impactlab.contact.wave_identification import WaveIdentification
from impactlab.contact.wave_initialised import WaveInitialised
from impactlab.errors import ImpactlabError, StepError
from impactlab.history import AbstractHistory
from impactlab.integrators.base import AbstractIntegrator
from impactlab.integrators.bathe import Bathe
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.contact_stabilised_newmark import ContactStabilisedNewmark
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.generalised_alpha import GeneralisedAlpha
from impactlab.integrators.hht_alpha import HhtAlpha
from impactlab.integrators.midpoint import Midpoint
from impactlab.integrators.moreau_jean import MoreauJean
from impactlab.integrators.newmark import Newmark
from impactlab.integrators.nonsmooth_generalised_alpha import NonsmoothGeneralisedAlpha
from impactlab.models.base import AbstractRodModel
from impactlab.models.continuous import Continuous
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.scene.method import Simulation, StepRule
from studies.pages import CASES

TEN_POINTS = StepRule(points_per_period=10.0)


class Scheme(NamedTuple):
    """A method: how it is called in the tables, and its parts."""

    group: str
    name: str
    law: AbstractContactLaw
    integrator: AbstractIntegrator | None
    model: Callable[[int], AbstractRodModel]  # of the number of elements, or of coordinates
    step: StepRule

    @property
    def rule(self) -> str:
        """The step as the tables give it: c dt/h, or points in the shortest period."""
        if self.integrator is None:
            return "none"
        return f"{self.step.courant:g}" if self.step.courant else f"{self.step.points_per_period:g} points"


class Run(NamedTuple):
    """Outcome of a run: its history, and why the package stopped or refused it."""

    history: AbstractHistory | None
    reason: str


def consistent(n: int) -> AbstractRodModel:
    return FiniteElement(n)


def lumped(n: int) -> AbstractRodModel:
    return FiniteElement(n, "lumped")


def redistributed(n: int) -> AbstractRodModel:
    return FiniteElement(n, "redistributed")


def spectral(n: int) -> AbstractRodModel:
    return FiniteElement(max(1, n // 4), "lumped", 4)


def implicit(group: str, name: str, law: AbstractContactLaw, integrator: AbstractIntegrator) -> Scheme:
    """Return a method on a consistent mass mesh at c dt = h.

    It is stepped as the literature does.
    """
    return Scheme(group, name, law, integrator, consistent, StepRule(courant=1.0))


def explicit(group: str, name: str, law: AbstractContactLaw, courant: float) -> Scheme:
    return Scheme(group, f"{name}, central_difference", law, CentralDifference(), lumped, StepRule(courant=courant))


HARD, SOFT, RATE, MASS, WAVE = "constraint", "penalty", "velocity", "mass", "waves"
TRAP = implicit(
    HARD,
    "paoli_schatzman e = 0, generalised_alpha rho_inf = 1 (textbook Newmark)",
    PaoliSchatzman(),
    GeneralisedAlpha(1.0),
)
TRAP_MIDDLE = implicit(HARD, "addition_deletion, newmark", AdditionDeletion(), Newmark())
MOREAU = implicit(RATE, "velocity_complementarity, moreau_jean 1/2", VelocityComplementarity(), MoreauJean())
MASSLESS = Scheme(
    MASS,
    "addition_deletion on redistributed mass, midpoint",
    AdditionDeletion(),
    Midpoint(),
    redistributed,
    StepRule(courant=1.0),
)
BATHE = implicit(SOFT, "penalty, bathe", Penalty(), Bathe())
CONSERVING = implicit(HARD, "energy_conserving, midpoint", EnergyConserving(), Midpoint())
STABILISED = implicit(
    HARD, "addition_deletion, contact_stabilised_newmark", AdditionDeletion(), ContactStabilisedNewmark()
)
EXPLICIT = explicit(HARD, "addition_deletion", AdditionDeletion(), 0.9)
SPRING = implicit(SOFT, "penalty, midpoint", Penalty(), Midpoint())
PROJECTED = implicit(
    RATE,
    "velocity_complementarity with projection, moreau_jean 1/2",
    VelocityComplementarity(projection=True),
    MoreauJean(),
)
WAVES = Scheme(
    WAVE,
    "wave_identification, newmark, n of 2n modes",
    WaveIdentification(),
    Newmark(),
    lambda n: Modal(2 * n, n),
    TEN_POINTS,
)
RESIDUAL = Scheme(
    WAVE,
    "impedance_residual, exact_modal, n analytic modes",
    ImpedanceResidual(),
    ExactModal(),
    lambda n: Modal(None, n),
    TEN_POINTS,
)
EXACT = Scheme(WAVE, "continuous", AdditionDeletion(), None, lambda _: Continuous(), TEN_POINTS)

SCHEMES: tuple[Scheme, ...] = (
    TRAP,
    TRAP_MIDDLE,
    implicit(HARD, "paoli_schatzman e = 0, newmark", PaoliSchatzman(), Newmark()),
    implicit(HARD, "augmented_lagrangian, midpoint", AugmentedLagrangian(), Midpoint()),
    CONSERVING,
    STABILISED,
    implicit(HARD, "addition_deletion, moreau_jean 1/2", AdditionDeletion(), MoreauJean()),
    implicit(HARD, "augmented_lagrangian, moreau_jean 1/2", AugmentedLagrangian(), MoreauJean()),
    explicit(HARD, "addition_deletion", AdditionDeletion(), 1.0),
    EXPLICIT,
    explicit(HARD, "paoli_schatzman e = 0", PaoliSchatzman(), 0.9),
    explicit(HARD, "paoli_schatzman e = 1", PaoliSchatzman(1.0), 0.9),
    explicit(HARD, "wave_initialised", WaveInitialised(), 0.9),
    Scheme(
        HARD,
        "addition_deletion, central_difference, elements of order 4",
        AdditionDeletion(),
        CentralDifference(),
        spectral,
        StepRule(courant=0.8),
    ),
    SPRING,
    implicit(SOFT, "penalty, hht_alpha", Penalty(), HhtAlpha()),
    Scheme(SOFT, "penalty, generalised_alpha", Penalty(), GeneralisedAlpha(), consistent, StepRule(courant=0.5)),
    BATHE,
    explicit(SOFT, "penalty", Penalty(), 0.5),
    implicit("Nitsche", "nitsche theta = 1, midpoint", Nitsche("1"), Midpoint()),
    implicit("Nitsche", "nitsche theta = 0, midpoint", Nitsche("0"), Midpoint()),
    implicit("Nitsche", "nitsche theta = -1, midpoint", Nitsche("-1"), Midpoint()),
    MOREAU,
    PROJECTED,
    implicit(RATE, "velocity_complementarity, moreau_jean 1", VelocityComplementarity(), MoreauJean(1.0)),
    implicit(
        RATE,
        "velocity_complementarity, nonsmooth_generalised_alpha",
        VelocityComplementarity(),
        NonsmoothGeneralisedAlpha(),
    ),
    MASSLESS,
    Scheme(
        WAVE,
        "wave_identification, newmark, n of n modes",
        WaveIdentification(),
        Newmark(),
        lambda n: Modal(n, n),
        TEN_POINTS,
    ),
    WAVES,
    RESIDUAL,
    EXACT,
)


def scene_of(
    case: str, scheme: Scheme, n: int, duration: float | None = None, courant: float | None = None
) -> Simulation:
    """Return a case under a method.

    Its only rod gets the model, its only contact the law.
    """
    base = il.load_case(CASES / f"{case}.yaml").simulation()
    return base.but(
        model=scheme.model(n),
        law=scheme.law,
        integrator=scheme.integrator,
        step=scheme.step if courant is None else StepRule(courant=courant),
        duration=base.scene.duration if duration is None else duration,
        probes=base.scene.probes[:1],
    )


def ran(scene: Simulation) -> Run:
    """Return the run of a scene; one that was stopped keeps its results so far."""
    try:
        return Run(simulate.run(*scene), "")
    except StepError as error:
        return Run(error.history, error.text)
    except ImpactlabError as error:
        return Run(None, error.text)


def stopped(reasons: list[tuple[str, str]]) -> str:
    """Return the list of runs that were stopped or refused.

    It stands so below a table.
    """
    if not reasons:
        return ""
    lines = [f"- {name}: {reason}" for name, reason in dict(reasons).items()]
    text = "Marked `*`: the package ends these runs with an error; the row shows what was reached."
    return f"\n\n{text}\n\n" + "\n".join(lines)
