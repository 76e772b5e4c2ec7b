"""The machine and the versions of a table."""

from __future__ import annotations

import os
import platform
import sys
from functools import cache
from importlib.metadata import version
from pathlib import Path

from impactlab.jobs.sources import code_hash, code_version


@cache
def environment() -> dict[str, str]:
    """Return the columns of the table for the code, the machine and the versions."""
    return {
        "code": code_version(),
        "machine": f"{processor()}, {os.cpu_count()} cores, {platform.system()}",
        "python": platform.python_version(),
        **{name: version(name) for name in ("numpy", "scipy", "numba")},
    }


def processor() -> str:
    """Return the name of the processor that the system reports."""
    facts = Path("/proc/cpuinfo")
    lines = facts.read_text(encoding="utf-8", errors="replace").splitlines() if facts.is_file() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def described() -> dict[str, object]:
    """Return `environment` and further facts for repeating a bench."""
    return {
        **environment(),
        "sources": code_hash(),
        "llvmlite": version("llvmlite"),
        "system": platform.platform(),
        "byte_order": sys.byteorder,
    }
