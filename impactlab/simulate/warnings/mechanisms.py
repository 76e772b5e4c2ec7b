"""Warnings of a finished run on mechanisms.

They are of contacts that magnify differences, of guides and drives on the ground, and of links that gravity swings.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from impactlab.history.base import AbstractHistory, Warned
from impactlab.metrics.linear_theory import BENT_WARN
from impactlab.scene.bodies import links_on_hubs
from impactlab.scene.problem import Scene
from impactlab.simulate.channels import AbstractRecordedHistory
from impactlab.simulate.warnings.static_sag import SWING_WARN

SURE_CONTACTS = 2  # periods of contact of a mechanism; in the arm the third differs forty times as much as the first
TURN_WARN = 0.25  # rad in a step: the place of an end is then off by some thousandths of the length
ACROSS_WARN = 1e-6  # of gravity: a smaller part across a motion is rounding of its direction
BEAM_SHARE = 33.0 / 140.0  # of the mass of a cantilever, that a mass at its tip stands for (Rayleigh)


def warnings(history: AbstractRecordedHistory) -> Iterator[Warned]:
    """Yield the warnings of a finished run that concern its mechanisms."""
    if not any(body.changes for body in history.scene.bodies.values()):
        return
    yield from _sensitive(history)
    yield from _turned_far(history)
    yield from (Warned("large_bending", text) for text in too_bent(history))
    yield from _guided(history.scene)
    yield from _swinging(history)
    yield from _driven_from_the_ground(history.scene)


def _sensitive(history: AbstractHistory) -> Iterator[Warned]:
    """Yield a warning for each body of large motion with a long sequence of contacts."""
    scene = history.scene
    for name, body in scene.bodies.items():
        if not body.changes:
            continue
        count = sum(len(history.spans(each.name)) for _, each in scene.met_by(name))
        if count > SURE_CONTACTS:
            text = (
                f"{name}: {count} periods of contact, and the difference between two resolutions grows "
                "from each of them to the next"
            )
            yield Warned("sensitive_sequence", f"{text}; compare with half the step and with more modes")


def _turned_far(history: AbstractRecordedHistory) -> Iterator[Warned]:
    """Yield a warning for each mechanism that may turn past a face within a step."""
    for name, body in history.scene.bodies.items():
        if not body.changes:
            continue
        rates = [history.recorded[channel].values for channel, *_ in body.recorded if channel.startswith("rate:")]
        fastest = max((float(np.abs(each[np.isfinite(each)]).max(initial=0.0)) for each in rates), default=0.0)
        turned = fastest * (history.dt or 0.0)
        if turned > TURN_WARN:
            text = (
                f"{name}: it turns at {fastest:.3g} rad/s, by {turned:.3g} rad in a step of "
                f"{history.dt:.3g} s, so that contacts may be missed; give a step (dt) in which it turns "
                "by a few hundredths of a radian"
            )
            yield Warned("coarse_turning", text)


def too_bent(history: AbstractRecordedHistory) -> Iterator[str]:
    """Yield a text for each flexible link that bends further than its shapes hold.

    The shortening s of a link is half the integral of its squared slope, so that s/L is half the mean of that square.
    """
    mechanisms = (body for body in history.scene.bodies.values() if body.changes)
    for body in mechanisms:
        for name, length in body.lengths_of_bent.items():
            shortened = history.recorded[f"shortening:{name}"].values
            known = shortened[np.isfinite(shortened)]
            share = float(known.max(initial=0.0)) / length
            if share > BENT_WARN:
                yield (
                    f"{name}: it bends so far that the distance between its ends falls by {share:.2g} of its "
                    f"length; its curvature is taken as linear, which is valid up to about {BENT_WARN:g}"
                )


def _guided(scene: Scene) -> Iterator[Warned]:
    """Yield a warning where gravity acts across the motion of bodies beside a mechanism."""
    pull = max((math.hypot(*body.gravity) for body in scene.bodies.values()), default=0.0)
    across = math.sqrt(max(0.0, pull**2 - scene.gravity**2))
    names = [name for name, body in scene.bodies.items() if body.moves and body.falls]
    if names and across > ACROSS_WARN * pull:
        text = (
            f"{', '.join(names)}: {across:.4g} m/s2 of gravity act across the motion; the guide carries this component"
        )
        yield Warned("guided_weight", text)


def _driven_from_the_ground(scene: Scene) -> Iterator[Warned]:
    """Yield a warning for each drive of a link that stands on another one."""
    for body in scene.bodies.values():
        for name, before in body.ground_drives:
            text = (
                f"{name}: its drive sets its absolute angle and acts from the ground, like a belt over "
                f"the hinges before it; its moment does not act on '{before}', as that of a motor there "
                "would"
            )
            yield Warned("ground_drive", text)


def _swinging(history: AbstractRecordedHistory) -> Iterator[Warned]:
    """Yield a warning for each link whose swing by gravity matters.

    The link is clamped to a driven hub, is straight at t = 0, and swings about its static sag. None where gravity alone
    moves it. The sag is that of a cantilever under its weight and that of the mass at its end, at its angle at t = 0.
    """
    scene = history.scene
    for body, link in links_on_hubs(scene.bodies.values()):
        others = (each for name, each in scene.bodies.items() if name != body.name)
        turns = link.drive is not None and link.drive.rate != 0.0
        if link.beam is None or not (turns or any(each.moves for each in others)):
            continue
        across = math.cos(link.angle) * body.gravity[1] - math.sin(link.angle) * body.gravity[0]  # m/s2
        mass, bending, length = link.beam.mass, link.beam.segments[0].bending_stiffness, link.length
        slowest = math.sqrt(3.0 * bending / (length**3 * (link.end_mass + BEAM_SHARE * mass)))  # rad/s
        swing = 1.0 - math.cos(min(slowest * history.duration, math.pi))
        for number, mark in enumerate(body.marks):
            x, side = mark.x, mark.along[1] * math.cos(link.angle) - mark.along[0] * math.sin(link.angle)
            of_beam = mass / length * x**2 * (6.0 * length**2 - 4.0 * length * x + x**2) / 24.0
            sag = across * (of_beam + link.end_mass * x**2 * (3.0 * length - x) / 6.0) / bending
            moved = float(np.ptp(history.recorded[body.face_channel(number)].values))
            if swing * abs(side * sag) > SWING_WARN * moved:
                yield Warned(
                    "static_sag",
                    f"'{link.name}' is straight at t = 0, and its weight acts from then on: it vibrates about "
                    f"its static sag, {sag:.3g} m at {x:.6g} m, by up to {swing * abs(sag):.3g} m within the "
                    f"run, while {mark.label} moves by {moved:.3g} m. If it hangs at rest at the start, leave "
                    "gravity out: displacements, gaps and moments then count from the sag",
                )
                break
