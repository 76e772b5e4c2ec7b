"""Every refusal in the code of impactlab: text and remedy of each error that is raised, by room."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import impactlab

PACKAGE = Path(impactlab.__file__).parent
ERRORS = ("CaseError", "PairingError", "PluginError", "StepError", "ImpactlabError", "refuse", "failure")
ROOMS = {
    "Reading a case file": ("casefile",),
    "Bodies and their models": ("models", "bases", "scene"),
    "Contact laws and integrators": ("contact", "integrators"),
    "Planning and running": ("simulate", "refine", "api", "environment", "numerics"),
    "The exact solver": ("exact",),
    "Results and reports": ("history", "report", "metrics", "files", "animation"),
    "Benches and sweeps": ("bench", "sweeps"),
    "Parts and plugins": ("plugins", "testing", "cite", "cli"),
}


class Refusal(NamedTuple):
    """One error as the code raises it; values stand as ``…``."""

    text: str
    remedy: str
    room: str


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
        return written(node.body, named)
    return ""


def of_file(path: Path) -> Iterator[Refusal]:
    """Give the refusals of a module."""
    room = path.relative_to(PACKAGE).parts[0].removesuffix(".py")
    module = ast.parse(path.read_text(encoding="utf-8"))
    for function in (node for node in ast.walk(module) if isinstance(node, ast.FunctionDef)):
        named: dict[str, str] = {}
        for node in ast.walk(function):
            if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
                named[node.targets[0].id] = written(node.value, named) or named.get(node.targets[0].id, "")
        for node in ast.walk(function):
            call = node.exc if isinstance(node, ast.Raise) else None
            if not isinstance(call, ast.Call):
                continue
            name = getattr(call.func, "id", getattr(call.func, "attr", ""))
            text = written(call.args[0], named) if name in ERRORS and call.args else ""
            if text.strip("… "):
                remedy = next((written(each.value, named) for each in call.keywords if each.arg == "remedy"), "")
                yield Refusal(text, remedy, room)


def refusals() -> list[Refusal]:
    """Return all refusals of the package, each text once."""
    found = {each.text: each for path in sorted(PACKAGE.rglob("*.py")) for each in of_file(path)}
    return list(found.values())


def page() -> str:
    """Return the tables of all refusals, by room, in Markdown."""
    lines: list[str] = []
    known = refusals()
    for title, rooms in ROOMS.items():
        lines += ["", f"### {title}", "", "| message | what to do |", "|---|---|"]
        rows = sorted((each for each in known if each.room in rooms), key=lambda each: each.text.lstrip("…' ").lower())
        lines += [f"| {plain(each.text)} | {plain(each.remedy)} |" for each in rows]
    return "\n".join(lines)


def plain(text: str) -> str:
    """Return a text that Markdown shows as it is."""
    text = " ".join(text.split())
    for sign in "\\|<>*_[]{}$`":
        text = text.replace(sign, "\\" + sign)
    return text
