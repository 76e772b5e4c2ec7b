"""Modules of the package form no import circle, and none imports another inside a function."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from typing import NamedTuple

import pytest

import impactlab

ROOT = Path(impactlab.__file__).parent


class Import(NamedTuple):
    """A module that another one needs, and whether the import stands inside a function."""

    name: str
    inside: bool


def modules(root: Path) -> dict[str, Path]:
    """Return all modules of a package by their full names."""
    files = {".".join(path.relative_to(root.parent).with_suffix("").parts): path for path in root.rglob("*.py")}
    return {name.removesuffix(".__init__"): path for name, path in files.items()}


def imports_of(text: str) -> Iterator[Import]:
    """Give all names that a source imports: anywhere, under TYPE_CHECKING too, and by `lazy`."""

    def walk(node: ast.AST, inside: bool) -> Iterator[Import]:
        for child in ast.iter_child_nodes(node):
            match child:
                case ast.Import(names=names):
                    yield from (Import(each.name, inside) for each in names)
                case ast.ImportFrom(module=str(module), names=names):
                    yield from (Import(f"{module}.{each.name}", inside) for each in names)
                case ast.Call(func=ast.Name(id="lazy"), args=[ast.Constant(value=str(name))]):
                    yield Import(name, inside)
            yield from walk(child, inside or isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda))

    yield from walk(ast.parse(text), False)


def needed(name: str, known: dict[str, Path], by: str) -> set[str]:
    """Return the modules that an import loads: its own, and the packages it lies in unless the importer lies there."""
    parts = name.split(".")
    loaded = {".".join(parts[:count]) for count in range(1, len(parts) + 1)}
    return {each for each in loaded & known.keys() if each != by and not by.startswith(f"{each}.")}


def graph(root: Path) -> dict[str, set[str]]:
    """Return the modules that each module of a package needs."""
    known = modules(root)
    sources = {name: path.read_text(encoding="utf-8") for name, path in known.items()}
    return {
        name: {each for found in imports_of(text) for each in needed(found.name, known, name)}
        for name, text in sources.items()
    }


def circle(needs: dict[str, set[str]]) -> list[str]:
    """Return one import circle, empty where there is none."""
    try:
        TopologicalSorter(needs).prepare()
    except CycleError as found:
        return list(found.args[1])
    return []


def test_the_modules_form_no_circle() -> None:
    found = graph(ROOT)
    assert len(found) > 200
    assert circle(found) == []


def test_no_module_imports_another_inside_a_function() -> None:
    inside = {
        name: [found.name for found in imports_of(path.read_text(encoding="utf-8")) if found.inside]
        for name, path in modules(ROOT).items()
    }
    assert {name: own for name, all_ in inside.items() if (own := [x for x in all_ if x.startswith("impactlab")])} == {}


@pytest.mark.parametrize("imported", ["import p.b", "from p import b", "from p.b import x", 'b = lazy("p.b")'])
def test_a_circle_is_found_however_it_is_imported(tmp_path: Path, imported: str) -> None:
    package = tmp_path / "p"
    package.mkdir()
    (package / "__init__.py").write_text("from p.a import y\n")  # a package may hold its own modules
    (package / "a.py").write_text(f"if TYPE_CHECKING:\n    {imported}\n")
    (package / "b.py").write_text("x = 1\n")
    assert circle(graph(package)) == []
    (package / "b.py").write_text("def late():\n    from p.a import y\n")
    assert set(circle(graph(package))) == {"p.a", "p.b"}


CHECKED = "import sys; sys.argv = ['impactlab', 'check', sys.argv[1]]; from impactlab.cli import main; main()"


@pytest.mark.parametrize(
    ("code", "unwanted"),
    [
        ("import impactlab.api", {"numba", "scipy", "matplotlib", "pandas"}),
        (CHECKED, {"numba.np.arraymath", "impactlab.simulate.driver", "impactlab.refine", "matplotlib"}),
    ],
)
def test_check_and_the_api_load_no_module_that_only_a_run_needs(code: str, unwanted: set[str]) -> None:
    loaded = f"import atexit; atexit.register(lambda: print(*sys.modules, file=sys.stderr)); import sys; {code}"
    case = ROOT.parent / "cases" / "axial_impact.yaml"
    done = subprocess.run([sys.executable, "-c", loaded, case], capture_output=True, text=True, check=True)
    assert not unwanted & set(done.stderr.split())
