"""Parts inside parts: a basis in a model, given by its name or as a block; damping of rods."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from impactlab import cite
from impactlab.bases.craig_bampton import CraigBampton
from impactlab.bases.eigenvectors import Eigenvectors
from impactlab.bases.substructured import Substructured
from impactlab.casefile import load_case
from impactlab.casefile.jsonschema import case_schema
from impactlab.errors import CaseError
from impactlab.models.continuous.delay_line import DelayLine
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.plugins import registry
from impactlab.scene import Rayleigh
from impactlab.simulate import prepare
from tests.unit.case_texts import PAPER

TEXT = PAPER.replace("{kind: finite_element, elements: 20}", "{kind: modal, elements: 20, modes: 10}")


def written(folder: Path, model: str = "{kind: modal, elements: 20, modes: 10}", material: str = "") -> Path:
    path = folder / "test.yaml"
    text = TEXT.replace("{kind: modal, elements: 20, modes: 10}", model)
    path.write_text(text.replace("density: 7900}", f"density: 7900{material}}}"))
    return path


def model_of(case):
    return case.simulation().method.models["rod"]


def test_a_basis_is_given_by_its_name_or_as_a_block(tmp_path):
    assert model_of(load_case(written(tmp_path))) == Modal(20, 10, basis=Eigenvectors())
    named = written(tmp_path, "{kind: modal, elements: 20, modes: 10, basis: craig_bampton}")
    assert model_of(load_case(named)) == Modal(20, 10, basis=CraigBampton())
    block = written(tmp_path, "{kind: modal, elements: 20, modes: 10, basis: {kind: substructured, others: 2}}")
    assert model_of(load_case(block)) == Modal(20, 10, basis=Substructured(others=2))


def test_a_basis_is_changed_by_path(tmp_path):
    case = load_case(written(tmp_path))
    assert model_of(case.with_("solve.model.basis", "ritz")).basis.__class__.__name__ == "Ritz"
    assert model_of(case.with_("solve.model.basis.kind", "ritz")).basis.__class__.__name__ == "Ritz"
    named = case.with_("solve.model.basis", "substructured")
    assert model_of(named.with_("solve.model.basis.others", 3)).basis == Substructured(others=3)
    block = case.with_("solve.model.basis", kind="substructured", pieces=5)
    assert model_of(block.with_("solve.model.basis", others=3)).basis == Substructured(5, 3)
    # A changed kind replaces the block: `pieces` is no option of the new one.
    assert model_of(block.with_("solve.model.basis", kind="craig_bampton")).basis == CraigBampton()
    assert model_of(block.with_("solve.model", kind="finite_element")) == FiniteElement()


def test_a_resolved_case_shows_the_basis_with_its_defaults_and_reads_again(tmp_path):
    case = load_case(written(tmp_path)).with_("solve.model.basis", "substructured")
    model = case.resolved()["solve"]["models"]["rod"]
    assert model["basis"] == {"kind": "substructured", "pieces": 4, "others": 1}
    assert model_of(case.with_("solve.model", model)) == model_of(case)
    assert load_case(written(tmp_path)).resolved()["solve"]["models"]["rod"]["basis"] == {"kind": "eigenvectors"}


def test_the_sources_of_a_basis_are_cited(tmp_path):
    case = load_case(written(tmp_path)).with_("solve.model.basis", "craig_bampton")
    assert "CraigBampton1968" in cite.cite(case).keys


def test_the_schema_has_the_bases_and_their_fields():
    schema = json.loads(json.dumps(case_schema(registry().only("impactlab"))))
    modal = next(
        part
        for part in schema["$defs"]["SolveBlock"]["properties"]["model"]["oneOf"]
        if part["properties"]["kind"]["const"] == "modal"
    )
    basis = modal["properties"]["basis"]
    assert basis["default"] == {"kind": "eigenvectors"}
    assert "craig_bampton" in basis["oneOf"][0]["enum"]
    assert any("pieces" in choice.get("properties", {}) for choice in basis["oneOf"])


@pytest.mark.parametrize(
    ("given", "shown"), [("{pieces: 3}", "{pieces: ...}"), ("null", "nothing")], ids=["no kind", "nothing"]
)
def test_a_block_without_a_kind_is_no_basis(tmp_path, given, shown):
    path = written(tmp_path, f"{{kind: modal, elements: 20, modes: 10, basis: {given}}}")
    with pytest.raises(CaseError) as refusal:
        load_case(path)
    assert f"basis: {shown} is given where a basis is needed" in str(refusal.value)
    assert "test.yaml:17" in str(refusal.value)


@pytest.mark.parametrize(
    ("model", "text"),
    [
        (
            "{kind: finite_element, order: 2, mass: redistributed}",
            "solve.model.mass: mass 'redistributed' applies only to",
        ),
        ("{kind: modal, elements: 9, mass: redistributed, order: 3}", "Allowed: order 1"),
        ("{kind: modal, modes: 9, mass: lumped}", "solve.model.mass: mass is lumped, an option of the mesh behind"),
        ("{kind: modal, modes: 9, order: 2}", "solve.model.order: order is 2, an option of the mesh behind the modes"),
    ],
)
def test_wrong_options_of_models_are_refused(tmp_path, model, text):
    with pytest.raises(CaseError) as refusal:
        load_case(written(tmp_path, model))
    assert text in str(refusal.value)


def test_damping_is_read_with_units_and_shown(tmp_path):
    case = load_case(written(tmp_path, material=", viscosity: 2.0 kPa*s")).with_(
        "bodies.rod.damping", mass=12.0, stiffness="3 us"
    )
    rod = case.scene().bodies["rod"]
    assert rod.segments[0].viscosity == pytest.approx(2000.0)
    assert rod.damping == Rayleigh(12.0, pytest.approx(3e-6))
    shown = case.resolved()["bodies"]["rod"]
    assert shown["material"]["viscosity"] == pytest.approx(2000.0)
    assert shown["damping"] == {"mass": 12.0, "stiffness": pytest.approx(3e-6)}
    assert load_case(written(tmp_path)).scene().bodies["rod"].damping == Rayleigh()


@pytest.mark.parametrize(
    ("path", "value", "text"),
    [
        ("bodies.rod.damping.mass", -1.0, "damping.mass: -1 1/s is out of range"),
        ("bodies.rod.damping.stiffness", -1e-9, "damping.stiffness: -1e-09 s is out of range"),
        ("bodies.rod.damping.ratio", 0.1, "the key 'ratio' is not known here. Allowed: mass, stiffness"),
        ("bodies.rod.damping", 0.1, "bodies.rod.damping"),
        ("bodies.rod.material.viscosity", -2.0, "viscosity: -2 Pa s is out of range"),
        ("bodies.rod.material.viscosity", "2 Pa", "viscosity"),
    ],
)
def test_wrong_damping_is_refused(tmp_path, path, value, text):
    with pytest.raises(CaseError) as refusal:
        load_case(written(tmp_path)).with_(path, value)
    assert text in str(refusal.value).replace("\n", " ")


@pytest.mark.parametrize(("path", "value"), [("bodies.rod.damping.mass", 3.0), ("bodies.rod.material.viscosity", 1e3)])
def test_the_continuous_model_refuses_damping_by_name(tmp_path, path, value):
    case = load_case(written(tmp_path)).with_("solve.model", kind="continuous").with_(path, value)
    with pytest.raises(CaseError, match="'rod' is damped") as refusal:
        prepare(*case.simulation())
    assert "finite_element or modal" in refusal.value.remedy
    assert refusal.value.path == path.rpartition(".")[0]
    with pytest.raises(CaseError, match="'rod' is damped"):
        DelayLine(case.scene().bodies["rod"], 0.0)
