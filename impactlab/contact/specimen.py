"""Massless specimen between two bars: plastic flow with hardening and rate dependence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar, final

import numpy as np

from impactlab.contact import hysteresis
from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.branches import one_sided, yielding_both
from impactlab.errors import CaseError
from impactlab.types import Array, Branches, Level, SideFacts, Start, option

CURVE_POINTS = 200  # of a loading curve
MAX_POINTS = 20  # of a table of flow stresses


@dataclass(frozen=True)
class LinearFlow:
    """A yield stress and a straight line after it."""

    kind: ClassVar[str] = ""

    yield_stress: float = option(unit="Pa", above=0.0, description="stress at which the specimen yields first")
    hardening: float = option(0.0, unit="Pa", at_least=0.0, description="tangent modulus once it yields, below young")


@dataclass(frozen=True)
class TabulatedFlow:
    """Flow stress over plastic strain: straight lines between points, level after the last one."""

    kind: ClassVar[str] = ""

    strain: tuple[float, ...] = option(description="plastic strains, rising from 0")
    stress: tuple[float, ...] = option(unit="Pa", description="flow stresses at these, never falling")

    def __post_init__(self) -> None:
        strains, stresses = self.strain, self.stress
        if len(strains) != len(stresses) or not 2 <= len(strains) <= MAX_POINTS:
            given = f"the table has {len(strains)} strains and {len(stresses)} stresses"
            text = f"{given}. Allowed: 2 to {MAX_POINTS} of each"
            raise CaseError(text, remedy="Give one stress for each strain.", path="stress")
        if strains[0] != 0.0:
            text = f"the plastic strains begin at {strains[0]:g}. Allowed: 0, where the specimen yields"
            raise CaseError(text, remedy="Begin with the strain 0 and the yield stress.", path="strain")
        for number, (one, other) in enumerate(pairwise(strains), start=2):
            if one >= other:
                text = f"plastic strain {number} is {other:g}, after {one:g}. Allowed: rising strains"
                raise CaseError(text, remedy="Give them in order, each once.", path="strain")
        if stresses[0] <= 0.0:
            text = f"the flow stresses begin at {stresses[0]:g} Pa. Allowed: above 0"
            raise CaseError(text, remedy="Begin with the yield stress.", path="stress")
        for number, (one, other) in enumerate(pairwise(stresses), start=2):
            if one > other:
                text = (
                    f"flow stress {number} is {other:g} Pa, after {one:g} Pa. Allowed: stresses that never fall; a "
                    "specimen that softens has no unique solution"
                )
                raise CaseError(text, remedy="End the table at the largest stress.", path="stress")


@dataclass(frozen=True)
class JohnsonCook:
    """Flow stress (A + B ep^n)(1 + C ln(rate/reference_rate)), the last factor never below 1."""

    kind: ClassVar[str] = "johnson_cook"

    A: float = option(unit="Pa", above=0.0, description="yield stress at the reference rate")
    B: float = option(0.0, unit="Pa", at_least=0.0, description="factor of the hardening")
    n: float = option(1.0, above=0.0, at_most=1.0, description="exponent of the hardening")
    C: float = option(0.0, at_least=0.0, description="factor of the logarithm of the rate")
    reference_rate: float = option(1.0, unit="1/s", above=0.0, description="plastic strain rate of A and B")


@dataclass(frozen=True)
class CowperSymonds:
    """Factor 1 + (rate/D)^(1/q) on the flow stress."""

    kind: ClassVar[str] = "cowper_symonds"

    D: float = option(unit="1/s", above=0.0, description="plastic strain rate that doubles the flow stress")
    q: float = option(above=0.0, description="exponent")


@final
@dataclass(frozen=True)
class Specimen(AbstractContactLaw):
    """Massless specimen between two faces: force = area times stress, strain and section nominal.

    Elastic with ``young`` up to its flow stress, which may harden with the plastic strain and rise with its rate; a
    specimen that may pull hardens the same in both directions. It comes off a face that it would have to pull, unless
    ``tension`` is true.

    References
    ----------
    JohnsonCook1983; CowperSymonds1957; Kolsky1949 (the massless specimen between two bars).
    """

    needs = frozenset({Level.POSITION, Level.VELOCITY})
    citations = ("JohnsonCook1983", "CowperSymonds1957", "Kolsky1949")
    examples: ClassVar = (
        {"length": 5e-3, "area": 7.854e-5, "young": 7e10, "flow": LinearFlow(3e8, 5e8)},
        {
            "length": 5e-3, "area": 7.854e-5, "young": 7e10, "tension": True,
            "flow": TabulatedFlow((0.0, 0.01, 0.1), (2e8, 2.5e8, 4e8)), "rate": CowperSymonds(6500.0, 4.0),
        },
        {"length": 5e-3, "area": 7.854e-5, "young": 1.24e11, "flow": JohnsonCook(9e7, 2.92e8, 0.31, 0.025)},
    )  # fmt: skip
    acts_at_start = True
    two_sided = True
    exact_remedy = "Give a flow of yield_stress and hardening without a rate"

    length: float = option(unit="m", above=0.0, description="length of the specimen")
    area: float = option(unit="m2", above=0.0, description="cross section")
    young: float = option(unit="Pa", above=0.0, description="Young's modulus")
    flow: LinearFlow | TabulatedFlow | JohnsonCook = option(
        records=(LinearFlow, TabulatedFlow, JohnsonCook), description="flow stress"
    )
    rate: CowperSymonds | None = option(
        None, records=(CowperSymonds,), description="dependence on the rate of plastic strain, not with johnson_cook"
    )
    tension: bool = option(False, description="true: the specimen is glued to both faces and may pull")

    def __post_init__(self) -> None:
        if isinstance(self.flow, LinearFlow) and self.flow.hardening >= self.young:
            text = f"{self.flow.hardening:g} Pa is not below Young's modulus, {self.young:g} Pa"
            raise CaseError(
                text, remedy="Give the slope of the stress-strain curve after yielding.", path="flow.hardening"
            )
        if isinstance(self.flow, JohnsonCook) and self.rate is not None:
            text = "johnson_cook has its own dependence on the rate"
            raise CaseError(text, remedy="Remove rate, or give another flow.", path="rate")

    def begin(self, left: SideFacts, right: SideFacts, dt: float) -> Start:
        numbers: tuple[float, ...]
        match self.flow:
            case LinearFlow(first, tangent):
                kind, numbers = hysteresis.LINEAR, (first, self.young * tangent / (self.young - tangent))
            case JohnsonCook() as flow:
                kind, numbers = hysteresis.JOHNSON_COOK, (flow.A, flow.B, flow.n, flow.C, flow.reference_rate)
            case TabulatedFlow(strains, stresses):
                points = [value for pair in zip(strains, stresses, strict=True) for value in pair]
                kind, numbers = hysteresis.TABLE, (float(len(strains)), *points)
        rated = (0.0, 1.0, 1.0) if self.rate is None else (hysteresis.COWPER_SYMONDS, self.rate.D, self.rate.q)
        spring = hysteresis.elastic(self.young * self.area / self.length)
        opened = (*spring[: hysteresis.OPENS], 0.0 if self.tension else 1.0, *spring[hysteresis.OPENS + 1 :])
        parameters = (*opened, self.length, self.area, kind, *rated, *numbers)
        return Start(parameters=parameters, memory=(0.0, 0.0, 0.0))

    @property
    def first_yield(self) -> float:
        """Stress at which it yields first when it is loaded slowly [Pa]."""
        match self.flow:
            case LinearFlow(first, _):
                return first
            case JohnsonCook() as flow:
                return flow.A
            case TabulatedFlow(_, stresses):
                return stresses[0]

    def loading_curve(self, strain: float) -> tuple[Array, Array]:
        """Return nominal strain and stress [Pa] of one slow loading, shape (n,) each.

        ``strain`` is the largest plastic one. The rate of plastic strain is taken as the reference rate of
        `JohnsonCook`, and without the factor of `CowperSymonds`.
        """
        plastic = np.linspace(0.0, strain, CURVE_POINTS)
        match self.flow:
            case LinearFlow(first, tangent):
                stress = first + self.young * tangent / (self.young - tangent) * plastic
            case JohnsonCook() as flow:
                stress = flow.A + flow.B * plastic**flow.n
            case TabulatedFlow(strains, stresses):
                stress = np.interp(plastic, strains, stresses)
        return np.append(0.0, plastic + stress / self.young), np.append(0.0, stress)

    @property
    def pulls(self) -> bool:
        return self.tension

    def branches(self) -> Branches | None:
        """Return the branches of a specimen whose flow stress is linear and independent of rate, else None."""
        if not isinstance(self.flow, LinearFlow) or self.rate is not None:
            return None
        made = yielding_both if self.tension else one_sided
        scale = self.area / self.length
        return made(self.young * scale, self.flow.yield_stress * self.area, self.flow.hardening * scale)

    def stiffest(self, left: SideFacts, right: SideFacts, dt: float) -> float:
        return self.young * self.area / self.length

    def set_of(self, memory: Sequence[float]) -> float:
        return memory[hysteresis.SET]

    respond = staticmethod(hysteresis.respond)
