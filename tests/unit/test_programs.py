"""The programs beside the package, of benchmarks and studies, find every name that they import."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
IMPORTED = """
import importlib, pathlib, sys
root = pathlib.Path(sys.argv[1])
sys.path[:0] = [str(root), str(root / "benchmarks")]
programs = [*(root / "benchmarks").glob("*.py"), *(root / "studies").rglob("*.py")]
for file in programs:
    if file.stem != "__main__":
        importlib.import_module(".".join(file.relative_to(root).with_suffix("").parts))
print(len(programs))
"""


def test_benchmarks_and_studies_find_what_they_import() -> None:
    ran = subprocess.run([sys.executable, "-c", IMPORTED, str(ROOT)], capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    assert int(ran.stdout.split()[-1]) > 50
