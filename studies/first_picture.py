"""The animated picture of the first page: impact, waves, contact force.

A mass strikes a rod. ``python -m studies.first_picture`` writes docs/figures/impact.gif from the exact solution of the
paper's impact.
"""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from PIL import Image

import impactlab as il
from impactlab.report.figures import style
from studies.pages import CASES, DOCS

FRAMES, SHOWN, PAUSE = 84, 60, 1500  # pictures, ms of each, ms of the whole
END = 2.4  # T, of the picture: soon after the second contact
SECOND = 2.15  # T, from then on the second contact is named
LARGER = 320.0  # times that displacements are drawn
BLUE_TO_RED = LinearSegmentedColormap.from_list("stress", ["#1c4fb4", "#7fa6ee", "#ffffff", "#f0957c", "#b3300c"])


def axes_of(figure: Figure) -> tuple[Axes, Axes, Axes]:
    """Return the axes of scene, waves and force.

    The waves are below the scene, the force is beside both.
    """
    scene = figure.add_axes((0.075, 0.775, 0.5, 0.14))
    waves = figure.add_axes((0.075, 0.135, 0.5, 0.585))
    force = figure.add_axes((0.665, 0.135, 0.32, 0.585))
    for axes in (scene, waves):
        axes.set_xlim(-0.055, 0.312)
        axes.grid(visible=False)
    scene.axis("off")
    scene.set_ylim(-1.0, 1.0)
    return scene, waves, force


@style.drawn
def pictures() -> list[Image.Image]:
    """Return the pictures in order of time."""
    history = il.run(il.load_case(CASES / "axial_impact.yaml").method("continuous"))
    rod = history.scene.elastic["rod"]
    round_trip, length = history.scene.round_trip, rod.length
    t = np.linspace(0.0, END * round_trip, 4 * FRAMES + 1)
    x = np.linspace(0.0, length, 151)
    stress = np.stack([history.evaluate(t, f"stress:rod@{place:.6g}") for place in x], axis=1) / 1e6
    force = history.evaluate(t, "force:hammer|rod.left") / 1e3
    hammer = history.evaluate(t, "position:hammer")
    moved = np.stack([history.evaluate(t, f"displacement:rod@{place:.6g}") for place in x], axis=1)
    limit = float(np.max(np.abs(stress)))

    figure = Figure(figsize=(8.6, 4.1))
    scene, waves, trace = axes_of(figure)
    scene.text(-0.055, 1.25, "A mass strikes a clamped rod", fontsize=11, fontweight="bold", clip_on=False)
    scene.add_patch(Rectangle((length, -1.0), 0.008, 2.0, facecolor=style.MUTED))
    mass = scene.add_patch(Rectangle((0.0, -0.8), 0.035, 1.6, facecolor=style.INK))
    bar: QuadMesh | None = None
    (rim,) = scene.plot([], [], color=style.MUTED, linewidth=0.8)

    kept = np.full_like(stress, np.nan)
    image = waves.imshow(
        kept, origin="lower", aspect="auto", extent=(0.0, length, 0.0, END * round_trip * 1e6), cmap=BLUE_TO_RED,
        vmin=-limit, vmax=limit, interpolation="nearest",
    )  # fmt: skip
    front = waves.axhline(0.0, color=style.INK, linewidth=1.0)
    waves.set(xlabel="place along the rod  [m]", ylabel="time  [µs]", ylim=(0.0, END * round_trip * 1e6))
    waves.set_xticks([0.0, 0.1, 0.2, 0.3])
    scale = figure.add_axes((0.665, 0.845, 0.2, 0.03))
    key = figure.colorbar(image, cax=scale, orientation="horizontal", ticks=[-50.0, 0.0, 50.0])
    key.outline.set_visible(False)  # type: ignore[operator]
    scale.set_title("Stress  [MPa], red in compression")
    scale.tick_params(labelsize=7, length=2)

    trace.set(xlim=(0.0, END * round_trip * 1e6), ylim=(0.0, 1.08 * float(force.max())), xlabel="time  [µs]")
    trace.set_title("Contact force  [kN]")
    again = trace.annotate(
        "second contact", (2.14 * round_trip * 1e6, 11.5), xytext=(END * round_trip * 1e6, 27.0), ha="right",
        visible=False, color=style.INK, arrowprops={"arrowstyle": "-", "color": style.MUTED, "lw": 0.8},
    )  # fmt: skip
    (line,) = trace.plot([], [], color=style.PALETTE[1], linewidth=2.0)
    (dot,) = trace.plot([], [], "o", color=style.PALETTE[1], markersize=4.0)

    found = []
    for last in range(4, t.size, 4):
        places = x + LARGER * moved[last]
        if bar is not None:
            bar.remove()
        bar = scene.pcolormesh(
            np.stack((places, places)), np.stack((np.full_like(x, -0.5), np.full_like(x, 0.5))),
            0.5 * (stress[last, 1:] + stress[last, :-1])[None, :], cmap=BLUE_TO_RED, vmin=-limit, vmax=limit,
        )  # fmt: skip
        rim.set_data([places[0], places[-1], places[-1], places[0], places[0]], [-0.5, -0.5, 0.5, 0.5, -0.5])
        mass.set_x(LARGER * hammer[last] - 0.035)
        kept[: last + 1] = stress[: last + 1]
        image.set_data(kept)
        front.set_ydata([t[last] * 1e6] * 2)
        line.set_data(t[: last + 1] * 1e6, force[: last + 1])
        again.set_visible(t[last] > SECOND * round_trip)
        dot.set_data([t[last] * 1e6], [force[last]])
        buffer = io.BytesIO()
        figure.savefig(buffer, format="png", dpi=100)
        found.append(Image.open(buffer).convert("RGB"))
    return [found[-1], *found[:-1]]  # the whole picture first: it is shown where nothing moves


def colours() -> list[tuple[float, ...]]:
    """Return the palette of all pictures.

    It has the stresses in small steps, and blends of ink, grey and line with paper.
    """
    lines = [(style.INK, 6), (style.MUTED, 6), (style.GRID, 2), (style.PALETTE[1], 5)]
    blends = [LinearSegmentedColormap.from_list("", [style.PAPER, ink], parts)(range(parts)) for ink, parts in lines]
    return [tuple(colour[:3]) for colour in (*BLUE_TO_RED(np.linspace(0.0, 1.0, 61)), *np.concatenate(blends))]


def write(target: Path) -> None:
    """Write the pictures as a GIF of few colours, the same for all."""
    frames = pictures()
    palette = Image.new("P", (1, 1))
    palette.putpalette([round(255 * part) for colour in colours() for part in colour])
    few = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    times = [PAUSE, *[SHOWN] * (len(few) - 1)]
    few[0].save(target, save_all=True, append_images=few[1:], duration=times, loop=0, optimize=True)


if __name__ == "__main__":
    target = DOCS / "figures" / "impact.gif"
    write(target)
    print(f"{target}: {target.stat().st_size / 1000:.0f} kB")
