"""The independent program for a scene."""

from __future__ import annotations

from collections.abc import Sequence

from studies.audit import smooth, truth
from studies.audit.compare import JUDGED, Truth
from studies.audit.network import Doc, segments_of
from studies.audit.truth import NotKnownError


def is_smooth(doc: Doc) -> bool:
    """Return whether a scene has beams or damped rods.

    Their waves do not keep their shape.
    """
    for body in doc["bodies"].values():
        if body["kind"] == "beam" or "damping" in body:
            return True
        if body["kind"] == "rod" and any(s["material"].get("viscosity") for s in segments_of(body)):
            return True
    return False


def solve(doc: Doc, judged: Sequence[str] = JUDGED) -> Truth:
    """Return the independent solution, refined in the quantities of `judged`; `NotKnownError` where there is none."""
    return smooth.solve(doc, judged) if is_smooth(doc) else truth.solve(doc, judged)


__all__ = ["NotKnownError", "Truth", "solve"]
