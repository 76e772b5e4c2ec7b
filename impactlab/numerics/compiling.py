"""How the pieces of the loop are compiled: without a runtime for objects, cached on disk where they are entries."""

from __future__ import annotations

from typing import Any

import numba

from impactlab.numerics.addresses import FAST
from impactlab.numerics.cache import kept

njit: Any = numba.njit
ENTRY: Any = kept(_nrt=False, fastmath=FAST)
PART: Any = kept(_nrt=False, fastmath=FAST, no_cpython_wrapper=True, no_cfunc_wrapper=True)
INLINE = njit(inline="always", _nrt=False, no_cpython_wrapper=True, no_cfunc_wrapper=True)
