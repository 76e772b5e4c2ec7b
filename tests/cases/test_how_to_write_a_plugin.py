"""The page docs/how-to-write-a-plugin.md runs as it stands: its distribution, its check, its tests, its case."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow  # several processes, each with the compilation of its law
PAGE = (Path(__file__).parents[2] / "docs" / "how-to-write-a-plugin.md").read_text(encoding="utf-8")


def block(language: str, number: int = 0) -> str:
    return re.findall(rf"```{language}\n(.*?)```", PAGE, flags=re.DOTALL)[number]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page's distribution, as pip would lay it out."""
    folder = tmp_path_factory.mktemp("site")
    project = tomllib.loads(block("toml"))["project"]
    [(group, points)] = project["entry-points"].items()
    [(name, place)] = points.items()
    module, _, _ = place.partition(":")
    package, _, file = module.partition(".")
    assert f"{package}/" in block("text")
    (folder / package).mkdir()
    (folder / package / "__init__.py").touch()
    (folder / package / f"{file}.py").write_text(block("python"), encoding="utf-8")
    (folder / package / "citations.bib").write_text(block("bibtex"), encoding="utf-8")
    information = folder / f"{project['name'].replace('-', '_')}-{project['version']}.dist-info"
    information.mkdir()
    (information / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: 0.1.0\n")
    (information / "entry_points.txt").write_text(f"[{group}]\n{name} = {place}\n")
    (folder / "test_crush_box.py").write_text(block("python", 1), encoding="utf-8")
    (folder / "crush.yaml").write_text(block("yaml"), encoding="utf-8")
    return folder


def python(site: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(site)}
    return subprocess.run([sys.executable, "-m", *arguments], capture_output=True, text=True, env=environment, cwd=site)


def test_it_is_listed_and_checked(site: Path) -> None:
    commands = [line.split() for line in block("sh").splitlines() if line.startswith("impactlab ")]
    listed, checked = (python(site, *command) for command in commands)
    assert "crush_box " in listed.stdout
    assert "[impactlab-crush-box]" in listed.stdout
    assert "broken" not in listed.stdout
    assert checked.returncode == 0, checked.stdout + checked.stderr
    assert checked.stdout.endswith("\nok\n")


def test_its_tests_pass(site: Path) -> None:
    done = python(site, "pytest", "-q", "-p", "no:cacheprovider", "test_crush_box.py")
    assert done.returncode == 0, done.stdout


def test_its_case_runs_and_cites_its_source(site: Path) -> None:
    done = python(site, "impactlab", "run", "crush.yaml", "--json")
    summary = json.loads(done.stdout)
    assert summary["status"] == "completed"
    # The box takes all energy but what the rod springs back with: pressed by 10 kN at rest it holds F^2 L/(2 E A),
    # 0.079 J; a force put on at once moves it to twice the depth, so at most four times that.
    energy, elastic = summary["energy"], 1e8 * 0.3 / (2.0 * 2.1e11 * 9e-4)
    assert 9.0 - 4.0 * elastic < energy["booked"]["contact"] < 9.0
    assert energy["booked"]["contact"] + energy["final"] == pytest.approx(9.0, rel=1e-9)
    assert "Abramowicz2003" in python(site, "impactlab", "cite", "crush.yaml").stdout


def test_a_wrong_value_is_refused_with_its_line(site: Path) -> None:
    done = python(site, "impactlab", "run", "crush.yaml", "--set", "contacts.0.law.force=-1")
    assert done.returncode == 2
    assert "-1 N is out of range. Allowed: a number in N above 0" in done.stderr
