"""Numba's shortened searches find what the long ones find: the same intermediate code, the same comparisons."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from numba.core.compiler import Flags

from impactlab.numerics.addresses import COMPILED
from impactlab.numerics.repeated_searches import shorten_searches

ROOT = Path(__file__).parents[2]
CODE = """
import sys
import numba
import numpy as np
from impactlab.numerics.repeated_searches import shorten_searches

if sys.argv[1] == "short":
    shorten_searches()

def sums(values, count, flag):
    total, first = 0.0, np.int32(3)
    for i in range(count):
        total += values[i] * 2 + values[-1 - i] / (i + 1) - first // 2 + 5 % (i + 1) + 2**i + (i << 1)
        if flag and not total > i or i == 3:
            total = -abs(max(total, 1)) + min(i, 2)
    view = values[1:3]
    return total + view[0] * values[0] + flag + (1j * total).real

kinds = numba.float64[::1], numba.int64, numba.boolean
for options in ({}, {"fastmath": True, "error_model": "numpy"}):
    made = numba.njit(kinds, **options)(sums)
    print(made.inspect_llvm(made.signatures[0]))
    print(made(np.arange(1.0, 6.0), 5, True))
"""


def code(searches: str) -> str:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", CODE, searches], env=environment, capture_output=True, text=True)
    assert not done.returncode, done.stderr
    return done.stdout


@pytest.mark.skipif(not COMPILED, reason="nothing is compiled")
def test_short_searches_give_the_same_code() -> None:
    assert code("short") == code("long")


def test_options_are_equal_as_before() -> None:
    shorten_searches()
    one, other = Flags(), Flags()
    assert one == other
    one.nrt = True
    assert one != other
    other.nrt = True
    assert one == other
    one.boundscheck, other.boundscheck = Flags.options["boundscheck"].default, True
    assert one != other
    del one.boundscheck  # its default, stated before
    other.boundscheck = Flags.options["boundscheck"].default
    assert one == other
    assert one != "options"
