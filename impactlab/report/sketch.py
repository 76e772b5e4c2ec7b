"""A drawing of the scene as SVG: bodies on a line, supports and directions of motion."""

from __future__ import annotations

import math
from html import escape

import numpy as np

from impactlab.report.beam_sketch import beam_sketch
from impactlab.scene.bodies import Body, End, Mass, MechanismBody, WaveBody
from impactlab.scene.problem import Scene

HEIGHT, MIDDLE = 120.0, 52.0  # of the drawing, and of the axis of the bodies
MASS, WALL, ROD, GAP, MARGIN = 52.0, 14.0, 420.0, 26.0, 56.0  # widths


def sketch(scene: Scene) -> str:
    """Return the drawing of a scene; empty where there is none.

    Bodies must stand end to end or strike beams.
    """
    if any(isinstance(body, MechanismBody) for body in scene.bodies.values()):
        return ""
    if drawn := beam_sketch(scene):
        return drawn
    chain = _chain(scene)
    if not chain:
        return ""
    longest = max((b.length for b in chain if isinstance(b, WaveBody)), default=1.0)
    tallest = max((s.impedance for b in chain if isinstance(b, WaveBody) for s in b.segments), default=1.0)
    apart = {(contact.left.body, contact.right.body) for contact in scene.contacts if contact.gap > 0.0}
    parts, x = [], MARGIN
    for number, body in enumerate(chain):
        if number and (chain[number - 1].name, body.name) in apart:  # at the start
            x += GAP
        if isinstance(body, WaveBody):
            width = max(90.0, ROD * body.length / longest)
            parts.append(_rod(body, x, width, tallest, scene.duration))
        elif isinstance(body, Mass):
            width = MASS
            parts.append(f'<rect x="{x:.1f}" y="{MIDDLE - 26}" width="{width}" height="52" rx="3" class="mass"/>')
        else:
            width = WALL
            parts.append(_hatch(x + width, -1, 34.0) if number == 0 else _hatch(x, 1, 34.0))
        parts.append(f'<text x="{x + width / 2:.1f}" y="{MIDDLE + 48}" text-anchor="middle">{escape(body.name)}</text>')
        velocity = 0.0 if not isinstance(body, Mass | WaveBody) else body.velocity
        if velocity:
            parts.append(_arrow(x + width / 2, MIDDLE - 40, velocity))
        x += width
    return (
        f'<svg class="sketch" role="img" aria-label="Sketch of the scene" viewBox="0 0 {x + MARGIN:.0f} {HEIGHT:.0f}">'
        f"{''.join(parts)}</svg>"
    )


def _chain(scene: Scene) -> list[Body]:
    """Return the bodies from left to right where they form a chain.

    Each contact must join the end of one to that of the next, else there are none.
    """
    after: dict[str, str] = {}
    reached = set[str]()
    for contact in scene.contacts:
        left, right = scene.bodies[contact.left.body], scene.bodies[contact.right.body]
        at_ends = (
            not isinstance(left, WaveBody) or math.isclose(contact.left.x, left.length)
        ) and contact.right.x == 0.0
        if not at_ends or left.name in after or right.name in reached:
            return []
        after[left.name] = right.name
        reached.add(right.name)
    starts = [name for name in scene.bodies if name not in reached]
    if len(starts) != 1:
        return []
    names = [starts[0]]
    while names[-1] in after:
        names.append(after[names[-1]])
    return [scene.bodies[name] for name in names]


def _rod(rod: WaveBody, x: float, width: float, tallest: float, duration: float) -> str:
    """Return the drawing of a rod or a shaft.

    Its segments are as high as their impedance; the supports of its ends are drawn.
    """
    parts, at, half = [], x, 15.0
    for segment in rod.segments:
        half = 8.0 + 8.0 * math.sqrt(segment.impedance / tallest)
        piece = width * segment.length / rod.length
        parts.append(
            f'<rect x="{at:.1f}" y="{MIDDLE - half:.1f}" width="{piece:.1f}" height="{2 * half:.1f}" class="rod"/>'
        )
        at += piece
    for end, place, side in ((rod.left, x, -1), (rod.right, x + width, 1)):
        if end.kind == "clamped":
            parts.append(_hatch(place, side, 30.0))
        elif end.kind == "mass":
            left = place if side > 0 else place - 16.0
            parts.append(f'<rect x="{left:.1f}" y="{MIDDLE - 20}" width="16" height="40" rx="2" class="mass"/>')
        elif end.kind in ("spring", "dashpot"):
            parts.append(_held(end.kind, place, side))
        if end.is_loaded:
            high = 24.0 if end.kind in ("spring", "dashpot") else 0.0  # beside the spring or dashpot
            parts.append(_push(end, duration, place, side, MIDDLE - high))
    return "".join(parts)


def _held(kind: str, x: float, side: int) -> str:
    """Return a spring or a dashpot between the end of a rod and the ground."""
    if kind == "spring":
        steps = [(4.0 * i, 0.0 if i in (0, 1, 7, 8) else (-7.0 if i % 2 else 7.0)) for i in range(9)]
    else:
        steps = [(0, 0), (14, 0), (14, -7), (14, 7), (14, 0), (18, 0), (18, -10), (10, -10), (18, -10), (18, 10)]
        steps += [(10, 10), (18, 10), (18, 0), (32, 0)]
    points = " ".join(f"{x + side * dx:.1f},{MIDDLE + dy:.1f}" for dx, dy in steps)
    return f'<polyline points="{points}" class="line"/>{_hatch(x + side * 32.0, side, 18.0)}'


def _hatch(x: float, side: int, half: float) -> str:
    """Return ground: a line with hatching on the side away from the body."""
    lines = [f'<path d="M{x:.1f} {MIDDLE - half:.1f}V{MIDDLE + half:.1f}" class="line"/>']
    y = MIDDLE - half
    while y < MIDDLE + half - 1.0:
        lines.append(f'<path d="M{x:.1f} {y + 8:.1f}l{side * 9:.1f} -8" class="thin"/>')
        y += 8.0
    return "".join(lines)


def _push(end: End, duration: float, x: float, side: int, y: float) -> str:
    """Return the arrow of a force on an end.

    It is outside the rod, with the size above; a force over time is F(t), with the direction of its largest value.
    """
    force, words = end.force, f"{abs(end.force):g} N"
    if end.load is not None:
        values = end.load.sampled(duration).forces
        force, words = float(values[np.abs(values).argmax()]), "F(t)"
    along = 1 if force > 0 else -1
    near, far = x + 4.0 * side, x + 38.0 * side
    tail, tip = (far, near) if along == -side else (near, far)
    text = f'<text x="{(near + far) / 2:.1f}" y="{y - 8}" text-anchor="middle">{words}</text>'
    return (
        f'<path d="M{tail:.1f} {y}H{tip:.1f}" class="move"/>'
        f'<path d="M{tip:.1f} {y}l{-8 * along} -4v8z" class="head"/>{text}'
    )


def _arrow(x: float, y: float, velocity: float) -> str:
    side = 1 if velocity > 0 else -1
    tail, tip = x - 20 * side, x + 20 * side
    anchor = "start" if side > 0 else "end"
    text = f'<text x="{tip + 8 * side:.1f}" y="{y + 4}" text-anchor="{anchor}">{abs(velocity):.4g} m/s</text>'
    return (
        f'<path d="M{tail:.1f} {y}H{tip:.1f}" class="move"/>'
        f'<path d="M{tip + 3 * side:.1f} {y}l{-8 * side} -4v8z" class="head"/>{text}'
    )
