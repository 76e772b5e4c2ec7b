"""Instruments of probes in a case: checks, records, and values in SI."""

from __future__ import annotations

from typing import Any

from impactlab.casefile.blocks.beams import BeamBlock
from impactlab.casefile.points import at_end
from impactlab.casefile.schema import BodyBlock, CaseBlock, ProbeBlock
from impactlab.errors import CaseError
from impactlab.printing import at_most
from impactlab.scene.instrument import Instrument
from impactlab.scene.problem import Probe

KEYS = ("length", "bandwidth", "rate", "noise", "seed", "bits", "range")  # of a probe, in the order of `Instrument`


def instrument_keys(probe: ProbeBlock) -> dict[str, Any]:
    """Return the keys of an instrument that a probe has."""
    return {key: value for key in KEYS if (value := getattr(probe, key)) is not None}


def probe_of(block: ProbeBlock, body: BodyBlock) -> Probe:
    """Return the probe of a block on a body.

    Its instrument is None where it has no key of one.
    """
    keys, at = instrument_keys(block), at_end(block.at, _length(body))
    return Probe(block.body, at, block.quantity, Instrument(**keys) if keys else None)


def _length(body: BodyBlock) -> float:
    """Return the whole length of a body [m]; 0 of a rigid one."""
    return float(getattr(body, "total_length", 0.0))


def instruments_are_whole(case: CaseBlock) -> None:
    """Raise `CaseError` where keys of an instrument conflict, or its gauge leaves the bar."""
    for number, block in enumerate(case.probes):
        path = f"probes.{number}"
        for key, other, words in (
            ("bits", "range", "the full scale of its converter"),
            ("range", "bits", "how many bits its converter has"),
        ):
            if getattr(block, key) is not None and getattr(block, other) is None:
                raise CaseError(
                    f"{key} is given without {other}, {words}. Allowed: both of them, or neither",
                    remedy=f"Give {other} as well, or remove {key}.",
                    path=f"{path}.{key}",
                )
        if block.seed is not None and block.noise is None:
            raise CaseError(
                "seed is given without noise. Allowed: noise alone, or noise and seed",
                remedy="Give the standard deviation of the noise, or remove seed.",
                path=f"{path}.seed",
            )
        if block.bandwidth is not None and block.rate is not None and block.bandwidth > 0.5 * block.rate:
            raise CaseError(
                f"a bandwidth of {block.bandwidth:g} Hz at {block.rate:g} samples per second. "
                f"Allowed: up to half the rate, {at_most(0.5 * block.rate)} Hz",
                remedy="Sample faster, or filter lower.",
                path=f"{path}.bandwidth",
            )
        _check_gauge(case, block, f"{path}.length")


def _check_gauge(case: CaseBlock, block: ProbeBlock, path: str) -> None:
    if block.length is None:
        return
    body = case.bodies[block.body]
    other = block.quantity if block.quantity != "strain" else "that of a beam" if isinstance(body, BeamBlock) else ""
    if other:
        raise CaseError(
            f"a gauge with a length measures strain, not {other}. Allowed: length with quantity: strain, of a rod",
            remedy="Probe the strain of a rod, or remove length.",
            path=path,
        )
    whole = _length(body)
    start, end = (at_end(block.at + part * block.length, whole) for part in (-0.5, 0.5))
    if start < 0.0 or end > whole:
        raise CaseError(
            f"a gauge of {block.length:g} m at {block.at:g} m reaches from {start:g} to {end:g} m, beyond the body "
            f"{block.body!r}. Allowed: inside 0 to {whole:g} m",
            remedy="Move its middle inwards, or give a shorter gauge.",
            path=path,
        )
    if f"{start:.6g}" == f"{end:.6g}":
        raise CaseError(
            f"a gauge of {block.length:g} m at {block.at:g} m: channels name places by six digits, and both of its "
            f"ends are {start:.6g}. Allowed: a longer gauge, or none",
            remedy="Leave length out: so short a gauge measures the strain at its place.",
            path=path,
        )
