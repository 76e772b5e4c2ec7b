"""A drawing of a scene with beams along x, their supports, and strikers below or above."""

from __future__ import annotations

from html import escape

from impactlab.scene.bodies import Beam, End, Mass, Rod, Wall
from impactlab.scene.problem import Contact, Scene

WIDTH, LEFT, FIRST, APART = 420.0, 70.0, 96.0, 150.0  # of a beam, its left end, the axis of the first, the next one
HALF = 5.0  # of the height of a beam, and
OPEN, TOUCHING = 12.0, 2.0  # distances of faces
BALL, PIECE = 13.0, 34.0  # radius of a mass; length of a rod


def beam_sketch(scene: Scene) -> str:
    """Return the drawing as SVG, or nothing for a scene without beams."""
    beams = [body for body in scene.bodies.values() if isinstance(body, Beam)]
    if not beams:
        return ""
    longest = max(beam.length for beam in beams)
    parts: list[str] = []
    for number, beam in enumerate(beams):
        y, width = FIRST + number * APART, WIDTH * beam.length / longest
        parts += [
            f'<rect x="{LEFT}" y="{y - HALF}" width="{width:.1f}" height="{2 * HALF}" class="rod"/>',
            _support(beam.left, LEFT, y, -1),
            _support(beam.right, LEFT + width, y, 1),
            f'<text x="{LEFT + width + 52:.1f}" y="{y + 4}">{escape(beam.name)}</text>',
        ]
        if beam.velocity:
            parts.append(_arrow(LEFT + 0.12 * width, y - 30.0, beam.velocity))
        parts += [_met(scene, beam, y, width, contact) for contact in scene.contacts]
    height = FIRST + (len(beams) - 1) * APART + 92.0
    return (
        f'<svg class="sketch" role="img" aria-label="Sketch of the scene" viewBox="0 0 {LEFT + WIDTH + 150:.0f} '
        f'{height:.0f}">{"".join(parts)}</svg>'
    )


def _met(scene: Scene, beam: Beam, y: float, width: float, contact: Contact) -> str:
    """Return the drawing of a beam's partner in a contact.

    It is a ball, the end of a rod, or a stop, below or above the beam.
    """
    for here, there, side in ((contact.right, contact.left, 1), (contact.left, contact.right, -1)):
        if here.body != beam.name:
            continue
        other = scene.bodies[there.body]
        x = LEFT + width * here.x / beam.length
        face = y + side * (HALF + (OPEN if contact.gap > 0.0 else TOUCHING))
        if isinstance(other, Wall):
            shape, depth = _ground(x, face, side), 14.0
        elif isinstance(other, Mass):
            shape, depth = f'<circle cx="{x:.1f}" cy="{face + side * BALL:.1f}" r="{BALL}" class="mass"/>', 2 * BALL
        elif isinstance(other, Rod):
            top = face if side > 0 else face - PIECE
            shape = f'<rect x="{x - 6:.1f}" y="{top:.1f}" width="12" height="{PIECE}" class="rod"/>'
            depth = PIECE
        else:
            return ""
        name = f'<text x="{x:.1f}" y="{face + side * (depth + 12) + 4:.1f}" text-anchor="middle">'
        arrow = _arrow(x + 26.0, face + side * 16, other.velocity) if other.velocity else ""
        return f"{shape}{name}{escape(there.body)}</text>{arrow}"
    return ""


def _ground(x: float, y: float, side: int) -> str:
    """Return a stop: a line with hatching away from the beam.

    The line is along x.
    """
    lines = [f'<path d="M{x - 20:.1f} {y:.1f}H{x + 20:.1f}" class="line"/>']
    lines += [f'<path d="M{x - 20 + 8 * i:.1f} {y + side * 8:.1f}l8 {-side * 8}" class="thin"/>' for i in range(5)]
    return "".join(lines)


def _support(end: End, x: float, y: float, side: int) -> str:
    """Return the support of an end of a beam."""
    if end.kind == "clamped":
        lines = [f'<path d="M{x:.1f} {y - 24:.1f}V{y + 24:.1f}" class="line"/>']
        lines += [f'<path d="M{x:.1f} {y - 16 + 8 * i:.1f}l{side * 9} -8" class="thin"/>' for i in range(6)]
        return "".join(lines)
    if end.kind == "pinned":
        foot = f'<path d="M{x:.1f} {y + HALF:.1f}l-9 15h18z" class="line" fill="none"/>'
        return foot + _ground(x, y + HALF + 15, 1)
    if end.kind == "mass":
        return f'<rect x="{x - 8:.1f}" y="{y - 16}" width="16" height="32" rx="2" class="mass"/>'
    if end.kind in ("spring", "dashpot"):
        middle = (
            f"M{x:.1f} {y + HALF:.1f}v5l-6 3 12 5 -12 5 12 5 -6 3v5"
            if end.kind == "spring"
            else (f"M{x:.1f} {y + HALF:.1f}v12m-7 0h14m-9 -4v14m0 0m4 0v9m-10 -19v10h12v-10")
        )
        return f'<path d="{middle}" class="line" fill="none"/>' + _ground(x, y + HALF + 32, 1)
    if end.kind == "infinite":
        return f'<path d="M{x:.1f} {y}h{side * 34}" class="thin" stroke-dasharray="4 4"/>'
    return ""


def _arrow(x: float, y: float, velocity: float) -> str:
    """Return the arrow of a velocity, upwards where positive."""
    side = -1 if velocity > 0.0 else 1
    return (
        f'<path d="M{x:.1f} {y - 12 * side:.1f}V{y + 12 * side:.1f}" class="move"/>'
        f'<path d="M{x:.1f} {y + 15 * side:.1f}l-4 {-8 * side}h8z" class="head"/>'
        f'<text x="{x + 9:.1f}" y="{y + 4:.1f}">{abs(velocity):.4g} m/s</text>'
    )
