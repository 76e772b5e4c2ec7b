"""The two passes of the generalised-alpha family over the coordinates, before and after its solution.

Five arrays are read and four written, too many for a compiler to show that none overlaps another; so the passes are
written with eight coordinates at a time, and the rest one by one by the same formulas.
"""

from __future__ import annotations

from typing import Any

from impactlab.numerics.compiling import HELPER, UNPACK
from impactlab.numerics.lanes import LANES, all_lanes, lanes_at, put_lanes
from impactlab.types import Array


@UNPACK
def predicted(u: Any, v: Any, a: Any, w: Any, y: Any, k: Any) -> Any:
    """Return u, v, a and y before the new w enters them."""
    kept = k[0] * w - k[1] * a
    return u + k[2] * v + k[3] * a + k[4] * kept, v + k[5] * a + k[6] * kept, kept, k[7] * y - u


@UNPACK
def corrected(u: Any, v: Any, a: Any, w: Any, y: Any, k: Any) -> Any:
    """Return u, v, a and y with the new w."""
    moved = u + k[0] * w
    return moved, v + k[1] * w, a + k[2] * w, k[3] * (y + moved)


@HELPER
def predict(k: tuple[float, ...], u: Array, v: Array, a: Array, w: Array, y: Array) -> None:
    """Rewrite u, v, a and y by their predictor.

    The factors are those of w and a in the kept acceleration, the step, and so on.
    """
    wide = (
        all_lanes(k[0]),
        all_lanes(k[1]),
        all_lanes(k[2]),
        all_lanes(k[3]),
        all_lanes(k[4]),
        all_lanes(k[5]),
        all_lanes(k[6]),
        all_lanes(k[7]),
    )
    n, i = u.size, 0
    while i + LANES <= n:
        eight = lanes_at(u, i), lanes_at(v, i), lanes_at(a, i), lanes_at(w, i), lanes_at(y, i)
        new_u, new_v, new_a, new_y = predicted(eight[0], eight[1], eight[2], eight[3], eight[4], wide)
        put_lanes(u, i, new_u)
        put_lanes(v, i, new_v)
        put_lanes(a, i, new_a)
        put_lanes(y, i, new_y)
        i += LANES
    for j in range(i, n):
        u[j], v[j], a[j], y[j] = predicted(u[j], v[j], a[j], w[j], y[j], k)


@HELPER
def correct(k: tuple[float, ...], u: Array, v: Array, a: Array, w: Array, y: Array) -> None:
    """Rewrite u, v, a and y.

    The factors are those of w in u, v and a, and that of y.
    """
    wide = all_lanes(k[0]), all_lanes(k[1]), all_lanes(k[2]), all_lanes(k[3])
    n, i = u.size, 0
    while i + LANES <= n:
        eight = lanes_at(u, i), lanes_at(v, i), lanes_at(a, i), lanes_at(w, i), lanes_at(y, i)
        new_u, new_v, new_a, new_y = corrected(eight[0], eight[1], eight[2], eight[3], eight[4], wide)
        put_lanes(u, i, new_u)
        put_lanes(v, i, new_v)
        put_lanes(a, i, new_a)
        put_lanes(y, i, new_y)
        i += LANES
    for j in range(i, n):
        u[j], v[j], a[j], y[j] = corrected(u[j], v[j], a[j], w[j], y[j], k)
