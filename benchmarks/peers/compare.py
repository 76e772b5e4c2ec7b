"""docs/peers.md: impactlab beside other programs, measured here and now, or again from measured values.

    python -m benchmarks.peers.compare --out docs/peers.md [--repeats 15]
    python -m benchmarks.peers.compare --out docs/peers.md --from docs/peers.json

Run from the root of the repository. Programs that are not installed (`pip install impactlab[peers]`) have rows that say
so. The measured values are written beside the page as JSON.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import platform
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from benchmarks.peers import measure
from benchmarks.peers.page import write
from benchmarks.peers.scan import PEERS, load
from impactlab.bench.environment import processor

SLOW_REPEATS = 3  # of runs that take seconds


def measured(repeats: int) -> dict[str, Any]:
    """Return everything the page shows."""
    versions = {load(name).LIBRARY: load(name).version() for name in PEERS} | {"Python": platform.python_version()}
    rows = measure.to_an_error(repeats)
    return {
        "machine": f"{processor()}, {os.cpu_count()} cores",
        "versions": versions,
        "repeats": repeats,
        "noise": noise(rows),
        "to_an_error": rows,
        "exact_model": measure.exact_model(rows),
        "explicit": measure.explicit(repeats),
        "implicit": measure.implicit(min(repeats, SLOW_REPEATS)),
        "by_hand": measure.by_hand(2 * repeats),
        "fixed_s": measure.fixed_cost(2 * repeats),
    }


def noise(rows: list[dict[str, Any]]) -> str:
    """Return how quiet the machine was."""
    spreads = [row["spread_s"] / row["solve_s"] for row in rows if "solve_s" in row]
    waits = [row["wall_s"] / row["solve_s"] for row in rows if "solve_s" in row]
    if not spreads:
        return ""
    spread, wait = (100.0 * sorted(each)[len(each) // 2] for each in (spreads, [w - 1.0 for w in waits]))
    return f"Half of the rows spread by less than {spread:.0f} %, and waited less than {wait:.0f} % for the processor."


def finite(value: Any) -> Any:
    """Return a value that JSON can hold: no NaN, no infinity."""
    if isinstance(value, dict):
        return {key: finite(each) for key, each in value.items()}
    if isinstance(value, list):
        return [finite(each) for each in value]
    return 1e300 if isinstance(value, float) and not math.isfinite(value) else value


def main() -> None:
    """Measure or read, and write the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--repeats", type=int, default=15)
    parser.add_argument("--from", dest="source", type=Path, help="JSON of an earlier run: nothing is measured")
    given = parser.parse_args()
    if given.source is not None:
        results = json.loads(given.source.read_text(encoding="utf-8"))
    else:
        with threadpool_limits(limits=1):
            results = finite(measured(given.repeats))
        text = json.dumps(results, indent=1, allow_nan=False) + "\n"
        given.out.with_suffix(".json").write_text(text, encoding="utf-8")
    write(results, given.out)


if __name__ == "__main__":
    main()
