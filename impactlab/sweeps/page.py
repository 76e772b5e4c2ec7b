"""The page of a sweep: figures, and values of a chosen point with its command."""

from __future__ import annotations

import base64
import json
import math
import shlex
import zlib
from collections.abc import Collection
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from impactlab.report import facts
from impactlab.report.figures.figure_files import PageFigure, write_figures
from impactlab.report.page import write_study
from impactlab.report.provenance import Provenance
from impactlab.scene.problem import Scene
from impactlab.sweeps.axes import METHOD
from impactlab.sweeps.chunks import STATUSES
from impactlab.sweeps.plot_axes import fitted, in_order, places
from impactlab.sweeps.plots import ENDED, PANEL, axes_of, plot_sweep
from impactlab.sweeps.result import ABOUT, clauses, counts, labels_in, unit_of
from impactlab.sweeps.sampled import is_sampled
from impactlab.types import Array

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

MAX_VALUES = 600_000  # of all points that a page holds; of more points it holds some
CAPTION_LINE = "Dashed lines stand between different sequences of contacts; points without values are hatched."
CAPTION_MAP = "Lines are edges between different sequences of contacts; points without values are hatched."

CAPTION_POINTS = "Each point of the sweep over each of its numbers."
CAPTION_SEVERAL = "Each point of the sweep over each axis; lines are means over all other axes."


def write_page(
    folder: Path, found: xarray.Dataset, scene: Scene, origin: Provenance, again: str, links: Collection[str] = ()
) -> None:
    """Write ``index.html``, ``figures/``, ``case.yaml`` and ``citations.bib`` of a sweep.

    Parameters
    ----------
    folder : Path
        The folder of the sweep.
    found : Dataset
        Its result.
    scene : Scene
        The scene of the case.
    origin : Provenance
        Title, source, command and case of the sweep.
    again : str
        The command that runs the case, to which the settings of a point are added.
    links : collection of str
        Names of the contacts that are joined from the start.
    """
    dims = [str(dim) for dim in found["status"].dims]
    is_chosen = dims != ["point"] and len(dims) <= 2  # by a click in a figure, too
    names = [name for name in map(str, found.data_vars) if name not in ABOUT and not is_sampled(name)]
    figures, panels = [], {}

    def draw(name: str) -> Figure:
        figure = plot_sweep(found, name)
        panels[name] = _panels(figure)
        return figure

    captions = {1: CAPTION_LINE, 2: CAPTION_MAP} if is_chosen else {}
    for name in [name for name in names if found[name].size]:
        title, more = clauses(found[name])
        caption = f"{more.capitalize()}. " if more else ""
        caption += captions.get(len(dims), CAPTION_POINTS if dims == ["point"] else CAPTION_SEVERAL)
        figures.append(PageFigure(name, title, caption, partial(draw, name)))
    drawn, rules = write_figures(folder, figures)
    (folder / "case.yaml").write_text(origin.case_yaml.rstrip() + "\n", encoding="utf-8")
    (folder / "citations.bib").write_text(origin.citations.rstrip() + "\n", encoding="utf-8")
    every, data = _data(found, names, again, is_chosen=is_chosen)
    write_study(
        folder / "index.html",
        "impactlab.sweeps",
        scene,
        origin,
        title=origin.title or found.attrs["title"],
        kicker=f"impactlab · a sweep of {found['status'].size:,} points",
        facts=[*_facts(found), *facts.scene_facts(scene, links)],
        figures=[{**each, "panels": panels[each["name"]]} for each in drawn],
        rules=rules,
        every=every,
        is_chosen=is_chosen,
        lacking=[name for name in map(str, found.data_vars) if is_sampled(name)],
        files=[
            ("table.csv", "a row for each point"),
            ("sweep.nc", "labelled data, for xarray"),
            ("case.yaml", "the case that is swept"),
            ("citations.bib", "sources to cite"),
            *([("figures/", "SVG, PNG")] if figures else []),
        ],
        data=data,
    )


def _facts(found: xarray.Dataset) -> list[tuple[str, str]]:
    """Return axes and statuses of a sweep as names and words."""
    words = []
    for axis in axes_of(found):
        values, unit = found[axis].values, unit_of(found[axis])
        if values.dtype.kind in "iuf" and values.size > 3:
            text = f"{values.size:,} values, {_shown(values.min(), unit)} to {_shown(values.max(), unit)}"
        else:
            text = ", ".join(_shown(value, unit) for value in values[:8]) + (", ..." if values.size > 8 else "")
        words.append((axis, text))
    return [*words, ("points", ", ".join(f"{count:,} {status}" for status, count in counts(found).items()))]


def _shown(value: Any, unit: str) -> str:
    if isinstance(value, (str, bool)):
        return str(value)
    shown = fitted(unit, abs(float(value)))
    return f"{float(value) / shown.size:.6g}\N{NO-BREAK SPACE}{shown.label}".rstrip().replace("-", "\N{MINUS SIGN}")


def _panels(figure: Figure) -> list[dict[str, Any]]:
    """Return the boxes of a figure's panels, as shares of it from its upper left corner."""
    boxes = [axes.get_position().bounds for axes in figure.axes if axes.get_label() == PANEL]
    return [{"left": x, "top": 1.0 - y - height, "width": width, "height": height} for x, y, width, height in boxes]


def _data(found: xarray.Dataset, names: list[str], again: str, *, is_chosen: bool) -> tuple[int, str]:
    """Return the stride of the page's points and the script's data as JSON.

    The stride is the same along each axis.
    """
    dims = [str(dim) for dim in found["status"].dims]
    widths = {name: found[name].size // found["status"].size for name in names}
    every, columns = 1, 2 + sum(widths.values())
    while np.prod([math.ceil(size / every) for size in found["status"].shape]) * columns > MAX_VALUES:
        every += 1
    part = found.isel({dim: slice(None, None, every) for dim in dims})
    reasons, which = np.unique(part["reason"].values.ravel().astype(str), return_inverse=True)
    tables, described = [part["status"].values.ravel(), which.ravel()], []
    for name in names:
        values = part[name].transpose(*dims, ...).values.reshape(part["status"].size, -1)
        for number, label in enumerate(labels_in(part[name], dims)):
            tables.append(values[:, number])
            described.append({"name": name, "label": label, "unit": unit_of(part[name])})
    axes = []
    for axis in axes_of(found):
        values = part[axis].values.tolist()
        along = _shares(found, axis)[::every] if is_chosen else None
        sets = [setting(axis, value) for value in values]
        shown = [_shown(value, unit_of(part[axis])) for value in values]
        axes.append({"path": axis, "shown": shown, "sets": sets, "along": along})
    made = {
        "axes": axes,
        "listed": dims == ["point"],
        "statuses": STATUSES,
        "ended": ENDED,
        "reasons": reasons.tolist(),
        "quantities": described,
        "again": again,
        "points": part["status"].size,
        "table": _packed(np.array(tables, dtype="<f4")),
    }
    return every, json.dumps(made, separators=(",", ":")).replace("<", "\\u003c")


def _shares(found: xarray.Dataset, axis: str) -> list[float]:
    """Return the places of an axis's values, as shares of a panel's width or height."""
    place, values = places(in_order(found)[axis]), found[axis].values
    x, edges = (np.log(place.x), np.log(place.edges)) if place.is_logarithmic else (place.x, place.edges)
    if not place.words:
        x = x[np.unique(values, return_inverse=True)[1]]
    return [round(share, 5) for share in ((x - edges[0]) / (edges[-1] - edges[0])).tolist()]


def setting(path: str, value: Any) -> str:
    """Return the option of ``impactlab run`` for a value of an axis, quoted for a shell."""
    text = value if isinstance(value, str) else json.dumps(value)
    return shlex.join(["--method", text] if path == METHOD else ["--set", f"{path}={text}"])


def _packed(table: Array) -> str:
    """Return numbers as text: bytes, all first ones first, deflated, in base64."""
    planes = np.frombuffer(table.tobytes(), np.uint8).reshape(-1, 4).T
    return base64.b64encode(zlib.compress(planes.tobytes(), 6)).decode("ascii")
