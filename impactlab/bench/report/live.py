"""The data of the live diagram of a bench: completed runs of every scene, in three digits."""

from __future__ import annotations

import base64
import json
import zlib
from collections.abc import Callable, Sequence
from typing import Any

from impactlab.bench.report.method_styles import SHAPES, MethodStyles, methods_by_style
from impactlab.bench.report.scene_sheets import slug
from impactlab.bench.report.views import AUTOMATIC, BOTH, CLOCKS, NORMS, SceneRows, error
from impactlab.bench.schema import BASE, Row
from impactlab.report.figures.style import INK, PALETTE

UPWARDS: tuple[tuple[str, str, Callable[[Row, SceneRows], float | None]], ...] = (
    *((norm.title, norm.axis, lambda row, scene, norm=norm: error(row, norm, scene)) for norm in (BOTH, *NORMS)),
    ("energy gained", "energy gained, share of the reference energy", lambda row, _: row.energy_gain),
    (
        "energy lost",
        "energy lost that no formula explains, share of the reference energy",
        lambda row, _: row.energy_loss,
    ),
    ("force oscillation", "total variation of the force in excess, in peaks", lambda row, _: row.force_oscillation),
)
"""Title, label and value of each axis of the diagram; the errors come first."""
SIDEWAYS: tuple[tuple[str, str, Callable[[Row], float | None]], ...] = (
    ("time to solve", "s", CLOCKS["solve"]),
    ("time with set-up", "s", CLOCKS["total"]),
    ("steps", "", lambda row: row.steps),
    ("unknowns", "", lambda row: row.unknowns),
)


def bench_data(scenes: Sequence[SceneRows], styles: MethodStyles) -> str:
    """Return the data of all scenes as base64 of deflated JSON, as bench.js reads it."""
    methods = methods_by_style(scenes, styles)
    numbers = {name: number for number, name in enumerate(methods)}
    text = {
        "methods": [_method(name, scenes, styles) for name in methods],
        "upwards": [[title, label] for title, label, _ in UPWARDS],
        "errors": 1 + len(NORMS),  # how many of them are errors
        "sideways": [[title, unit] for title, unit, _ in SIDEWAYS],
        "scenes": [_scene(scene, numbers) for scene in scenes],
    }
    packed = zlib.compress(json.dumps(text, separators=(",", ":"), allow_nan=False).encode(), 9)
    return base64.b64encode(packed).decode("ascii")


def _method(name: str, scenes: Sequence[SceneRows], styles: MethodStyles) -> dict[str, Any]:
    families = [family for scene in scenes for family in (*scene.families, *scene.own) if family.method == name]
    colour, shape = styles.get(name, (INK, "*" if name == AUTOMATIC else "x"))
    return {
        "name": name,
        "colour": PALETTE.index(colour) if colour in PALETTE else None,  # None: in ink
        "shape": SHAPES.index(shape) if shape in SHAPES else shape,
        "special": any(family.special for family in families),
        "stepless": any(family.stepless for family in families),
    }


def _scene(scene: SceneRows, numbers: dict[str, int]) -> dict[str, Any]:
    runs = [row for row in scene.all_rows if row.completed]
    case, _, variant = scene.name.partition("/")
    return {
        "case": case,
        "variant": variant or BASE,
        "slug": slug(scene.name),
        "uncertainty": scene.uncertainty,
        "method": [numbers[row.method] for row in runs],
        "level": [row.level for row in runs],
        "up": [[_three(value(row, scene)) for row in runs] for _, _, value in UPWARDS],
        "right": [[_three(value(row)) for row in runs] for _, _, value in SIDEWAYS],
    }


def _three(value: float | None) -> float | int | None:
    """Return a value to three digits, whole numbers without a point."""
    if value is None:
        return None
    short = float(f"{value:.3g}")
    return int(short) if short.is_integer() and abs(short) < 1e15 else short
