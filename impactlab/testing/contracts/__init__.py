"""Contract suites: one for each kind of part, to inherit in the tests of a plugin.

    class TestMyLaw(ContactLawContract):
        part = MyLaw(stiffness=1e9)

pytest collects the inherited tests under your class. Nothing here needs pytest itself: `impactlab plugins --check`
runs the same suites (`impactlab.testing.verdict`), with the options that a part gives in ``examples``.
"""

from __future__ import annotations

from typing import Any

from impactlab import plugins
from impactlab.contact.base import AbstractContactLaw
from impactlab.integrators.base import AbstractAdaptive
from impactlab.testing.contracts.bases import BasisContract
from impactlab.testing.contracts.common import PIECE, PORTS, STRUCK, described
from impactlab.testing.contracts.integrators import AdaptiveContract, IntegratorContract, face_row, stepped
from impactlab.testing.contracts.laws import ContactLawContract, LawContract
from impactlab.testing.contracts.links import LinkContract
from impactlab.testing.contracts.mechanisms import EquationsContract, MechanismContract
from impactlab.testing.contracts.metrics import MetricContract, QuantityContract
from impactlab.testing.contracts.models import RodModelContract

__all__ = [
    "PIECE",
    "STRUCK",
    "PORTS",
    "described",
    "LawContract",
    "ContactLawContract",
    "LinkContract",
    "face_row",
    "stepped",
    "IntegratorContract",
    "AdaptiveContract",
    "RodModelContract",
    "BasisContract",
    "EquationsContract",
    "MechanismContract",
    "MetricContract",
    "QuantityContract",
    "SUITES",
    "suite_of",
]

SUITES: dict[plugins.Group, type[Any]] = {
    plugins.LAWS: ContactLawContract,
    plugins.INTEGRATORS: IntegratorContract,
    plugins.MODELS: RodModelContract,
    plugins.BASES: BasisContract,
    plugins.MECHANISMS: MechanismContract,
    plugins.METRICS: MetricContract,
    plugins.QUANTITIES: QuantityContract,
}
"""The suite of each kind of part."""


def suite_of(group: plugins.Group, kind: Any) -> type[Any]:
    """Return the suite of a part's group; links and adaptive integrators have their own."""
    if group.arguments:
        return SUITES[group]
    if issubclass(kind, AbstractContactLaw) and kind.two_sided:
        return LinkContract
    return AdaptiveContract if issubclass(kind, AbstractAdaptive) else SUITES[group]
