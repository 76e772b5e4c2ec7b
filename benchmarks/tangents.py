"""Cost of tangents: the exact march with and without derivatives.

Derivatives are by one to six numbers.

Paper's case in the exact description, 3 T. Times are minima of interleaved marches over prepared memory; the whole call
of `sensitivities` is timed beside them.

    python benchmarks/tangents.py [--repeats 200]
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

import impactlab as il
from impactlab.derivatives.exact import network
from impactlab.derivatives.parameters import read_parameters
from impactlab.exact.march import march, prepared
from impactlab.exact.tangents.arrays import tangent_arrays
from impactlab.exact.tangents.march import advance
from impactlab.exact.tangents.numbers import rates
from impactlab.numerics.addresses import entered

CASE = Path(__file__).parents[1] / "cases" / "axial_impact.yaml"
PATHS = (
    "bodies.hammer.mass",
    "bodies.hammer.velocity",
    "bodies.rod.length",
    "bodies.rod.area",
    "bodies.rod.material.young",
    "bodies.rod.material.density",
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=200)
    repeats = parser.parse_args().repeats
    case = il.load_case(CASE).method("continuous")
    best = {"plain": np.inf}
    counts = (1, 3, 6)
    found = {}
    for count in counts:
        parameters = read_parameters(case, PATHS[:count])
        beside = [lambda value, of=each: network(of.case(case, value)).log for each in parameters]
        values = [each.value for each in parameters]
        found[count] = rates(network(case).log, beside, values, values)
    for _ in range(repeats):
        log = prepared(network(case).log)
        began = time.perf_counter()
        march(log)
        best["plain"] = min(best["plain"], time.perf_counter() - began)
        for count in counts:
            log = prepared(network(case).log)
            tangents, until = tangent_arrays(log, found[count]), np.zeros(count)
            began = time.perf_counter()
            entered(advance, log.memory, tangents, until)
            spent = time.perf_counter() - began
            best[f"{count} parameters"] = min(best.get(f"{count} parameters", np.inf), spent)
    for name, seconds in best.items():
        print(f"{name:15} {1e6 * seconds:8.1f} us  {seconds / best['plain']:6.2f} of the march without tangents")
    il.sensitivities(case, PATHS)
    spent = []
    for _ in range(5):
        began = time.perf_counter()
        il.sensitivities(case, PATHS)
        spent.append(time.perf_counter() - began)
    print(f"il.sensitivities by six parameters: {1e3 * min(spent):.0f} ms")


if __name__ == "__main__":
    main()
