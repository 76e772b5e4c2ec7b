"""Distributions that are really installed, most of them broken: none hides or stops another."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

GOOD = '''
"""A law of a plugin."""

from dataclasses import dataclass
from typing import Any, final

from impactlab.contact.base import AbstractContactLaw
from impactlab.types import (Level, Port, Reply, Start, option)


@final
@dataclass(frozen=True)
class {name}(AbstractContactLaw):
    """A spring that acts at the start of the step."""

    needs = frozenset({{Level.POSITION}})
    citations = ("Goldsmith1960",)
    gains_energy = 1.0

    stiffness: float = option(1.0e6, unit="N/m", above=0.0, description="spring")

    def begin(self, left: Any, right: Any, dt: float) -> Start:
        return Start(parameters=(self.stiffness,))

    @staticmethod
    def respond(port: Port, reply: Reply) -> None:
        if port.gap < 0.0:
            reply.force = reply.trial = -port.parameters[0] * port.gap
            reply.in_contact = 1.0
            reply.stored = 0.5 * port.parameters[0] * port.gap**2
'''

BROKEN = {  # what is wrong: the module, and what the listing says of it
    "import_error": (
        "import no_such_module_anywhere",
        "ModuleNotFoundError: No module named 'no_such_module_anywhere'",
    ),
    "syntax_error": ("def respond(:", "SyntaxError"),
    "exits": ("raise SystemExit(0)", "SystemExit"),
    "exits_loudly": ("import sys\nprint('{not json')\nsys.exit('goodbye')", "goodbye"),
    "endless_recursion": ("def f(): return f()\nf()", "RecursionError"),
    "no_attribute": ("Other = 1", "AttributeError"),
    "no_class": ("Part = 3", "it is not a class but 'int'"),
    "wrong_base": (GOOD.format(name="Part").replace("Part(AbstractContactLaw)", "Part"), "it does not derive from"),
    "not_frozen": (GOOD.format(name="Part").replace("(frozen=True)", ""), "it is not a frozen dataclass"),
    "class_raises": ("class Part:\n    x = 1 / 0", "ZeroDivisionError"),
    "unfinished": (GOOD.format(name="Part").replace("def respond", "def reply"), "it does not define respond ("),
    "bad_field": (GOOD.format(name="Part").replace("stiffness: float", "stiffness: list"), "has the type"),
    "unknown_type": (GOOD.format(name="Part").replace("stiffness: float", "stiffness: 'Nowhere'"), "NameError"),
    "bad_default": (GOOD.format(name="Part").replace("1.0e6,", "-1.0,"), "the default of the field 'stiffness'"),
    "no_option": (
        GOOD.format(name="Part").replace('option(1.0e6, unit="N/m", above=0.0, description="spring")', "1.0e6"),
        "is not made by impactlab.types.option",
    ),
    "no_docstring": (GOOD.format(name="Part").replace('    """A spring', '    #"""A spring'), "has no docstring"),
}


def install(site: Path, distribution: str, module: str, text: str, entry_points: str) -> None:
    """Write what pip writes of a distribution of one module."""
    (site / f"{module}.py").write_text(text)
    information = site / f"{distribution}-1.0.dist-info"
    information.mkdir(parents=True)
    (information / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {distribution}\nVersion: 1.0\n")
    (information / "entry_points.txt").write_text(entry_points)


def law(name: str, module: str, attribute: str = "Part") -> str:
    return f"[impactlab.contact_laws]\n{name} = {module}:{attribute}\n"


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder on the path with one good plugin among many broken ones."""
    folder = tmp_path_factory.mktemp("site")
    install(
        folder, "good", "good_plugin", GOOD.format(name="GoodSpring"), law("good_spring", "good_plugin", "GoodSpring")
    )
    for name, (text, _) in BROKEN.items():
        install(folder, f"dist-{name}", f"plugin_{name}", text, law(name, f"plugin_{name}"))
    install(folder, "rival-one", "rival_one", GOOD.format(name="Part"), law("rival", "rival_one"))
    install(folder, "rival-two", "rival_two", GOOD.format(name="Part"), law("rival", "rival_two"))
    return folder


def impactlab(site: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(site)}
    command = [sys.executable, "-m", "impactlab", *arguments]
    return subprocess.run(command, capture_output=True, text=True, env=environment)


@pytest.fixture(scope="module")
def listed(site: Path) -> dict[str, dict[str, object]]:
    done = impactlab(site, "plugins", "--json")
    assert done.returncode == 0, done.stderr
    return {part["name"]: part for part in json.loads(done.stdout)["parts"]}


def test_every_part_that_works_is_there(listed):
    for name in ("newmark", "penalty", "finite_element", "good_spring"):
        assert listed[name]["fault"] == "", name
    assert listed["good_spring"]["description"] == "A spring that acts at the start of the step."


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_part_is_listed_with_its_reason(listed, name):
    assert BROKEN[name][1] in listed[name]["fault"]
    assert listed[name]["distribution"] == f"dist-{name}"


def test_two_of_one_name_are_both_named(listed):
    assert "rival-one (rival_one:Part) and rival-two (rival_two:Part)" in listed["rival"]["fault"]


CASE = """\
schema_version: 1
bodies: {{ball: {{kind: mass, mass: 1.0, velocity: 1.0}}, wall: {{kind: wall}}}}
contacts:
  - between: [ball, wall]
    law: {{kind: {law}}}
solve: {{duration: 5.0e-3, integrator: {{kind: newmark}}, step: {{dt: 1.0e-5}}}}
"""


def run(site: Path, tmp_path: Path, name: str) -> tuple[int, dict[str, object], str]:
    case = tmp_path / f"{name}.yaml"
    case.write_text(CASE.format(law=name))
    done = impactlab(site, "run", str(case), "--json")
    return done.returncode, json.loads(done.stdout), done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("name", ["penalty", "good_spring"])
def test_the_good_ones_run_among_the_broken(site, tmp_path, name):
    if name == "penalty":
        name = "penalty, stiffness: 1.0e6"
    code, document, said = run(site, tmp_path, name)
    assert code == 0, said
    assert document["status"] == "completed"
    # Half a period of mass 1 kg on 1e6 N/m, in 314 steps; the second spring acts half a step late.
    assert document["contacts"][0]["end"] == pytest.approx(3.14159e-3, abs=2e-5)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("exits_loudly", "SystemExit: goodbye"),
        ("good_sprin", "Did you mean 'good_spring'?"),
    ],
)
def test_a_case_with_a_broken_part_is_refused_by_its_name(site, tmp_path, name, text):
    code, document, said = run(site, tmp_path, name)
    assert code == 2
    assert document["status"] == "refused"
    assert text in said
    assert "Traceback" not in said


METRICS_OF_STRANGERS = {
    "loud": "print('{not json')\n    return 3.5",
    "leaving": "raise SystemExit('goodbye')",
    "raising": "raise ValueError('no answer')",
    "no_number": "return 'much'",
    "hanging": "while True: pass",
    "force": "return 1e9",  # the name of one of impactlab's own
}


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder on the path with one distribution for each metric; each prints when it is imported."""
    folder = tmp_path_factory.mktemp("metrics")
    for name, body in METRICS_OF_STRANGERS.items():
        text = (
            f'import sys\nsys.stderr.write("imported {name}")\ndef metric(h, r, s):\n    """A metric."""\n    {body}\n'
        )
        install(folder, f"dist-{name}", f"of_{name}", text, f"[impactlab.metrics]\n{name} = of_{name}:metric\n")
    return folder


def summary(site: Path, tmp_path: Path, *arguments: str, extra: str = "") -> tuple[dict[str, object], str]:
    case = tmp_path / "case.yaml"
    case.write_text(CASE.format(law="penalty, stiffness: 1.0e6") + extra)
    done = impactlab(site, "run", str(case), "--json", "--reference", *arguments)  # errors are asked for
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout), done.stderr


def test_a_metric_that_hangs_exits_or_prints_touches_runs_that_do_not_name_it(measured: Path, tmp_path: Path) -> None:
    document, said = summary(measured, tmp_path)
    assert "imported" not in said
    assert not set(METRICS_OF_STRANGERS) - {"force"} & set(document["errors"])  # type: ignore[call-overload]
    assert document["errors"]["force"] < 1.0  # type: ignore[index]


def test_a_metric_that_is_named_and_misbehaves_ends_the_run_or_spoils_its_document(
    measured: Path, tmp_path: Path
) -> None:
    document, said = summary(measured, tmp_path, "--metric", "leaving", extra="metrics: [loud, raising, no_number]\n")
    errors: dict[str, object] = document["errors"]  # type: ignore[assignment]
    assert [errors[name] for name in ("loud", "raising", "no_number", "leaving")] == [3.5, None, None, None]
    assert "hanging" not in errors
    texts = [each["text"] for each in document["warnings"] if each["code"] == "metric_failed"]  # type: ignore[attr-defined]
    assert len(texts) == 3
    assert "metric leaving of of_leaving: SystemExit: goodbye" in texts
    assert "{not json" in said


def test_a_metric_that_is_not_installed_is_named_with_its_line(measured: Path, tmp_path: Path) -> None:
    case = tmp_path / "case.yaml"
    case.write_text(CASE.format(law="penalty, stiffness: 1.0e6") + "metrics: [lod]\n")
    done = impactlab(measured, "run", str(case), "--json")
    assert done.returncode == 2
    assert ":7: metrics.0: 'lod' is not a metric. Did you mean 'loud'?" in done.stderr
