"""Warnings of energy that a run lost and nothing booked: numerical damping, or errors of long steps."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from impactlab.history.base import Warned
from impactlab.integrators.adaptive import Adaptive
from impactlab.prefixes import prefixed
from impactlab.simulate.channels import AbstractRecordedHistory
from impactlab.simulate.warnings.laws import own_laws

LOSS_WARN = 0.1  # of the reference energy, that nothing booked: damping schemes lose some, a mesh never so much
# The same of a run of so many steps, of which its second half lost that share or more: it goes on with the run.
SLOW_LOSS_WARN, LONG_RUN, STEADY = 0.02, 100_000, 0.25
# The same where nothing damps: the limit of gains. In 400 random mechanisms with springs at their stops, adaptive steps
# of DOP853 lost 2.5e-7 at most at their default tolerance, 1.4e-3 at 1e-4, 30 % at 1e-2; steps of `midpoint` lose by
# their square.
ERROR_WARN = 0.02


def warnings(
    history: AbstractRecordedHistory, reference: float, beyond: Callable[[float, float], bool]
) -> Iterator[Warned]:
    """Yield the warning of a loss that nothing booked.

    ``reference`` is the reference energy [J]; ``beyond`` returns whether a share of it exceeds a limit and rounding.
    """
    loss = history.energy.largest_loss * history.energy.scale / reference
    if beyond(loss, ERROR_WARN) and (found := _error_of_steps(history)):
        cause, remedy = found
        text = f"{100 * loss:.2g} % of the reference energy was lost to {cause}{_own(history)}. {remedy}"
        yield Warned("energy_loss", text)
    elif beyond(loss, LOSS_WARN):
        text = (
            f"{100 * loss:.2g} % of the reference energy was lost in a way that no formula gives, "
            f"such as the numerical damping of the scheme{_own(history)}. Give a smaller step, or a scheme "
            "without numerical damping"
        )
        yield Warned("energy_loss", text)
    elif beyond(loss, SLOW_LOSS_WARN):
        yield from _slow(history, loss, reference)


def _error_of_steps(history: AbstractRecordedHistory) -> tuple[str, str] | None:
    """Return cause and remedy of a loss under a method without numerical damping; None if the method may damp."""
    integrator = history.method.integrator
    if isinstance(integrator, Adaptive):
        relative, absolute = integrator.relative_tolerance, integrator.absolute_tolerance or 0.0
        name = "relative_tolerance" if relative >= absolute else "absolute_tolerance"
        cause = f"errors of the adaptive steps, which have a {name} of {max(relative, absolute):g}"
        return cause, "Give a smaller one: the default is a relative_tolerance of 1e-8"
    if history.dt is not None and any(body.changes for body in history.scene.bodies.values()):
        cause = f"errors of the steps, {prefixed(history.dt, 's')} long, in the motion of the mechanism"
        return cause, "Give a smaller step"
    return None


def _own(history: AbstractRecordedHistory) -> str:
    """Return the text that names laws of plugins, which may not report all that they lose."""
    own = own_laws(history.method.laws.values())
    return f"; or law {own} does not report it as `stored` or `dissipated`" if own else ""


def _slow(history: AbstractRecordedHistory, loss: float, reference: float) -> Iterator[Warned]:
    """Yield a warning of an energy loss that continues through a long run.

    ``loss`` is a share of the reference energy.
    """
    steps, balance = history.duration / (history.dt or history.duration), history.energy.balance
    late = float(balance[balance.size // 2] - balance[-1])
    if steps >= LONG_RUN and late > STEADY * loss * reference:
        text = (
            f"{100 * loss:.2g} % of the reference energy was lost over {steps:.2g} steps by the "
            "numerical damping of the scheme, and a longer run loses more. Give a smaller step, or "
            "integrator midpoint or newmark"
        )
        yield Warned("energy_loss", text)
