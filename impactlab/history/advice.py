"""Advice for each warning of a run, and the text of warnings."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

ADVICE: Mapping[str, str] = {
    "constraint_energy": "Watch the energy gain, or take the integrator contact_stabilised_newmark or moreau_jean.",
    "coordinates_change": "Take basis eigenvectors or craig_bampton, or a law that keeps the contact closed, such as "
    "velocity_complementarity.",
    "energy_gain": "Take a smaller step, or another pair of law and integrator.",
    "near_grazing": "Compare two methods before you quote the number of contacts.",
    "no_contact": "Check velocities, gap, duration and step.",
    "overlap": "Take a law that holds positions, such as addition_deletion, or a smaller step.",
    "slow_touch": "Give a larger slowest_approach, or a law whose damping is constant.",
    "stated_error": "Trust the measured error, and set a smaller tolerance.",
    "tolerance_not_met": "Do not use the result at this tolerance: raise it, or state a method.",
}
"""Code of a warning whose text names no remedy, to the remedy."""


def warning_lines(warnings: Iterable[Mapping[str, str]]) -> Iterator[str]:
    """Yield a line for each code of warnings: the first text, the number of further ones, the advice."""
    by_code: dict[str, list[str]] = {}
    for warned in warnings:
        by_code.setdefault(warned["code"], []).append(warned["text"])
    for code, texts in by_code.items():
        more = f" (and {len(texts) - 1} more)" if len(texts) > 1 else ""
        advice = f" {ADVICE[code]}" if code in ADVICE else ""  # a plugin has codes of its own
        yield f"{code}: {texts[0].rstrip('.')}{more}.{advice}"
