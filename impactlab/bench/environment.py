"""Which machine and which versions a table was made with."""

from __future__ import annotations

import os
import platform
import sys
from functools import cache
from importlib.metadata import version
from pathlib import Path

from impactlab.bench.keys import code_hash, code_version


@cache
def environment() -> dict[str, str]:
    """Return the columns of the table that say where it was made."""
    return {
        "code": code_version(),
        "machine": f"{processor()}, {os.cpu_count()} cores, {platform.system()}",
        "python": platform.python_version(),
        **{name: version(name) for name in ("numpy", "scipy", "numba")},
    }


def processor() -> str:
    """Return the name of the processor, as far as the system reports it."""
    told = Path("/proc/cpuinfo")
    if told.is_file():
        for line in told.read_text(encoding="utf-8", errors="replace").splitlines():
            key, _, value = line.partition(":")
            if key.strip() == "model name":
                return value.strip()
    return platform.processor() or platform.machine()


def described() -> dict[str, object]:
    """Return `environment` and further facts for repeating a bench."""
    return {
        **environment(),
        "sources": code_hash(),
        "llvmlite": version("llvmlite"),
        "system": platform.platform(),
        "byte_order": sys.byteorder,
    }
