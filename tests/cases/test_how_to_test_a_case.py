"""The page docs/how-to-test-a-case.md runs as it stands, and its helpers serve any run of a case."""

from __future__ import annotations

import os
import re
import subprocess
import sys

import pytest
from hypothesis.vendor.pretty import pretty

import impactlab as il
from impactlab.testing import invariants
from tests.support import ROOT

PAGE = (ROOT / "docs" / "how-to-test-a-case.md").read_text(encoding="utf-8")
CODE = re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)[0]


def test_the_tests_of_the_page_pass(tmp_path):
    (tmp_path / "test_hammer.py").write_text(CODE, encoding="utf-8")
    path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "test_hammer.py"]
    done = subprocess.run(command, cwd=tmp_path, env={**os.environ, "PYTHONPATH": path}, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout
    assert "10 passed" in done.stdout


def test_the_functions_that_the_page_names_are_there():
    for name in re.findall(r"`invariants\.(\w+)\(", PAGE):
        assert callable(getattr(invariants, name))


@pytest.mark.parametrize("steps", [400.0, 400.3])
def test_the_strongest_pull_of_a_run_whose_last_step_reaches_beyond_its_end(steps):
    """It asked for the force after the end of the run, and was refused."""
    names: dict[str, object] = {}
    exec(CODE, names)
    solve = {**names["MESH"], "step": {"dt": 1e-6}}
    case = names["struck"](solve=solve).with_("solve.duration", steps * 1e-6)
    assert invariants.strongest_pull(il.run(case)) == 0.0


def test_a_failing_example_of_hypothesis_shows_a_case_in_a_line():
    names: dict[str, object] = {}
    exec(CODE, names)
    case = names["struck"]()
    assert pretty(case) == repr(case) == "<Case 'case': hammer (mass), rod (rod); 1 contact, 0.0004 s>"
