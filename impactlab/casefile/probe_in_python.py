"""A probe of a case given in Python, with keys, units and defaults of its block in a case file."""

from __future__ import annotations

from typing import Any

from impactlab.casefile.blocks_in_python import Value
from impactlab.casefile.keys_in_python import BodyKeys, given


class Probe(BodyKeys):
    """A quantity at a place of a body, recorded over the run, possibly as an instrument measures it.

    Parameters
    ----------
    body : str
        Name of the body.
    at : float or str
        Place x from its left end [m].
    quantity : str
        Of a rod ``"displacement"``, ``"velocity"``, ``"strain"``, ``"stress"`` or ``"force"``; of a beam also
        ``"rotation"``, ``"bending_moment"`` or ``"shear_force"``; of a shaft ``"twist"``, ``"twist_rate"`` or
        ``"torque"``. Of a flexible link of a mechanism ``"bending_moment"``, ``"shear_force"``, ``"stress"`` or
        ``"strain"``.
    length : float or str
        Length of a strain gauge, with its middle at the place [m].
    bandwidth : float or str
        Frequency at which the low-pass of the instrument is 3 dB down [Hz].
    rate : float or str
        Samples per second [Hz].
    noise : float or str
        Standard deviation of each sample, in the unit of the quantity.
    seed : int
        Seed of the noise.
    bits : int
        Number of bits of the converter.
    range : float or str
        Full scale of the converter, from -range to range, in the unit of the quantity.
    **others
        Other keys of a case file; unknown ones are refused.
    """

    block = "ProbeBlock"

    def __init__(
        self,
        body: str,
        at: Value,
        quantity: str,
        *,
        length: Value | None = None,
        bandwidth: Value | None = None,
        rate: Value | None = None,
        noise: Value | None = None,
        seed: int | None = None,
        bits: int | None = None,
        range: Value | None = None,  # noqa: A002 - the key of a case file
        **others: Any,
    ) -> None:
        super().__init__(**given(locals()))
