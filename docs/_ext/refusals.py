"""Every refusal in the code of impactlab: text and remedy of each error that is raised, by package."""

from __future__ import annotations

import ast
import importlib
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import impactlab
from impactlab.casefile.values.faults import CHECK_FILE

PACKAGE = Path(impactlab.__file__).parent
CODE = re.compile(
    r"(`[^`]+`|(?<![\w-])--(?:[a-z][a-z-]*|…)(?: '[^']*')?)"
)  # in a message: a command, an option with its value
ERRORS = ("CaseError", "PairingError", "PluginError", "StepError", "ImpactlabError", "refuse", "failure")
PACKAGES = {
    "Reading a case file": ("casefile",),
    "Bodies and their models": ("models", "bases", "scene", "mechanisms"),
    "Contact laws and integrators": ("contact", "integrators"),
    "Planning and running": ("simulate", "refine", "api", "environment", "numerics"),
    "The exact solver": ("exact",),
    "Results and reports": ("history", "report", "metrics", "files"),
    "Benches and sweeps": ("bench", "sweeps"),
    "Sensitivities, fits and uncertainties": ("derivatives", "fits", "uncertainties"),
    "Bars, piles, drills and chains": ("hopkinson", "measurement", "piling", "drilling", "granular", "dispersion"),
    "Parts and plugins": ("plugins", "options", "testing", "cite", "cli"),
}


class Refusal(NamedTuple):
    """One error as the code raises it; values stand as ``…``."""

    text: str
    remedy: str
    package: str


def written(node: ast.expr | None, named: dict[str, str]) -> str:
    """Return the text of an expression, values as ``…``; empty where it holds no words."""
    if isinstance(node, ast.Constant):
        return str(node.value)
    if isinstance(node, ast.JoinedStr):
        return "".join(str(part.value) if isinstance(part, ast.Constant) else "…" for part in node.values)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        return written(node.left, named) + written(node.right, named)
    if isinstance(node, ast.Name):
        return named.get(node.id, "")
    if isinstance(node, ast.IfExp):
        return written(node.body, named) or written(node.orelse, named)
    if isinstance(node, ast.BoolOp):
        return written(node.values[-1], named)
    return ""


def assigned(node: ast.AST) -> Iterator[tuple[str, ast.expr]]:
    """Give the names that a statement assigns, with their values."""
    if isinstance(node, ast.Assign):
        target, value = node.targets[0], node.value
        several = isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple)
        for name, each in zip(target.elts, value.elts, strict=False) if several else [(target, value)]:
            if isinstance(name, ast.Name):
                yield name.id, each


def constants(module: ast.Module) -> dict[str, str]:
    """Return the texts that stand as constants in a module, also those that it imports."""
    found: dict[str, str] = {}
    for node in module.body:
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("impactlab."):
            loaded = importlib.import_module(str(node.module))
            texts = ((name.asname or name.name, getattr(loaded, name.name, None)) for name in node.names)
            found |= {name: text for name, text in texts if isinstance(text, str)}
        found |= {name: written(value, found) for name, value in assigned(node)}
    return found


def of_file(path: Path) -> Iterator[Refusal]:
    """Give the refusals of a module."""
    package = path.relative_to(PACKAGE).parts[0].removesuffix(".py")
    source = path.read_text(encoding="utf-8")
    if "raise " not in source:
        return
    module = ast.parse(source)
    fixed = constants(module)
    for function in (node for node in ast.walk(module) if isinstance(node, ast.FunctionDef)):
        named, inside = dict(fixed), list(ast.walk(function))
        for node in inside:
            for name, value in assigned(node):
                named[name] = written(value, named) or named.get(name, "")
        for node in inside:
            call = node.exc if isinstance(node, ast.Raise) else None
            if not isinstance(call, ast.Call):
                continue
            name = getattr(call.func, "id", getattr(call.func, "attr", ""))
            text = written(call.args[0], named) if name in ERRORS and call.args else ""
            if text.strip("… "):
                given = next((written(each.value, named) or "…" for each in call.keywords if each.arg == "remedy"), "")
                remedy = CHECK_FILE if name == "refuse" else given
                yield Refusal(text, remedy, package)


def refusals() -> list[Refusal]:
    """Return all refusals of the package, each text once."""
    found = {each.text: each for path in sorted(PACKAGE.rglob("*.py")) for each in of_file(path)}
    return list(found.values())


def page() -> str:
    """Return the tables of all refusals, by package, in Markdown."""
    lines: list[str] = []
    known = refusals()
    for title, packages in PACKAGES.items():
        lines += ["", f"### {title}", "", "| message | what to do |", "|---|---|"]
        here = [each for each in known if each.package in packages]
        rows = sorted(here, key=lambda each: each.text.lstrip("…' ").lower())
        lines += [f"| {plain(each.text)} | {plain(each.remedy)} |" for each in rows]
    return "\n".join(lines)


def plain(text: str) -> str:
    """Return a text that Markdown shows as it is, with options and commands as code, whose quotes stay straight."""
    pieces = CODE.split(" ".join(text.split()))
    return "".join(as_code(each) if CODE.fullmatch(each) else escaped(each) for each in pieces)


def as_code(text: str) -> str:
    """Return a command or an option as code in a table."""
    return "`" + text.strip("`").replace("|", "\\|") + "`"


def escaped(text: str) -> str:
    """Return a text with its signs of Markdown escaped."""
    for sign in "\\|<>*_[]{}$`":
        text = text.replace(sign, "\\" + sign)
    return text
