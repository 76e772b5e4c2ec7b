"""Parts are listed without importing, loaded by name, and a faulty one says why it cannot be used."""

from __future__ import annotations

import dataclasses
import subprocess
import sys
import types
from typing import ClassVar, Literal

import pytest

from impactlab import PluginError, load_case
from impactlab.casefile.listing import listing
from impactlab.contact.base import AbstractContactLaw
from impactlab.plugins import GROUPS, INTEGRATORS, LAWS, MECHANISMS, MODELS, Entry, Registry, registry
from impactlab.scene.method import laws_of
from impactlab.types import Level, Relative, Start, option


@dataclasses.dataclass(frozen=True)
class Cushion(AbstractContactLaw):
    """A soft law for tests.

    More text that a listing does not show.
    """

    needs: ClassVar[frozenset[Level]] = frozenset()
    citations: ClassVar[tuple[str, ...]] = ("Goldsmith1960",)

    stiffness: float | Relative = option(unit="N/m", description="stiffness", above=0.0)
    layers: int = option(3, description="number of layers", at_least=1)
    wet: bool = option(False, description="whether it is wet")
    shape: Literal["flat", "round"] = option("flat", description="shape of the face")
    limit: float | Literal["none"] | None = option(None, unit="N", description="largest force")

    def begin(self, left, right, dt):
        return Start()

    @staticmethod
    def respond(port, reply):
        pass


@dataclasses.dataclass(frozen=True)
class Bare(Cushion):
    """Another law of the same name."""

    extra: float = 1.0


@dataclasses.dataclass(frozen=True)
class Listy(Cushion):
    """A law with a field that no case can give."""

    items: tuple[int, ...] = option((), description="numbers")


@pytest.fixture
def parts(monkeypatch):
    module = types.ModuleType("stand_in_parts")
    for part in (Cushion, Bare, Listy):
        setattr(module, part.__name__, part)
    monkeypatch.setitem(sys.modules, "stand_in_parts", module)


def law(name: str, attribute: str, distribution: str = "stand-in") -> Entry:
    return Entry(LAWS.name, name, f"stand_in_parts:{attribute}", distribution)


def test_built_in_parts_stand_in_the_same_groups():
    installed = registry()
    assert set(installed.names(MODELS)) >= {"continuous", "finite_element", "modal"}
    assert set(installed.names(INTEGRATORS)) >= {"central_difference", "exact_modal", "newmark"}
    assert set(installed.names(LAWS)) >= {"addition_deletion", "impulse_momentum", "penalty", "wave_identification"}
    assert installed.names(LAWS) == tuple(sorted(installed.names(LAWS)))


def test_every_registered_built_in_part_can_be_loaded():
    for line in listing(registry().only("impactlab")):
        assert not line.fault, line
        assert line.description
        assert not line.description.startswith("Return")


def test_names_are_listed_without_importing():
    code = (
        "import sys; from impactlab.plugins import GROUPS, registry; "
        "[registry().names(group) for group in GROUPS]; "
        "assert not [m for m in sys.modules if m.startswith(('numpy', 'numba', 'impactlab.contact', 'pydantic'))]"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_only_the_named_part_is_imported(parts):
    found = Registry([law("good", "Cushion"), Entry(LAWS.name, "broken", "no_such_module:Law", "elsewhere")])
    assert found.load(LAWS, "good") is Cushion
    with pytest.raises(
        PluginError, match=r"'broken' of elsewhere .* could not be imported .*No module named 'no_such_mod"
    ):
        found.load(LAWS, "broken")


def test_two_parts_of_one_name_are_an_error_that_names_both(parts):
    found = Registry([law("soft", "Cushion", "one"), law("soft", "Bare", "two"), law("other", "Cushion")])
    assert found.names(LAWS) == ("other", "soft")
    with pytest.raises(PluginError) as caught:
        found.load(LAWS, "soft")
    text = str(caught.value)
    assert "'soft' is a contact law in more than one distribution" in text
    assert "one (stand_in_parts:Cushion) and two (stand_in_parts:Bare)" in text
    assert "Uninstall one, or give it another name" in text
    rival = Registry([law("soft", "Cushion", "impactlab"), law("soft", "Bare", "two")])
    with pytest.raises(PluginError, match="Uninstall two, or give its part another name"):
        rival.load(LAWS, "soft")
    assert found.load(LAWS, "other") is Cushion, "a quarrel over one name leaves the others alone"


def test_unknown_name_gives_the_closest_and_the_sorted_list(parts):
    found = Registry([law("soft", "Cushion"), law("cushion", "Cushion")])
    with pytest.raises(PluginError) as caught:
        found.load(LAWS, "sofd")
    assert str(caught.value) == (
        "'sofd' is not a contact law. Did you mean 'soft'?\nInstalled: cushion, soft (see `impactlab plugins`)."
    )
    with pytest.raises(PluginError, match="None is installed: install impactlab itself"):
        found.load(MODELS, "modal")
    complete = Registry([Entry(LAWS.name, "penalty", "impactlab.contact.penalty:Penalty", "impactlab")])
    with pytest.raises(PluginError, match="None is installed: install the plugin that has it, then"):
        complete.load(MECHANISMS, "scotch_yoke")


def case_with(tmp_path, law_block: str, found: Registry):
    text = f"""\
schema_version: 1
bodies: {{hammer: {{kind: mass, mass: 1}}, wall: {{kind: wall}}}}
contacts:
  - between: [hammer, wall]
    law: {law_block}
solve: {{duration: 1, step: {{dt: 1e-3}}}}
"""
    path = tmp_path / "case.yaml"
    path.write_text(text)
    return load_case(path, registry=found)


@pytest.fixture
def found(parts):
    newmark = [entry for entry in registry().entries if entry.name == "newmark"]
    return Registry([law("cushion", "Cushion"), law("listy", "Listy"), *newmark])


def test_fields_of_a_part_are_its_parameters(tmp_path, found):
    case = case_with(
        tmp_path, "{kind: cushion, stiffness: 2 kN/mm, layers: 2, wet: true, shape: round, limit: none}", found
    )
    assert laws_of(*case.simulation())[0] == Cushion(2e6, 2, True, "round", "none")
    case = case_with(tmp_path, "{kind: cushion, stiffness: {relative: 0.8}, limit: 5}", found)
    assert laws_of(*case.simulation())[0] == Cushion(Relative(0.8), limit=5.0)
    assert case.resolved()["contacts"][0]["law"] == {
        "kind": "cushion", "stiffness": {"relative": 0.8}, "layers": 3, "wet": False, "shape": "flat", "limit": 5.0,
    }  # fmt: skip


def test_a_field_that_no_case_can_give_is_the_fault_of_the_plugin(tmp_path, found):
    with pytest.raises(PluginError, match=r"the field 'items' of .*Listy has the type"):
        case_with(tmp_path, "{kind: listy, stiffness: 1}", found)


def test_groups_have_one_noun_each():
    assert len({group.noun for group in GROUPS}) == len(GROUPS)
