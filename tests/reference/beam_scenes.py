"""Scenes of beams, built by hand."""

from __future__ import annotations

from impactlab.contact.power_law import Hertz
from impactlab.scene import Beam, BeamSegment, Contact, End, Mass, Point
from impactlab.scene.method import StepRule
from impactlab.testing.scenes import simulation

SIDE, YOUNG, DENSITY, SPAN = 0.01, 2.157463e11, 7960.0, 0.1535
STEEL = BeamSegment(SPAN, SIDE**2, YOUNG, DENSITY, inertia=SIDE**4 / 12.0, height=SIDE)
SPHERE = 0.03334277  # kg, radius 1 cm
FLAT = 1.580559e10  # N/m^1.5, (4/3) E/(2 (1 - nu^2)) sqrt(R)


def sheared(segment: BeamSegment, poisson: float = 0.3) -> BeamSegment:
    """The same piece of a Timoshenko beam, its section a rectangle."""
    shear = segment.young / (2.0 * (1.0 + poisson)) * segment.area * 5.0 / 6.0
    return BeamSegment(
        segment.length, segment.area, segment.young, segment.density, segment.viscosity, inertia=segment.inertia,
        shear_stiffness=shear, rotary_inertia=segment.density * segment.inertia, height=segment.height,
    )  # fmt: skip


def square_bar(length, shears=False):
    """A piece of a steel beam, 1 cm x 1 cm, that may shear."""
    shear = {"shear_stiffness": 6.7e6, "rotary_inertia": 7850.0 * 1e-8 / 12.0} if shears else {}
    return BeamSegment(length, 1e-4, 2.1e11, 7850.0, inertia=1e-8 / 12.0, **shear)


def ball_on(body, x, law, duration, *, mass, velocity=1.0, gap=0.0, dt=1e-6, face="at", **others):
    """A rigid ball that strikes a rod or beam at x [m]; other fields as of `simulation`."""
    contact = Contact(Point("ball", 0.0, "ball"), Point(body.name, x, f"{body.name}.{face}"), gap)
    bodies = {"ball": Mass("ball", mass, velocity), body.name: body}
    return simulation("ball", bodies, (contact,), duration, None, StepRule(dt=dt), law=law, **others)


def sphere_on_beam(model, integrator, dt, *, ends=("pinned", "pinned"), at=0.5, law=None, segment=STEEL, duration=2e-4,
                   speed=0.01, **given):  # fmt: skip
    """Timoshenko's sphere on a beam: steel, 1 cm x 1 cm, span 15.35 cm, radius 1 cm, 1 cm/s."""
    theory = "euler_bernoulli" if segment.rotary_inertia == 0.0 else "timoshenko"
    ends = [end if isinstance(end, End) else End(end) for end in ends]
    beam = Beam("beam", (segment,), *ends, theory=theory, **given)
    place = at * beam.length
    face = Point("beam", place, f"beam.at({place:g})")
    contact = Contact(Point("sphere", 0.0, "sphere"), face, 0.0)
    bodies = {"sphere": Mass("sphere", SPHERE, speed), "beam": beam}
    return simulation(
        "sphere on beam", bodies, (contact,), duration, integrator, StepRule(dt=dt), round_trip=beam.round_trip,
        model=model, law=law or Hertz(FLAT),
    )  # fmt: skip
