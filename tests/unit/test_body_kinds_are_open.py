"""No module outside the rooms of bodies tests the kind of a body: a new kind is one file in each of these rooms."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

import impactlab
from impactlab.scene import bodies

ROOT = Path(impactlab.__file__).parent
ROOMS = ("scene/bodies", "models", "casefile", "report")
CLASSES = {name for name, each in vars(bodies).items() if isinstance(each, type)} - {
    "End",
    "Profile",
    "Rayleigh",
    "Table",
}
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
    found = {path.relative_to(ROOT).as_posix(): list(asked_kinds(ast.parse(path.read_text()))) for path in FILES}
    # The facts of a side name the equation that a law sees: those of a shaft say rod.
    assert {name: tests for name, tests in found.items() if tests and not name.startswith("contact/")} == {}
