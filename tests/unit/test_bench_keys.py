"""The key of a row follows all that its errors depend on, and nothing else."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import pytest

import impactlab
from impactlab import CaseError, load_case
from impactlab.bench.cells import keys_of
from impactlab.bench.keys import content, digest, row_key
from impactlab.casefile import Case
from impactlab.jobs import sources
from impactlab.jobs.sources import sources_hash
from tests.support import CASES

TEXT = (CASES / "axial_impact.yaml").read_text()
SETTINGS: dict[str, Any] = {"solve.model": {"kind": "modal", "modes": 5}}


def case(tmp_path: Path, text: str = TEXT, name: str = "one") -> Case:
    path = tmp_path / f"{name}.yaml"
    path.write_text(text)
    return load_case(path)


def test_names_titles_comments_and_units_change_no_key(tmp_path: Path) -> None:
    known = keys_of(case(tmp_path), "a", SETTINGS)[0]
    commented = "# a new word\n" + TEXT.replace("length: 0.3", "length: 300 mm  # and one here")
    renamed = commented.replace("title: Axial", "title: Another axial").replace("penalty:", "spring:")
    assert keys_of(case(tmp_path, renamed, "another_name"), "b", dict(SETTINGS))[0] == known


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("mass: 2.133", "mass: 2.1330000000000001e0"),  # the same number
        ("mass: 2.133", "mass: 2.134"),
        ("velocity: 1.0", "velocity: 1.0000000000000002"),  # one bit
        ("gap: 0.0", "gap: 1.0e-9"),
        ("round_trips: 3", "round_trips: 4"),
        ("at: 0.15", "at: 0.16"),
        ("right: clamped", "right: free"),
    ],
)
def test_the_scene_changes_the_key(tmp_path: Path, old: str, new: str) -> None:
    assert old in TEXT
    same = float(old.partition(": ")[2]) == float(new.partition(": ")[2]) if "mass" in old else False
    changed = case(tmp_path, TEXT.replace(old, new), "two")
    assert (keys_of(changed, "a", SETTINGS)[0] == keys_of(case(tmp_path), "a", SETTINGS)[0]) is same


def test_the_method_and_the_physics_as_written_change_the_key(tmp_path: Path) -> None:
    one, law = case(tmp_path), {"contacts.0.law": {"kind": "penalty", "stiffness": 1e9}}
    soft = case(tmp_path, TEXT.replace("{kind: wave_identification}", "{kind: penalty, stiffness: 1e9}"), "soft")
    found = [
        keys_of(one, "a", {})[0],
        keys_of(one, "a", SETTINGS)[0],
        keys_of(one, "a", {"solve.model": {"kind": "modal", "modes": 6}})[0],
        keys_of(one, "a", law)[0],
        keys_of(soft, "a", law)[0],  # the same run, measured against a spring instead of the hard contact
        keys_of(one, "a", {"solve.model": {"kind": "modal", "elements": 2, "modes": 9}})[0],  # refused
        keys_of(one, "a", {"solve.model": {"kind": "modal", "elements": 2, "modes": 8}})[0],
    ]
    assert len(set(found)) == len(found)


def test_the_sources_the_environment_and_plugins_change_the_key(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    one = case(tmp_path)
    found = [row_key(one)]
    with monkeypatch.context() as patched:
        patched.setattr("impactlab.bench.keys.code_hash", lambda: "other sources")
        found.append(row_key(one))
    with monkeypatch.context() as patched:
        patched.setattr("impactlab.bench.keys.numeric_environment", lambda: {"numpy": "0.1"})
        found.append(row_key(one))
    with monkeypatch.context() as patched:
        patched.setattr("impactlab.bench.keys.plugin_modules", lambda *scenes: {"pytest"})
        found.append(row_key(one))
    assert len(set(found)) == len(found)
    assert row_key(one) == found[0]


def test_the_hash_of_sources_follows_names_and_bytes(tmp_path: Path) -> None:
    one, two = tmp_path / "one.py", tmp_path / "two.py"
    one.write_text("a")
    two.write_text("b")
    before = sources_hash([one, two], tmp_path)
    assert sources_hash([two, one], tmp_path) == before  # in whatever order they are found
    two.write_text("c")
    assert sources_hash([one, two], tmp_path) != before
    two.write_text("b")
    assert sources_hash([one, two], tmp_path) == before
    assert sources_hash([one, two.rename(tmp_path / "three.py")], tmp_path) != before


def test_code_that_only_shows_results_is_no_part_of_the_hash(tmp_path: Path) -> None:
    root = Path(impactlab.__file__).parent
    for name in (*sources.APART, sources.SUMMARY):
        assert (root / name).exists(), name
    assert not (root / "metrics" / "norms.py").relative_to(root).as_posix().startswith(sources.APART)


def test_numbers_count_to_the_last_bit_and_unknown_types_are_refused() -> None:
    assert digest(content({"a": 0.1})) != digest(content({"a": 0.1 + 1e-17 + 2e-17}))
    assert digest(content(float("nan"))) == digest(content(float("nan")))
    assert digest(content((1, 1.0))) == digest(content([1, 1.0]))

    @dataclasses.dataclass(frozen=True)
    class Holder:
        function: Any

    with pytest.raises(CaseError, match="a value of type 'function' cannot be a part of a key"):
        content(Holder(lambda x: x))
