"""The grid of methods: what a family makes of a case, and what a wrong grid file is told."""

from __future__ import annotations

from pathlib import Path

import pytest

from impactlab import CaseError, ImpactlabError, load_case, run
from impactlab.bench.cells import case_files, cells, laws_left_out
from impactlab.bench.grid import BUILT_IN, Family, chosen, of_suite, own_families, read_grid
from impactlab.scene.method import laws_of
from tests.support import CASES

PAPER, PILE = CASES / "axial_impact.yaml", CASES / "ram_cushion_pile.yaml"

GRID = """
schema_version: 1
families:
  spring:
    for: a test
    law: {kind: penalty}
    model: {kind: finite_element, mass: lumped}
    integrator: {kind: central_difference}
    step: {courant: 1.0}
    levels:
      model.elements: [10, 20, 30]
      law.stiffness: [{relative: 0.5}, {relative: 0.25}, {relative: 0.1}]
  spring_0.9: {sibling_of: spring, model: {kind: modal}, levels: {model.modes: [2, 4]}}
"""


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "own.yaml"
    path.write_text(text)
    return path


def test_a_grid_extends_the_common_one(tmp_path: Path) -> None:
    common = read_grid(BUILT_IN)
    own = GRID.replace("families:", "extends: builtin\nfamilies:").replace("spring_0.9:", f"{common[0].name}:")
    extended = read_grid(written(tmp_path, own))
    assert [each.name for each in extended] == [*(each.name for each in common), "spring"]
    assert extended[0].sibling_of == "spring"  # in place of the common one of that name
    with pytest.raises(CaseError, match="'others' is not a grid that can be extended"):
        read_grid(written(tmp_path, own.replace("builtin", "others")))


def test_levels_take_the_first_of_each_list_then_the_second(tmp_path: Path) -> None:
    spring, other = read_grid(written(tmp_path, GRID))
    case = load_case(PAPER)
    made = [spring.values(*case.simulation(), level) for level in spring.levels]
    assert [each["solve.model"]["elements"] for each in made] == [10, 20, 30]
    assert [each["contacts.0.law"]["stiffness"] for each in made] == [{"relative": s} for s in (0.5, 0.25, 0.1)]
    assert spring.law == {"kind": "penalty"}  # a level is no change of its family
    assert other.sibling_of == "spring"
    method = case.solved_by("spring", made[1]).simulation().method
    assert method.models["rod"].elements == 20  # type: ignore[attr-defined]
    assert method.step.courant == 1.0


def test_a_physical_law_keeps_its_place_and_a_hard_one_is_replaced(tmp_path: Path) -> None:
    spring = read_grid(written(tmp_path, GRID))[0]
    pile = load_case(PILE)
    assert [law.hard for law in laws_of(*pile.simulation())] == [False, True]
    made = spring.values(*pile.simulation(), spring.levels[0])
    assert [path for path in made if path.startswith("contacts")] == ["contacts.1.law"]
    solved = pile.solved_by("spring", made)
    assert laws_of(*solved.simulation())[0] == laws_of(*pile.simulation())[0]
    assert solved.written is pile.simulation().method  # errors are measured against the case as written


def test_the_methods_of_a_case_join_as_they_are() -> None:
    case = load_case(PAPER)
    own = {family.name: family for family in own_families(case)}
    assert set(own) == {f"own.{name}" for name in case.method_names}
    scene = case.solved_by("own.modal_10", own["own.modal_10"].values(*case.simulation(), {})).simulation()
    assert scene == case.method("modal_10").simulation()
    assert case.solved_by("own.base", own["own.base"].values(*case.simulation(), {})).simulation() == case.simulation()


def test_the_built_in_grid_serves_the_papers_case() -> None:
    families = read_grid(BUILT_IN)
    assert len(families) >= 20
    case = load_case(PAPER)
    for family in families:
        assert family.purpose, family.name
        if family.serves(*case.simulation()):
            # Only the first level: that all of them are accepted is the matter of the bench itself.
            case.solved_by(family.name, family.values(*case.simulation(), family.levels[0]))


def test_each_special_step_has_its_sibling_with_an_ordinary_one() -> None:
    families = {family.name: family for family in read_grid(BUILT_IN)}
    special = {family.sibling_of for family in families.values() if family.sibling_of}
    assert {name for name, family in families.items() if (family.step or {}).get("courant") == 1.0} == special
    for family in families.values():
        if family.sibling_of is not None:
            assert (family.step or {})["courant"] == 0.9
            assert (families[family.sibling_of].step or {})["courant"] == 1.0
            assert family.levels == families[family.sibling_of].levels


def test_a_suite_may_have_a_grid_of_its_own() -> None:
    assert of_suite("standard") == BUILT_IN
    assert of_suite("no/such") == BUILT_IN


def test_levels_that_change_nothing_are_one_row_and_equal_methods_share_a_key(tmp_path: Path) -> None:
    # In a case without hard contact the stiffness of a stand-in has nothing to act on.
    ladder = Family("ladder", "", law={"kind": "penalty"}, levels=({"law.stiffness": 1e8}, {"law.stiffness": 1e9}))
    alone = tmp_path / "alone.yaml"
    text = PAPER.read_text().replace("law: {kind: wave_identification}", "law: {kind: hertz, stiffness: 1e12}")
    alone.write_text(text.partition("methods:")[0] + "methods:\n  same: {solve.events: dated}\n")
    found, jobs = cells([alone], "standard", [ladder])
    assert [(cell.method, cell.level) for cell in found] == [("ladder", 1), ("own.base", 1), ("own.same", 1)]
    assert len({cell.key for cell in found}) == len(jobs) == 1


def test_a_law_that_no_contact_takes_is_named_with_the_settings_that_replace_a_physical_one() -> None:
    law = {"kind": "hunt_crossley", "stiffness": 1.58e10, "restitution": 0.9}
    modes = {"model": {"kind": "modal"}, "levels": ({"model.modes": 10},)}
    kept, put = Family("kept", "", law=law, **modes), Family("put", "", settings={"contacts.0.law": law}, **modes)
    families = (*read_grid(BUILT_IN), kept, put)
    found, _ = cells([CASES / "sphere_on_beam.yaml", PAPER], "standard", families)
    (text,) = laws_left_out(found, families, "standard")  # of an own grid alone
    assert text.startswith("kept: its law replaces hard contact alone, and sphere_on_beam has physical laws")
    assert "settings: {contacts.0.law: {kind: hunt_crossley, ...}}" in text
    case = load_case(CASES / "sphere_on_beam.yaml")
    settings = {cell.method: cell.settings for cell in found if cell.case == "sphere_on_beam"}
    laws = {name: case.solved_by(name, settings[name]).simulation().method.laws for name in ("kept", "put")}
    assert [type(law).__name__ for laws_of in laws.values() for law in laws_of.values()] == ["Hertz", "HuntCrossley"]


def test_methods_are_chosen_by_name() -> None:
    families = read_grid(BUILT_IN)
    assert [family.name for family in chosen(families, ["exact", "own"])] == ["exact"]
    assert chosen(families, None) == families
    with pytest.raises(CaseError, match=r"no method 'exakt'.*Did you mean 'exact'"):
        chosen(families, ["exakt"])


def test_a_method_that_the_case_refuses_is_a_cell(tmp_path: Path) -> None:
    wrong = Family("wrong", "", model={"kind": "modal", "elements": 2, "modes": 99}, step={"dt": 1e-7})
    found, jobs = cells([PAPER], "standard", [wrong], methods=["wrong"])
    assert len(found) == len(jobs) == 1


@pytest.mark.parametrize(
    ("old", "new", "line", "said"),
    [
        ("for: a test", "fro: a test", 5, "unknown key 'fro'. Did you mean 'for'"),
        ("schema_version: 1", "schema_version: 7", 2, "a grid needs schema_version: 1"),
        ("[10, 20, 30]", "[10, 20]", 10, "lists of different lengths: model.elements 2, law.stiffness 3"),
        ("[10, 20, 30]", "10", 11, "10 is not a list of values"),
        (
            "sibling_of: spring",
            "sibling_of: sprung",
            13,
            "'sprung' is not a family of this grid. Did you mean 'spring'",
        ),
        ("law: {kind: penalty}", "law: penalty", 6, "'penalty' is not a block of keys"),
        ("for: a test", "scenes: all", 5, "'all' is not a choice of scenes"),
        ("spring_0.9:", "own.spring:", 13, "reserved for the methods of cases"),
    ],
)
def test_a_wrong_grid_is_refused_with_its_place(tmp_path: Path, old: str, new: str, line: int, said: str) -> None:
    assert old in GRID
    with pytest.raises(CaseError) as told:
        read_grid(written(tmp_path, GRID.replace(old, new)))
    assert said in told.value.text
    assert told.value.remedy
    assert f"own.yaml:{line}: " in str(told.value)


@pytest.mark.parametrize(("text", "said"), [("[a, b]", "a list of 2"), ("", "nothing"), ("7", "7")])
def test_a_grid_that_is_no_block_is_refused_with_the_form_of_a_grid(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(CaseError, match=f"the file holds {said}; a grid has the keys") as raised:
        read_grid(written(tmp_path, text))
    assert raised.value.file == str(tmp_path / "own.yaml")
    assert "families" in raised.value.remedy
    assert "impactlab new" not in str(raised.value)


def test_a_suite_without_cases_is_refused_with_its_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cases" / "hard").mkdir(parents=True)
    with pytest.raises(CaseError, match="there are no cases in 'cases/hard'"):
        case_files([], "hard")
    with pytest.raises(CaseError, match="two cases are called 'axial_impact'"):
        case_files([PAPER, tmp_path / "axial_impact.yaml"], "standard")


def test_without_a_folder_of_cases_a_suite_is_that_of_the_bundled_cases(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    files = case_files([], "standard")
    assert "axial_impact" in {file.stem for file in files}
    assert len(files) > 30
    hard = {file.stem for file in case_files([], "hard")}
    assert {"zeno", "grazing"} <= hard
    assert "axial_impact" not in hard
    (tmp_path / "cases").mkdir()  # a folder of one's own, still empty
    with pytest.raises(CaseError, match="there are no cases in 'cases'"):
        case_files([], "standard")


def test_the_grid_on_its_page_is_one(tmp_path: Path) -> None:
    page = (CASES.parent / "docs" / "bench.md").read_text()
    (family,) = read_grid(written(tmp_path, page.partition("```yaml\n")[2].partition("```")[0]))
    assert family == next(each for each in read_grid(BUILT_IN) if each.name == family.name)


def test_families_of_beams_serve_scenes_with_beams_alone() -> None:
    """The exact solver of rods is not tried on a beam, whatever its contact."""
    families = {family.name: family for family in read_grid(BUILT_IN)}
    beam = load_case(CASES / "mass_on_cantilever_middle.yaml").simulation()
    rod = load_case(CASES / "axial_impact.yaml").simulation()
    for name in ("beam_modes", "beam_elements", "beam_explicit"):
        assert families[name].serves(*beam)
        assert not families[name].serves(*rod)
    assert not families["exact"].serves(*beam)
    assert families["exact"].serves(*rod)


def test_families_of_mechanisms_serve_scenes_with_mechanisms_alone() -> None:
    families = {family.name: family for family in read_grid(BUILT_IN)}
    arm, rod = (load_case(CASES / name).simulation() for name in ("arm_on_stop.yaml", "two_rods.yaml"))
    own = [name for name, family in families.items() if family.scenes == "mechanisms"]
    assert len(own) == 6
    assert all(families[name].serves(*arm) and not families[name].serves(*rod) for name in own)
    assert families["automatic"].serves(*arm)
    assert not families["central_difference"].serves(*arm)  # links have no mesh of their own


def test_each_level_for_mechanisms_completes_or_is_refused_in_plain_words() -> None:
    families = {family.name: family for family in read_grid(BUILT_IN)}
    case = load_case(CASES / "arm_on_stop.yaml").with_("solve.duration", 2.0e-4)
    reasons = {}
    for name, family in families.items():
        if family.scenes != "mechanisms":
            continue
        for level in family.levels:
            try:
                run(case.solved_by(name, family.values(*case.simulation(), level)))
            except ImpactlabError as error:
                reasons.setdefault(name, []).append((error.text, bool(error.remedy)))
    assert not reasons.keys() & {"mechanism_steps", "mechanism_located", "mechanism_modes"}
    assert all("needs constant matrices" in text and remedy for text, remedy in reasons["mechanism_schemes"])
    assert reasons["mechanism_models"] == [("link 'arm' needs modes of a mesh", True)] * 3
