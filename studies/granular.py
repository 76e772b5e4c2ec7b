"""Figures and numbers of the page on granular chains.

They are on the solitary wave, tapered and decorated chains, and rods.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from matplotlib.figure import Figure

import impactlab as il
from impactlab.granular import LONG_WAVE_FACTOR, leading_wave, solitary_wave
from impactlab.granular.waves import LeadingWave
from impactlab.history import AbstractHistory
from impactlab.report.figures import style
from studies.pages import CASES, Study, filled, table

FOLDER = CASES / "granular"
MASS, STIFFNESS = 4.1102503884466466e-3, 7.692307692307692e9  # kg, N/m^1.5, of solitary_wave
FREE = 4  # contacts before the free end, whose forces are less


@cache
def run(name: str, variant: str = "base") -> AbstractHistory:
    """Return a run of a case."""
    return il.run(il.load_case(FOLDER / f"{name}.yaml").variant(variant))


def wave_of(history: AbstractHistory) -> LeadingWave:
    """Return the leading wave of a chain, without the contacts near its free end."""
    return leading_wave(history, [contact.name for contact in history.scene.contacts][:-FREE])


def dated_wave(history: AbstractHistory) -> LeadingWave:
    """Return the leading wave by the closing times of contacts.

    It serves where records are too far apart for a wave.
    """
    names = [contact.name for contact in history.scene.contacts][:-FREE]
    first = [history.spans(name)[0] for name in names]
    starts, peaks = ([getattr(span, field) for span in first] for field in ("start", "peak_force"))
    return LeadingWave(tuple(names), np.array(starts, float), np.array(peaks, float))


def speeds() -> str:
    """Return the table of measured factors.

    They are of the second half of chains of 100, 1000 and 10000 beads.
    """
    rows = []
    for text, variant, read in (
        ("100 beads", "base", wave_of),
        ("1000 beads", "thousand", wave_of),
        ("10000 beads", "ten_thousand", dated_wave),
    ):
        wave = read(run("solitary_wave", variant))
        half = len(wave.forces) // 2
        factors = wave.factors(STIFFNESS, MASS, half // 5)[half:]
        spread = [np.ptp(values) / np.mean(values) for values in (wave.forces[half:], factors)]
        rows.append([text, f"{np.mean(factors):.6f}", f"{spread[0]:.1e}", f"{spread[1]:.1e}"])
    rows.append(["discrete chain, exact", f"{solitary_wave().factor:.7f}", "0", "0"])
    rows.append(["Nesterenko's long wave", f"{LONG_WAVE_FACTOR:.7f}", "0", "0"])
    return table("chain | C | spread of the force | spread of C", rows)


def wave() -> Figure:
    """Return the figure of the solitary wave.

    It shows the force of one contact against both waves, and forces and factor along the chain.
    """
    figure = Figure(figsize=(style.WIDTH, 3.5), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.2, 1.0))
    history = run("solitary_wave")
    found, exact = wave_of(history), solitary_wave()
    at = 60
    per_bead = 1.0 / found.speed(40, 80)
    s = np.linspace(-3.5, 3.5, 700)
    force = history.evaluate(found.times[at] + s * per_bead, f"force:{found.contacts[at]}") / found.forces[at]
    left.plot(s, np.interp(s, exact.s, exact.force), color=style.INK, lw=2.4, label="discrete chain, exact")
    left.plot(s, force, color=style.PALETTE[0], lw=1.2, ls="--", label=f"contact {at} of the run")
    inside = np.abs(s) * np.sqrt(0.4) < 0.5 * np.pi
    left.plot(
        s, np.where(inside, np.cos(s * np.sqrt(0.4)) ** 6, 0.0), color=style.MUTED, lw=1.0, label="long wave, $\\cos^6$"
    )
    left.set(xlabel="time, in passages of a bead", ylabel="force over its largest", xlim=(-3.5, 3.5))
    left.legend(frameon=False, loc="upper right")
    left.set_title("One contact", loc="left")
    factors = found.factors(STIFFNESS, MASS, 5)
    right.plot(np.arange(factors.size) + 2.5, factors, color=style.PALETTE[0], lw=1.6)
    right.axhline(exact.factor, color=style.INK, lw=0.8, ls=":")
    right.axhline(LONG_WAVE_FACTOR, color=style.MUTED, lw=0.8, ls=":")
    right.annotate("0.90552", (60, exact.factor), xytext=(0, 4), textcoords="offset points", color=style.INK)
    right.annotate("0.89443, long wave", (45, LONG_WAVE_FACTOR), xytext=(0, 4), textcoords="offset points",
                   color=style.MUTED)  # fmt: skip
    right.set(xlabel="contact", ylabel="C", ylim=(0.885, 0.915), xlim=(0, 96))
    right.set_title("Speed over its force", loc="left")
    return figure


def chains() -> Figure:
    """Return the figure of largest forces along chains.

    Chains are uniform, tapered and decorated; the pulse in a bar is shown, too.
    """
    figure = Figure(figsize=(style.WIDTH, 3.4), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.2, 1.0))
    for (name, text), colour in zip(
        (("solitary_wave", "equal"), ("tapered_chain", "tapered"), ("decorated_chain", "decorated")),
        (style.INK, *style.PALETTE),
        strict=False,
    ):
        history = run(name)
        names = [contact.name for contact in history.scene.contacts][:41]
        peaks = [max((span.peak_force or 0.0 for span in history.spans(each)), default=0.0) for each in names]
        left.plot(np.arange(1, len(peaks) + 1), peaks, color=colour, lw=1.4, marker=".", ms=4, label=text)
    left.set(xlabel="contact", ylabel="largest force [N]", ylim=(0.0, None))
    left.legend(frameon=False)
    left.set_title("Forces along chains", loc="left")
    history = run("chain_between_rods")
    t = np.linspace(0.0, history.duration, 3000)
    for contact, colour, text in (
        ("striker.right|bead_1", style.MUTED, "rod on chain"),
        ("bead_10|bar.left", style.PALETTE[0], "chain on bar"),
    ):
        right.plot(1e6 * t, 1e-3 * history.evaluate(t, f"force:{contact}"), color=colour, lw=1.3, label=text)
    right.set(xlabel="time [us]", ylabel="force [kN]", xlim=(0, 1e6 * history.duration))
    right.legend(frameon=False)
    right.set_title("A chain between two rods", loc="left")
    return figure


STUDY = Study(
    {"granular-chains.md": filled({"speeds": speeds})},
    {"figures/solitary_wave.png": wave, "figures/granular_chains.png": chains},
)
