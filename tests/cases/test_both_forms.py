"""Examples of the docs in two forms, a case file and Python: both are one case."""

from __future__ import annotations

import ast
import contextlib
import importlib
import re
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from ruamel.yaml import YAML

import impactlab as il
from impactlab import plugins
from tests.cases.pages import Page
from tests.support import ROOT

DOCS = ROOT / "docs"
REST = {"solve": {"duration": 1e-4, "tolerance": 1e-2}}  # of an example that shows bodies and contacts alone
BLOCK = re.compile(r"^```(yaml|python)\n(.*?)^```$", flags=re.MULTILINE | re.DOTALL)
TABS = re.compile(r"^::::\{tab-set\}\n(.*?)^::::$", flags=re.MULTILINE | re.DOTALL)
SCRIPTS = sorted(path for folder in ("tutorials", "examples") for path in (DOCS / folder).glob("*.py"))
NO_CASE = {"bench": "families:", "conventions": "probes:"}  # blocks of YAML that are no whole case, by a word in them


class Pair(NamedTuple):
    """An example in both forms, and the page above it."""

    page: Path
    above: str
    file: str
    python: str


def pages() -> list[Path]:
    return [ROOT / "README.md", *sorted(page for page in DOCS.rglob("*.md") if "generated" not in page.parts)]


def pairs() -> list[Pair]:
    """Return the sets of tabs of all pages, and the two blocks of the README."""
    found = []
    for page in pages():
        text = page.read_text(encoding="utf-8")
        for tabs in [text] if page.name == "README.md" else [each[1] for each in TABS.finditer(text)]:
            blocks = dict(BLOCK.findall(tabs))
            if blocks.keys() == {"yaml", "python"}:
                found.append(Pair(page, text.partition(tabs)[0], blocks["yaml"], blocks["python"]))
    return found


PAIRS = pairs()


def read(text: str) -> dict[str, Any]:
    return YAML(typ="safe").load(text)


def define(python: str, names: dict[str, Any]) -> list[il.Case]:
    """Run the lines of Python that need no result of a run, and return the cases that they define."""
    before = dict(names)
    for node in ast.parse(python).body:
        assigned = isinstance(node, ast.Assign) and not re.search(r"\b(run|sweep|subplots)\(", ast.unparse(node))
        if assigned or isinstance(node, (ast.Import, ast.ImportFrom, ast.FunctionDef)):
            with contextlib.suppress(NameError):  # of a result
                exec(compile(ast.Module([node], []), "page", "exec", dont_inherit=True), names)
    return [case for name, case in names.items() if isinstance(case, il.Case) and before.get(name) is not case]


def test_every_case_in_a_file_stands_beside_its_python() -> None:
    for page in pages():
        blocks = [text for kind, text in BLOCK.findall(page.read_text(encoding="utf-8")) if kind == "yaml"]
        files = [text for text in blocks if NO_CASE.get(page.stem, "\0") not in text]
        assert files == [pair.file for pair in PAIRS if pair.page == page], page.name


@pytest.mark.parametrize("pair", PAIRS, ids=lambda pair: f"{pair.page.stem}-{pair.above.count(chr(10))}")
def test_both_forms_are_one_case(pair: Pair, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = pair.page.read_text(encoding="utf-8")
    if "```toml" in text:  # the page registers a part of its own
        registry = Page(pair.page.stem).registry(tmp_path, monkeypatch)
        monkeypatch.setattr(plugins, "registry", lambda: registry)
    names: dict[str, Any] = {}
    file: dict[str, Any] = {}
    for other in (each for each in PAIRS if each.page == pair.page and len(each.above) < len(pair.above)):
        define(other.python, names)
        file = read(other.file)
    given = read(pair.file)
    cases = define(pair.python, names)
    [made] = cases or [il.Case(bodies=names["bodies"], contacts=names["contacts"], **REST)]
    if "bodies" in given:
        assert made.resolved() == il.Case.from_dict({**REST, **given}).resolved()
    else:  # methods of the case above
        [name] = given["methods"]
        assert made.resolved() == {**il.Case.from_dict({**file, **given}).method(name).resolved(), "methods": []}


def test_a_case_of_a_script_stands_in_tabs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(DOCS / "_ext"))
    both_forms = importlib.import_module("both_forms")
    case = il.Case(bodies={"wall": il.Wall(), "ball": il.Mass(1.0)}, solve={"duration": 1e-3, "tolerance": 1e-2})
    comment = both_forms.scraped(None, {"src_file": "", "example_globals": {"case": case, "again": case}}, {})
    code = ".. code-block:: Python\n\n    case = 1\n\n"
    head = f"Title\n\n{both_forms.START} 1-2\n\n"
    page = both_forms.tabbed(f"{head}{code}\n{comment}\n.. image:: one.png\n")
    assert [line.strip() for line in page.splitlines() if "tab-item" in line] == [
        ".. tab-item:: Python",
        ".. tab-item:: File",
    ]
    assert page.startswith(head)
    assert "case file" not in page
    assert page.index("case = 1") < page.index("bodies: ") < page.index(".. image:: one.png")


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_cases_of_scripts_are_the_same_as_files(script: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The site shows a case of a script in a second tab, as the text of its file."""
    cases = define(script.read_text(encoding="utf-8"), {"__name__": script.stem})
    assert cases
    monkeypatch.syspath_prepend(str(DOCS / "_ext"))
    both_forms = importlib.import_module("both_forms")
    for case in cases:
        file = tmp_path / f"{case.name}.yaml"
        file.write_text(both_forms.file_of(case), encoding="utf-8")
        again = il.load_case(file)
        assert again.method(case.method_name).resolved() == case.resolved()


def rows() -> list[tuple[str, str, str]]:
    """Return the rows of the table of parts: of what, in a file, in Python."""
    part = (DOCS / "cases-in-python.md").read_text(encoding="utf-8").partition("## Parts of a case")[2]
    found, of = [], ""
    for line in part.partition("\n## ")[0].splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if len(cells) == 4 and "`" in line:
            of = cells[0] or of
            found.append((of, cells[2].strip("`"), cells[3].strip("`")))
    return found


@pytest.mark.parametrize(("of", "file", "python"), rows(), ids=[f"{of}-{file[:24]}" for of, file, _ in rows()])
def test_a_part_is_the_same_in_both_forms(of: str, file: str, python: str) -> None:
    given = eval(f"{{{python}}}" if python.startswith('"') else f"dict({python})")
    assert given == read(file)
    rod = {"length": "0.3 m", "diameter": "20 mm", "material": "steel"} if "segments" not in given else {}
    solve = {"duration": "0.3 ms"} | ({} if "tolerance" in given else {"model": {"kind": "modal", "modes": 20}})
    if "tolerance" not in given:
        solve |= {"integrator": {"kind": "newmark"}, "step": {"points_per_period": 20}}
    law = {} if of == "solve" and "tolerance" in given else {"law": {"kind": "penalty", "stiffness": 1e8}}
    place = {"a rod": rod, "a contact": law, "solve": solve, "the case": (others := {})}[of]
    place |= given
    case = il.Case(
        bodies={"hammer": il.Mass("0.74 kg", velocity="1 m/s"), "rod": il.Rod(**rod)},
        contacts=[il.Contact("hammer", "rod.left", **law)],
        solve=solve,
        **others,
    )
    assert case.method_name == "base"


def test_the_first_page_of_code_runs_as_printed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    page = (DOCS / "start.md").read_text(encoding="utf-8")
    names: dict[str, Any] = {}
    for block in re.findall(r"^```python\n(.*?)^```$", page, flags=re.M | re.S):
        exec(block, names)
    first, second = names["history"].contacts
    assert f"leaves after {1e6 * first.end:.0f} µs with a peak force of {first.peak_force / 1e3:.1f} kN" in page
    assert f"at {1e6 * second.start:.0f} µs: a second contact of {1e6 * (second.end - second.start):.0f} µs" in page
    assert names["by_elements"].evaluate(1e-5, "force:hammer|rod.left") == pytest.approx(names["force"][0], rel=0.1)
    assert names["waves"].total == pytest.approx(
        names["history"].evaluate(names["waves"].time, "strain:rod@0.15"), abs=1e-12
    )
    # Sums of equal instants miss a jump by at most half an interval: a peak of 27.2 kN, 3e-4/4096 s, 1.3 N s.
    assert names["spectrum"][0] == pytest.approx(first.impulse + second.impulse, rel=4e-3)
    assert names["data"]["stress"].attrs["units"] == "Pa"
    assert names["field"].x.shape == names["field"].values.shape
