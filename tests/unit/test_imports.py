"""No import circle, no import of our own inside a function; packages meet in records; body kinds are open."""

from __future__ import annotations

import ast
import gc
import re
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from typing import NamedTuple

import pytest

import impactlab
from impactlab.integrators.base import AbstractIntegrator
from impactlab.scene import bodies
from impactlab.types import Port

ROOT = Path(impactlab.__file__).parent


class Import(NamedTuple):
    """A module that another one needs, and whether the import stands inside a function."""

    name: str
    inside: bool


def modules(root: Path) -> dict[str, Path]:
    """Return all modules of a package by their full names."""
    files = {".".join(path.relative_to(root.parent).with_suffix("").parts): path for path in root.rglob("*.py")}
    return {name.removesuffix(".__init__"): path for name, path in files.items()}


parsed = cache(ast.parse)  # a text is looked at for several things


@pytest.fixture(scope="module", autouse=True)
def _forgotten() -> Iterator[None]:
    """Keep the garbage collector from its walks over the trees, a million objects, and forget them at the end."""
    gc.disable()
    yield
    parsed.cache_clear()
    gc.enable()


@cache
def imports_of(text: str) -> tuple[Import, ...]:
    """Return all names that a source imports: anywhere, under TYPE_CHECKING too, and by `lazy`."""

    found, ahead = [], [(parsed(text), False)]
    while ahead:
        node, inside = ahead.pop()
        match node:
            case ast.Import(names=names):
                found += [Import(each.name, inside) for each in names]
            case ast.ImportFrom(module=str(module), names=names):
                found += [Import(f"{module}.{each.name}", inside) for each in names]
            case ast.Call(func=ast.Name(id="lazy"), args=[ast.Constant(value=str(name))]):
                found.append(Import(name, inside))
        inside = inside or isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)
        ahead += [(child, inside) for child in ast.iter_child_nodes(node)]
    return tuple(found)


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


# Bases are shapes of meshes, and the modal model is made of them; a method names the base class of models, which read
# bodies.
MUTUAL = {("bases", "models"), ("models", "scene")}


def test_no_other_packages_import_each_other() -> None:
    pairs = {
        tuple(name.split(".")[1] for name in (one, other))
        for one, needs in graph(ROOT).items()
        for other in needs
        if one.count(".") and other.count(".")
    }
    assert len(pairs) > 100
    assert {(one, other) for one, other in pairs if one < other and (other, one) in pairs} == MUTUAL


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
EXACT = CHECKED.replace("'check', sys.argv[1]", "'run', sys.argv[1], '--method', 'continuous'")
STEPS = {"impactlab.simulate.stepped_run", "impactlab.simulate.stepping.loop", "impactlab.refine.references.converged"}


@pytest.mark.parametrize(
    ("code", "unwanted"),
    [
        ("import impactlab.api", {"numba", "scipy", "matplotlib", "pandas"}),
        (CHECKED, {"numba.np.arraymath", "impactlab.simulate.driver", "impactlab.refine", "matplotlib"}),
        (EXACT, STEPS | {"scipy.linalg", "matplotlib"}),
    ],
)
def test_check_and_the_api_load_no_module_that_only_a_run_needs(code: str, unwanted: set[str]) -> None:
    loaded = f"import atexit; atexit.register(lambda: print(*sys.modules, file=sys.stderr)); import sys; {code}"
    case = ROOT.parent / "cases" / "axial_impact.yaml"
    done = subprocess.run([sys.executable, "-c", loaded, case], capture_output=True, text=True, check=True)
    assert not unwanted & set(done.stderr.split())


ADAPTIVE = """
import sys
import impactlab as il
from impactlab.simulate.plan import prepare
case = il.Case(bodies={"ball": il.Mass(1.0, velocity=1.0), "wall": il.Wall()},
               contacts=[il.Contact("ball", "wall", {"kind": "hertz", "stiffness": 1e9})],
               solve={"duration": 1e-3, "integrator": {"kind": "adaptive"}})
prepare(*case.built)
before = set(sys.modules)
il.run(case)
print(*(name for name in set(sys.modules) - before if name.startswith("scipy.integrate")))
"""


def test_an_adaptive_run_loads_its_solver_before_it_solves() -> None:
    """Its 1.5 s of loading were in the time to solve."""
    done = subprocess.run([sys.executable, "-c", ADAPTIVE], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


PLUGINS = ROOT.parent / "plugins"


@pytest.mark.parametrize("room", ["integrators", "contact", "models", "bases", "simulate/adaptive", "exact"])
def test_rooms_import_no_parts_of_another_kind(room: str) -> None:
    forbidden = {"integrators": "contact", "contact": "integrators|models|bases", "models": "contact|integrators"}
    others = forbidden.get(room, "contact|integrators")
    # The bases, abstract, are where rooms meet.
    pattern = rf"^\s*(?:from|import) impactlab\.(?:{others})\.(?!base\b)\w+"
    for path in sorted((ROOT / room).rglob("*.py")):
        assert re.findall(pattern, path.read_text(encoding="utf-8"), re.MULTILINE) == [], path.name


def test_no_law_reads_where_the_force_of_a_scheme_acts() -> None:
    # A port has the values there; that a scheme's F dt holds a closing jump is all that a law reads of it.
    facts = set(AbstractIntegrator.__annotations__) - {"jump_in_force"}
    assert {"load_point", "velocity_point", "projects_first"} < facts
    assert not facts & {name for name, _ in Port._fields_}
    files = [*(ROOT / "contact").glob("*.py"), *PLUGINS.glob("*/*/law.py")]
    assert len(files) > 15
    for path in files:
        tree = ast.parse(path.read_text(encoding="utf-8"))
        read = {node.attr for node in ast.walk(tree) if isinstance(node, ast.Attribute)}
        assert not read & facts, path.name


ROOMS = ("scene/bodies", "models", "simulate/planning/building.py", "casefile", "report")
NOT_BODIES = {"End", "Profile", "Rayleigh", "Table"}
CLASSES = {name for name, each in vars(bodies).items() if isinstance(each, type)} - NOT_BODIES
WORDS = {"rod", "beam", "shaft", "wall"}  # `mass` is an end, too
FILES = sorted(path for path in ROOT.rglob("*.py") if not path.relative_to(ROOT).as_posix().startswith(ROOMS))


def asked_kinds(tree: ast.AST) -> Iterator[str]:
    """Give the tests of the class of a body, or of its name of a kind, each as it is written."""

    def names(node: ast.AST) -> set[str]:
        return {each.id for each in ast.walk(node) if isinstance(each, ast.Name)} | {
            each.attr for each in ast.walk(node) if isinstance(each, ast.Attribute)
        }

    for node in ast.walk(tree):
        called = isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
        if called and node.func.id in ("isinstance", "issubclass") and names(node.args[1]) & CLASSES:
            yield ast.unparse(node)
        if isinstance(node, ast.MatchClass) and names(node.cls) & CLASSES:
            yield ast.unparse(node)
        if isinstance(node, ast.Compare):
            sides = [node.left, *node.comparators]
            asked = {each.attr for each in sides if isinstance(each, ast.Attribute)}
            words = {each.value for side in sides for each in ast.walk(side) if isinstance(each, ast.Constant)}
            typed = any(isinstance(each, ast.Call) and "type" in names(each.func) for each in sides)
            if ("kind" in asked and words & WORDS) or (typed and set().union(*map(names, sides)) & CLASSES):
                yield ast.unparse(node)


@pytest.mark.parametrize(
    "text",
    [
        "isinstance(body, Rod | Mass)",
        "isinstance(body, (bodies.Beam, int))",
        "type(body) is Shaft",
        "body.kind == 'beam'",
        "body.kind in ('rod', 'beam')",
        "match body:\n    case Wall():\n        pass",
    ],
)
def test_each_way_to_test_a_kind_is_found(text: str) -> None:
    assert len(list(asked_kinds(ast.parse(text)))) == 1


def test_no_module_outside_the_rooms_tests_the_kind_of_a_body() -> None:
    assert len(FILES) > 100
    found = {
        path.relative_to(ROOT).as_posix(): list(asked_kinds(parsed(path.read_text(encoding="utf-8")))) for path in FILES
    }
    # The facts of a side name the equation that a law sees: those of a shaft say rod.
    assert {name: tests for name, tests in found.items() if tests and not name.startswith("contact/")} == {}
