"""The warning of a contact whose faces never met."""

from __future__ import annotations

from impactlab.history.base import Warned

NOISE_TOL = 1e-6  # of the largest change of a gap: overlaps of contacts below the noise floor are smaller by far


def never_met(contact: str, initial_gap: float, smallest: float, travel: float) -> Warned:
    """Return the warning of a contact without a touch.

    Parameters
    ----------
    contact : str
        Its name.
    initial_gap, smallest : float
        Gap at t = 0, and the smallest of the run [m].
    travel : float
        Largest change of a gap in the run [m].
    """
    if smallest >= min(0.0, initial_gap):
        text = f"the faces never met; the smallest gap was {smallest:.6g} m"
    elif -smallest > NOISE_TOL * travel:
        text = f"the faces overlap by {-smallest:.2g} m at the end of the run: they meet within its last step"
    else:
        text = f"the faces overlapped by {-smallest:.2g} m at most, too little for a contact"
    return Warned("no_contact", f"{contact}: {text}")
