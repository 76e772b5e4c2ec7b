"""Warnings of what contact laws report: events that they count, and contacts that a law of a plugin does not report."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from impactlab.contact.base import AbstractContactLaw
from impactlab.history.base import Warned
from impactlab.plugins import kind_of
from impactlab.simulate.channels import AbstractRecordedHistory

PERIODS_WARN, PERIOD_TOL = 10, 1e-6  # of contact within one step each, from which a law seems not to report them


def noted_by_laws(history: AbstractRecordedHistory) -> Iterator[Warned]:
    """Yield the warnings for events that laws have counted in their memory."""
    laws = history.method.laws
    if not any(law.noted for law in laws.values()):
        return
    for contact, memory in zip(history.scene.contacts, history.memories(), strict=True):
        for noted in laws[contact.name].noted:
            if count := int(memory[noted.slot]):
                yield Warned(noted.code, f"{contact.name}: {noted.text.format(count=count)}", contact.name)


def closed_within_steps(history: AbstractRecordedHistory) -> Iterator[Warned]:
    """Yield warnings for plugin laws whose contacts last at most one step.

    All contacts of such a law begin and end within one step. So does one that presses the faces and never sets
    `in_contact`.
    """
    laws = history.method.laws
    if history.dt is None or all(map(is_built_in, set(map(type, laws.values())))):
        return
    for contact in history.scene.contacts:
        law = laws[contact.name]
        if law.two_sided or not law.answers_force or is_built_in(type(law)):
            continue
        spans = history.spans(contact.name)
        longest = max((span.until(history.duration) - span.start for span in spans), default=0.0)
        if len(spans) >= PERIODS_WARN and longest <= (1.0 + PERIOD_TOL) * history.dt:
            name = kind_of(law)
            text = (
                f"{contact.name}: each of {len(spans)} periods of contact lasts one step at most. Law '{name}' must "
                "set reply.in_contact to 1.0 in each step at whose end the faces are still in contact; `impactlab "
                f"plugins --check {name}` tests it"
            )
            yield Warned("chatter", text, contact.name)


def is_built_in(kind: type[AbstractContactLaw]) -> bool:
    """Return whether a class of laws comes with impactlab."""
    return kind.__module__.startswith("impactlab.")


def own_laws(laws: Iterable[AbstractContactLaw]) -> str:
    """Return the names of laws from outside impactlab, quoted; empty if none."""
    return ", ".join(sorted({f"'{kind_of(law)}'" for law in laws if not is_built_in(type(law))}))
