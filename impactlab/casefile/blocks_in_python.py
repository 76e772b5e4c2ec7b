"""Bodies and contacts of a case given in Python, with keys, units and defaults of a case file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, TypeAlias

from impactlab.casefile.keys_in_python import BodyKeys, given

Value: TypeAlias = float | str
"""A number in SI, or a text with a unit such as ``"9 cm^2"``."""
Ends: TypeAlias = Mapping[str, Any]
Shape: TypeAlias = float | str | Mapping[str, Sequence[Value]]
"""A formula of x, or a table ``{"x": [...], "u": [...]}``."""


class Rod(BodyKeys):
    """A straight elastic rod with axial motion: length, section and material, or segments.

    Parameters
    ----------
    length : float or str
        Length [m].
    area : float or str
        Area of the section [m2].
    diameter : float or str
        Diameter of a circle or a tube [m], in place of the area.
    bore : float or str
        Inner diameter of a tube [m], with the diameter.
    width, height : float or str
        Sides of a rectangle [m], in place of the area.
    material : str or mapping
        A name (``"steel"``), or ``{"young": ..., "density": ...}`` and perhaps ``viscosity``.
    ends : mapping
        Supports of the ends ``left`` and ``right``, such as ``{"right": "clamped"}``; free if not given. A
        ``force`` may act on an end: a number, a formula of t, or ``{"t": times, "f": forces}``.
    velocity : float or str
        Velocity at t = 0 [m/s].
    displacement : str, float or mapping
        Displacement at t = 0 [m]: a formula of x, or a table.
    segments : sequence of mappings
        Uniform pieces from left to right.
    damping : mapping
        Rayleigh damping ``{"mass": ..., "stiffness": ...}`` [1/s, s].
    rotation : mapping
        Steady rotation, such as ``{"rate": "600 rpm", "axis_at": 0.0}``.
    repeat : int
        Number n of bodies made from this one, with formulas of i = 1 ... n in its values.
    **others
        Other keys of a case file; unknown ones are refused.
    """

    block = "RodBlock"

    def __init__(
        self,
        *,
        length: Value | None = None,
        area: Value | None = None,
        diameter: Value | None = None,
        bore: Value | None = None,
        width: Value | None = None,
        height: Value | None = None,
        material: str | Mapping[str, Value] | None = None,
        ends: Ends | None = None,
        velocity: Value | None = None,
        displacement: Shape | None = None,
        segments: Sequence[Mapping[str, Any]] | None = None,
        damping: Mapping[str, Value] | None = None,
        rotation: Mapping[str, Any] | None = None,
        repeat: int | None = None,
        **others: Any,
    ) -> None:
        super().__init__(**{"kind": "rod"} | given(locals()))


class Beam(BodyKeys):
    """A straight elastic beam that bends: length, section and material, or segments.

    Parameters
    ----------
    length : float or str
        Length [m].
    section : mapping
        ``{"width": ..., "height": ...}``, ``{"diameter": ...}`` [m] or ``{"area": ..., "inertia": ...}`` [m2, m4].
    material : str or mapping
        A name (``"steel"``), or ``{"young": ..., "density": ...}`` and perhaps ``poisson``.
    theory : str
        ``"euler_bernoulli"``, or ``"timoshenko"`` with shear and rotary inertia.
    ends : mapping
        Supports of the ends ``left`` and ``right``, such as ``{"left": "clamped", "right": "pinned"}``.
    velocity : float or str
        Velocity at t = 0 [m/s].
    displacement : str, float or mapping
        Deflection at t = 0 [m]: a formula of x, or a table.
    segments : sequence of mappings
        Uniform pieces from left to right.
    tension : float or str
        Axial preload [N].
    damping : mapping
        Rayleigh damping ``{"mass": ..., "stiffness": ...}`` [1/s, s].
    rotation : mapping
        Steady rotation, such as ``{"rate": "600 rpm", "axis_at": 0.0, "plane": "flap"}``.
    repeat : int
        Number n of bodies made from this one, with formulas of i = 1 ... n in its values.
    **others
        Other keys of a case file; unknown ones are refused.
    """

    block = "BeamBlock"

    def __init__(
        self,
        *,
        length: Value | None = None,
        section: Mapping[str, Value] | None = None,
        material: str | Mapping[str, Value] | None = None,
        theory: str | None = None,
        ends: Ends | None = None,
        velocity: Value | None = None,
        displacement: Shape | None = None,
        segments: Sequence[Mapping[str, Any]] | None = None,
        tension: Value | None = None,
        damping: Mapping[str, Value] | None = None,
        rotation: Mapping[str, Any] | None = None,
        repeat: int | None = None,
        **others: Any,
    ) -> None:
        super().__init__(**{"kind": "beam"} | given(locals()))


class Shaft(BodyKeys):
    """A straight elastic shaft in torsion: length, section and material, or segments.

    Parameters
    ----------
    length : float or str
        Length [m].
    section : mapping
        ``{"diameter": ...}`` and perhaps ``bore`` [m], or ``{"torsion_constant": ..., "polar_moment": ...}`` [m4].
    material : str or mapping
        A name (``"steel"``), or ``{"shear_modulus": ..., "density": ...}``.
    ends : mapping
        Supports of the ends ``left`` and ``right``.
    twist_rate : float or str
        Twist rate at t = 0 [rad/s].
    twist : str, float or mapping
        Twist at t = 0 [rad]: a formula of x, or a table.
    segments : sequence of mappings
        Uniform pieces from left to right.
    damping : mapping
        Rayleigh damping ``{"mass": ..., "stiffness": ...}`` [1/s, s].
    repeat : int
        Number n of bodies made from this one, with formulas of i = 1 ... n in its values.
    **others
        Other keys of a case file; unknown ones are refused.
    """

    block = "ShaftBlock"

    def __init__(
        self,
        *,
        length: Value | None = None,
        section: Mapping[str, Value] | None = None,
        material: str | Mapping[str, Value] | None = None,
        ends: Ends | None = None,
        twist_rate: Value | None = None,
        twist: Shape | None = None,
        segments: Sequence[Mapping[str, Any]] | None = None,
        damping: Mapping[str, Value] | None = None,
        repeat: int | None = None,
        **others: Any,
    ) -> None:
        super().__init__(**{"kind": "shaft"} | given(locals()))


class Mass(BodyKeys):
    """A rigid body: mass [kg], velocity at t = 0 [m/s], steady rotation.

    A rotation is given as ``{"rate": 60.0}``. With ``repeat`` n bodies NAME_1 ... NAME_n, with formulas of i = 1 ... n:
    ``Mass("1e-3*0.99**i", repeat=1000)``.
    """

    block = "MassBlock"

    def __init__(
        self,
        mass: Value | None = None,
        *,
        velocity: Value | None = None,
        rotation: Mapping[str, Any] | None = None,
        repeat: int | None = None,
        **others: Any,
    ) -> None:
        super().__init__(**{"kind": "mass"} | given(locals()))


class Wall(BodyKeys):
    """A rigid body that never moves."""

    def __init__(self, **others: Any) -> None:
        super().__init__(**{"kind": "wall"} | others)


class Contact(BodyKeys):
    """Two faces that may meet.

    Parameters
    ----------
    left : str
        The face on the left: ``"hammer"``, ``"rod.left"``, ``"rod.right"`` or ``"beam.at(0.2)"``.
    right : str
        The face on the right, in the same form.
    law : mapping
        Contact law, ``{"kind": "penalty", "stiffness": 1e8}``; with a tolerance it may be left out for hard contact.
    gap : float or str
        Gap at t = 0 [m], positive when open.
    lever_arm : float or str
        Distance of the contact from the axis of the shaft that it turns [m].
    overlap : str
        ``"allowed"`` lets a gap be negative.
    along : str or sequence of float
        Direction of a contact on a link of a mechanism: ``"x"``, ``"y"`` or ``[cos, sin]``.
    pieces : int
        Number of equal pieces of a contact along a body, ``"pile.along(5 m, 20 m)"``.
    name : str
        Name of the sum of its forces, ``force:NAME``.
    repeat : int
        Number n of contacts made from this one, with formulas of i = 1 ... n: ``Contact("bead_{i}", "bead_{i + 1}",
        repeat=999)``.
    **others
        Other keys of a case file; unknown ones are refused.
    """

    block = "ContactBlock"

    def __init__(
        self,
        left: str,
        right: str,
        law: Mapping[str, Any] | None = None,
        *,
        gap: Value | None = None,
        lever_arm: Value | None = None,
        overlap: str | None = None,
        along: str | Sequence[float] | None = None,
        pieces: int | None = None,
        name: str | None = None,
        repeat: int | None = None,
        **others: Any,
    ) -> None:
        keys = given(locals())
        super().__init__(between=[keys.pop("left"), keys.pop("right")], **keys)


class Chain(BodyKeys):
    """Contacts of bodies in a row, each with the next.

    Parameters
    ----------
    bodies : sequence of str
        Bodies from left to right; the name of a repeated one stands for all that are made from it, and a rod meets its
        neighbours by its ends.
    law : mapping
        Contact law of all, with formulas of the number i = 1 ... n of the contact where they differ.
    gap : float or str
        Gap at t = 0 [m].
    **others
        Other keys of a contact.
    """

    block = "ContactBlock"

    def __init__(
        self, bodies: Sequence[str], law: Mapping[str, Any] | None = None, *, gap: Value | None = None, **others: Any
    ) -> None:
        super().__init__(chain=listed(bodies), law=law, gap=gap, **others)


class Link(BodyKeys):
    """A rigid link of a mechanism: length [m], mass [kg], inertia [kg m2].

    The moment of inertia is that about its middle. Without inertia it is a uniform bar. A flexible link is a `Beam`.
    """

    block = "LinkBlock"

    def __init__(self, *, length: Value, mass: Value, inertia: Value | None = None, **others: Any) -> None:
        super().__init__(**{"kind": "link"} | given(locals()))


class Joint(BodyKeys):
    """A link in its mechanism, and its joint to the one before.

    The first link is tied to the ground.

    Parameters
    ----------
    body : str
        Name of the link, a `Link` or a `Beam` among the bodies.
    joint : str
        ``"hinge"`` if not given, or ``"clamped"``: to the end before it, or to a driven hub.
    angle : float or str
        Angle at t = 0 [rad], from +x, counterclockwise.
    rate : float or str
        Angular rate at t = 0 [rad/s].
    torque : float or str
        Torque on the link from the one before it [N m].
    drive : mapping
        Given rate of the hinge, ``{"rate": 6.0, "within": 15.0}`` [rad/s, s].
    end_mass : float or str
        Point mass at its end [kg].
    axial_modes : int
        Axial shapes of a beam; without one it keeps its length.
    **others
        Other keys of a case file; unknown ones are refused.
    """

    block = "JointBlock"

    def __init__(
        self,
        body: str,
        *,
        joint: str | None = None,
        angle: Value | None = None,
        rate: Value | None = None,
        torque: Value | None = None,
        drive: Mapping[str, Value] | None = None,
        end_mass: Value | None = None,
        axial_modes: int | None = None,
        **others: Any,
    ) -> None:
        super().__init__(**given(locals()))


class Mechanism(BodyKeys):
    """A planar chain of links from the ground on, of `Case(mechanisms={"press": Mechanism(...)})`.

    Parameters
    ----------
    links : sequence of Joint
        The links in their order; the first is tied to the ground at x = y = 0.
    end : str or mapping
        ``"free"`` if not given, or ``{"slide": y}``: the end moves along x at the height y [m].
    """

    def __init__(
        self, links: Sequence[Mapping[str, Any]], *, end: str | Mapping[str, Value] | None = None, **others: Any
    ) -> None:
        super().__init__(links=listed(links), end=end, **others)


def listed(values: object) -> object:
    """Return values, as of a generator, as a list; text and single values as they are, refused later."""
    return [*values] if isinstance(values, Iterable) and not isinstance(values, (str, Mapping)) else values
