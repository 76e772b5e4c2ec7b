"""Arrays of a page as one text by delta coding.

They are quantised to 16 bit, differenced, split into bytes, deflated, and coded in base64.
"""

from __future__ import annotations

import base64
import zlib

import numpy as np

from impactlab.types import Array

COARSE = 255  # values of an array that is shown as colours
MISSING = 65535  # code of NaN

Packed = tuple[int, int, float, float]
"""Place of an array in the text: first value, number of values, least value, step between values."""


class Packer:
    """Collects arrays; `text` holds all of them, as `unpack` of page.js reads them."""

    def __init__(self) -> None:
        self._codes: list[np.ndarray[tuple[int], np.dtype[np.uint16]]] = []
        self._size = 0

    def add(self, values: Array, levels: int) -> Packed:
        """Return the place of an array, which loses its shape.

        Its values are kept to (max - min)/(levels - 1).
        """
        flat = np.asarray(values, float).ravel()
        known = flat[np.isfinite(flat)]
        low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 0.0)
        step = (high - low) / (levels - 1) or 1.0
        codes = np.full(flat.size, MISSING, np.uint16)
        codes[np.isfinite(flat)] = np.rint((known - low) / step)
        place = (self._size, flat.size, low, step)
        self._codes.append(np.diff(codes, prepend=np.uint16(0)))  # modulo 65536
        self._size += flat.size
        return place

    def text(self) -> str:
        """Return all arrays: their low bytes, then their high bytes, deflated, in base64."""
        codes = np.concatenate(self._codes) if self._codes else np.zeros(0, np.uint16)
        planes = (codes & 0xFF).astype(np.uint8).tobytes() + (codes >> 8).astype(np.uint8).tobytes()
        return base64.b64encode(zlib.compress(planes, 6)).decode("ascii")
