"""Unknown keys inside methods that a case does not use: `impactlab check` names each, with file and line."""

from __future__ import annotations

from pathlib import Path

from tests.support import invoke
from tests.unit.case_texts import PAPER

METHODS = """\
methods:
  sound:
    solve.step: {points_per_period: 20}
  misspelt:
    contacts.0.law: {kind: penalty, stifness: 1.0e9}
  elsewhere:
    solve.modle: {kind: finite_element, elements: 20}
"""


def test_check_names_file_and_line_of_unknown_keys_in_methods(tmp_path: Path) -> None:
    file = tmp_path / "case.yaml"
    file.write_text(PAPER + METHODS, encoding="utf-8")
    first = PAPER.count("\n") + 1
    found = invoke("check", str(file))
    assert found.exit_code == 2
    assert (
        f"method misspelt: {file}:{first + 4}: contacts.0.law.stifness: the key 'stifness' is not known" in found.stderr
    )
    assert f"method elsewhere: {file}:{first + 6}: solve.modle: the key 'modle' is not known here" in found.stderr
    assert "method sound" not in found.stderr
