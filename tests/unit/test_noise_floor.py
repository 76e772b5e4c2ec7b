"""Touches made by rounding, or before any wave, are no contacts; the smallest real ones are."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import impactlab as il
from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.penalty import Penalty
from impactlab.contact.slack import Slack
from impactlab.history import ContactSpan, Event
from impactlab.history.arrivals import first_arrivals
from impactlab.history.noise_floor import MIN_SHARE, above_noise, share_of
from impactlab.integrators.adaptive import Adaptive
from impactlab.integrators.central_difference import CentralDifference
from impactlab.integrators.exact_modal import ExactModal
from impactlab.integrators.newmark import Newmark
from impactlab.metrics.collisions import collisions
from impactlab.models.continuous import Continuous
from impactlab.models.finite_element import FiniteElement
from impactlab.models.modal import Modal
from impactlab.scene import Body, End, Mass, Rayleigh, Rod, Segment, Table, Wall
from impactlab.scene.method import Simulation, StepRule
from impactlab.simulate import run
from impactlab.testing.scenes import FREE, in_a_row, simulation, touching

STEEL = Segment(0.2, 3e-4, 2.1e11, 7900.0)
TRANSIT = 0.2 / STEEL.wave_speed


def chain(model: Any, integrator: Any, law: Any, dt: float = 2e-7) -> Simulation:
    """A moving rod and two at rest, which touch each other with a gap of zero."""
    rods = [Rod(name, (STEEL,), FREE, FREE, 10.0 if name == "a" else 0.0) for name in "abc"]
    return in_a_row(rods, model, law, integrator, StepRule(dt=dt), duration=3.5 * TRANSIT)


SPRING = Penalty(2e9)
DESCRIPTIONS = {
    "implicit": (FiniteElement(40), Newmark(), SPRING),
    "implicit, hard": (FiniteElement(40), Newmark(), AdditionDeletion()),
    "modal": (Modal(None, 20), ExactModal(), SPRING),
    "explicit": (FiniteElement(40, "lumped"), CentralDifference(), AdditionDeletion()),
    "adaptive": (FiniteElement(20), Adaptive(relative_tolerance=1e-6), SPRING),
    "exact": (Continuous(), None, SPRING),
}


@pytest.mark.parametrize("name", [name for name in DESCRIPTIONS if name != "adaptive"])  # it has the gap below
def test_a_gap_of_zero_behind_the_first_contact_is_not_touched_before_a_wave_arrives(name: str) -> None:
    scene = chain(*DESCRIPTIONS[name])
    history = run(*scene)
    behind = [event.time for event in history.events if event.contact == "b.right|c.left"]
    assert behind[0] >= 0.998 * TRANSIT
    assert behind[0] <= 1.3 * TRANSIT
    largest = max(span.impulse for span in history.contacts)
    assert min(span.impulse for span in history.contacts) > MIN_SHARE * largest
    # The impulses of a contact still add up to the momentum that its bodies have got.
    given = sum(span.impulse for span in history.contacts if span.contact == "b.right|c.left")
    assert given == pytest.approx(float(history.evaluate(scene.scene.duration, "momentum:c")), rel=1e-6)
    closings = sum(event.kind == "close" for event in history.events)
    assert closings == len(history.contacts)
    for blow in collisions(history):
        assert blow.restitution is None or 0.0 <= blow.restitution < 2.5


def apart(scene: Simulation, first: float, second: float, **other: Any) -> Simulation:
    """Return the scene with gaps [m] before its contacts."""
    gaps = zip(scene.scene.contacts, (first, second), strict=True)
    return scene.but(contacts=tuple(dataclasses.replace(contact, gap=gap) for contact, gap in gaps), **other)


@pytest.mark.parametrize("name", DESCRIPTIONS)
def test_faces_behind_a_gap_are_not_touched_before_the_wave_of_the_impact_arrives(name: str) -> None:
    """Meshes that disperse waves, and modes, closed them up to a flight time too early."""
    scene = apart(chain(*DESCRIPTIONS[name]), 1e-3, 0.0, duration=1e-4 + 3.5 * TRANSIT)  # a flies for 1e-4 s
    history = run(*scene)
    first, behind = ([e.time for e in history.events if e.contact == c] for c in ("a.right|b.left", "b.right|c.left"))
    assert first[0] == pytest.approx(1e-4, rel=1e-3)
    assert 0.998 * (1e-4 + TRANSIT) <= behind[0] <= 1e-4 + 1.3 * TRANSIT
    given = sum(span.impulse for span in history.contacts if span.contact == "b.right|c.left")
    assert given == pytest.approx(float(history.evaluate(scene.scene.duration, "momentum:c")), rel=1e-6)


def test_contacts_with_a_gap_close_in_free_flight_or_by_a_wave() -> None:
    scene = apart(chain(*DESCRIPTIONS["exact"]), 1e-3, 2e-3)
    flight = {"a.right|b.left": pytest.approx(1e-4), "b.right|c.left": pytest.approx(1e-4 + TRANSIT)}
    assert first_arrivals(*scene) == flight
    # c flies towards b, and is there before any wave.
    bodies = dict(scene.scene.bodies, c=dataclasses.replace(scene.scene.bodies["c"], velocity=-20.0))
    soon = {"a.right|b.left": pytest.approx(1e-4), "b.right|c.left": pytest.approx(1e-4)}
    assert first_arrivals(*scene.but(bodies=bodies)) == soon
    # Held or damped as a whole, a body that moves does not fly on; a link may move bodies at rest.
    for change in (
        {"right": End("spring", 1e6)},
        {"damping": Rayleigh(mass=1.0)},
        {"displacement": Table((0.0, 0.2), (0.0, 1e-6))},
    ):
        moved = dict(scene.scene.bodies, a=dataclasses.replace(scene.scene.bodies["a"], **change))
        assert first_arrivals(*scene.but(bodies=moved))["a.right|b.left"] == 0.0
    linked = apart(chain(Continuous(), None, Slack(1e6)), 1e-3, 0.0)
    assert first_arrivals(*linked)["a.right|b.left"] == 0.0


def test_an_early_contact_of_a_run_that_diverged_begins_within_the_run() -> None:
    """It began with the wave, after the end of the run: warnings read the gap there, and the run was refused."""
    scene = apart(chain(*DESCRIPTIONS["exact"]), 1e-3, 2e-3)  # a flies for 1e-4 s
    found = touches("a.right|b.left", (0.5e-4, None, 1.0))
    events, spans = above_noise(*scene, *found, reached=0.8e-4)
    assert [event.time for event in events] == [span.start for span in spans] == [0.8e-4]
    assert [event.time for event in above_noise(*scene, *found)[0]] == [pytest.approx(1e-4, rel=2e-3)]


def test_waves_reach_contacts_at_rest_over_the_way_between_them() -> None:
    scene = chain(*DESCRIPTIONS["exact"])
    assert first_arrivals(*scene) == {
        "a.right|b.left": 0.0,
        "b.right|c.left": pytest.approx(TRANSIT),
    }
    damped = dataclasses.replace(STEEL, viscosity=1e3)
    body = dataclasses.replace(scene.scene.bodies["b"], segments=(damped,))
    assert first_arrivals(*scene.but(bodies={**scene.scene.bodies, "b": body}))["b.right|c.left"] == 0.0
    pushed = dataclasses.replace(scene.scene.bodies["c"], right=End("free", force=1.0))
    still = {**scene.scene.bodies, "a": dataclasses.replace(scene.scene.bodies["a"], velocity=0.0), "c": pushed}
    loaded = first_arrivals(*scene.but(bodies=still))
    assert loaded == {"b.right|c.left": pytest.approx(TRANSIT), "a.right|b.left": pytest.approx(2.0 * TRANSIT)}
    assert set(first_arrivals(*scene.but(gravity=9.81)).values()) == {0.0}


def balls(*pairs: tuple[str, str]) -> Simulation:
    names = dict.fromkeys(name for pair in pairs for name in pair)
    bodies: dict[str, Body] = {
        name: Wall(name) if name == "wall" else Mass(name, 1.0, 1.0 + n) for n, name in enumerate(names)
    }
    contacts = tuple(touching(bodies[a], bodies[b]) for a, b in pairs)
    return simulation("balls", bodies, contacts, 1.0, None, StepRule(dt=1e-3), law=Penalty(1e6))


def touches(contact: str, *spans: tuple[float, float | None, float]) -> tuple[list[Event], list[ContactSpan]]:
    """Return the events and spans of one contact from (start, end, impulse)."""
    events = [Event(t, contact, k) for a, b, _ in spans for t, k in ((a, "close"), (b, "open")) if t is not None]  # type: ignore[arg-type]
    return events, [ContactSpan(contact, a, b, p, 10.0 * p) for a, b, p in spans]


def test_touches_by_rounding_are_left_out_and_their_impulses_are_kept() -> None:
    found = touches("a|b", (0.0, 0.1, 1.0), (0.2, 0.3, 1e-13), (0.4, 0.5, 2e-10), (0.6, None, 3e-12))
    events, spans = above_noise(*balls(("a", "b")), *found)
    assert [(span.start, span.end) for span in spans] == [(0.0, 0.1), (0.4, 0.5)]
    assert [event.time for event in events] == [0.0, 0.1, 0.4, 0.5]
    assert spans[1].impulse == 2e-10 + 1e-13 + 3e-12
    # A touch that nothing else of its contact can stand for is left out all the same.
    events, spans = above_noise(
        *balls(("a", "b"), ("b", "c")),
        *(x + y for x, y in zip(touches("a|b", (0.0, 0.1, 1.0)), touches("b|c", (0.2, 0.3, 1.85e-298)), strict=True)),
    )
    assert [span.contact for span in spans] == ["a|b"]
    assert {event.contact for event in events} == {"a|b"}


def test_a_small_contact_elsewhere_is_not_noise_of_a_large_one() -> None:
    hammer, pellet = touches("a|b", (0.0, 0.1, 1e3)), touches("c|d", (0.0, 0.1, 1e-12))
    both = [x + y for x, y in zip(hammer, pellet, strict=True)]
    assert len(above_noise(*balls(("a", "b"), ("c", "d")), *both)[1]) == 2
    # A wall in common joins no bodies, a body in common does.
    walled = [x + y for x, y in zip(hammer, touches("c|wall", (0.0, 0.1, 1e-12)), strict=True)]
    assert len(above_noise(*balls(("a", "b"), ("b", "wall"), ("c", "wall")), *walled)[1]) == 2
    joined = [x + y for x, y in zip(hammer, touches("b|c", (0.2, 0.3, 1e-12)), strict=True)]
    assert len(above_noise(*balls(("a", "b"), ("b", "c")), *joined)[1]) == 1


def test_an_opening_by_rounding_does_not_split_a_contact() -> None:
    found = touches("a|b", (0.0, 0.1, 1.0), (0.1 + 1e-16, 0.2, 3.0), (0.2 + 1e-13, 0.3, 2.0), (0.4, None, 1.0))
    events, spans = above_noise(*balls(("a", "b")), *found)
    assert [(span.start, span.end, span.impulse, span.peak_force) for span in spans] == [
        (0.0, 0.3, 6.0, 30.0),
        (0.4, None, 1.0, 10.0),
    ]
    assert [event.time for event in events] == [0.0, 0.3, 0.4]


def test_a_touch_without_length_keeps_the_opening_of_the_contact_before_it() -> None:
    """Located events: faces that touch again at the instant at which they open. Both openings were left out."""
    found = touches("a|b", (0.0, 0.1, 1.0), (0.1, 0.1, 1e-3), (0.4, 0.5, 1.0))
    events, spans = above_noise(*balls(("a", "b")), *found)
    assert [(span.start, span.end) for span in spans] == [(0.0, 0.1), (0.4, 0.5)]
    assert [(event.time, event.kind) for event in events] == [
        (0.0, "close"),
        (0.1, "open"),
        (0.4, "close"),
        (0.5, "open"),
    ]


def test_located_events_are_the_ends_of_their_contacts() -> None:
    history = il.run(il.load_case("all_methods").method("macneal"))
    dated = {kind: [event.time for event in history.events if event.kind == kind] for kind in ("close", "open")}
    assert dated["close"] == [span.start for span in history.contacts]
    assert dated["open"] == [span.end for span in history.contacts if span.end is not None]


def test_waves_that_arrive_together_do_not_part_the_faces_of_a_specimen() -> None:
    bar: dict[str, Any] = {"area": 201.06e-6, "material": {"young": 210e9, "density": 7850.0}}
    bodies: dict[str, il.Rod] = {
        "striker": il.Rod(length=0.2, velocity=10.0, **bar),
        "incident": il.Rod(length=1.0, **bar),
        "specimen": il.Rod(length=8e-3, area=78.54e-6, material={"young": 70e9, "density": 2700.0}),
        "transmission": il.Rod(length=1.0, **bar),
    }
    faces = [f"{name}.{side}" for name in bodies for side in ("left", "right")][1:-1]
    contacts = [il.Contact(a, b) for a, b in zip(faces[::2], faces[1::2], strict=True)]
    case = il.Case(bodies=bodies, contacts=contacts, solve={"duration": 6e-4, "tolerance": 1e-3})
    history = il.run(case)
    # The end of the pulse reaches the left face together with an echo of the specimen, at 583 us.
    assert [span.contact for span in history.contacts].count("incident.right|specimen.left") == 2
    swept = il.sweep(case, {"bodies.striker.velocity": [9.0, 10.0, 11.0]})
    assert swept["contacts"].values.tolist() == [[1.0, 2.0, 2.0]] * 3


def test_kicks_by_rounding_are_not_counted() -> None:
    events = [Event(0.1 * n, "a|b", "impulse", p) for n, p in enumerate((1e-20, 1.0, 2.0, 1e-15))]
    span = ContactSpan("a|b", 0.0, 0.3, 3.0, None, 1e-20, 4)
    left, spans = above_noise(*balls(("a", "b")), events, [span])
    assert [event.impulse for event in left] == [1.0, 2.0]
    assert (spans[0].kicks, spans[0].first_impulse, spans[0].start, spans[0].impulse) == (2, 1.0, 0.1, 3.0)


class CountedPasses(list[Event]):
    """Events that count how often they are gone through."""

    passes = 0

    def __iter__(self) -> Iterator[Event]:
        self.passes += 1
        return super().__iter__()


def test_passes_over_the_events_do_not_grow_with_the_contacts() -> None:
    passes = []
    for count in (10, 300):
        pairs = [(f"b{n}", f"b{n + 1}") for n in range(count)]
        names = ["|".join(pair) for pair in pairs]
        events = CountedPasses(Event(t, name, "impulse", p) for t, p in ((0.1, 1.0), (0.2, 1e-20)) for name in names)
        spans = [ContactSpan(name, 0.1, 0.2, 1.0, None, 1.0, 2) for name in names]
        left, kept = above_noise(*balls(*pairs), events, spans)
        assert len(left) == len(kept) == count
        assert all(span.kicks == 1 for span in kept)
        passes.append(events.passes)
    assert passes[0] == passes[1]


def test_the_floor_follows_the_steps_of_a_run() -> None:
    assert share_of(0.0) == share_of(100.0) == MIN_SHARE
    assert share_of(1e5) == pytest.approx(8e5 * np.finfo(float).eps)
    assert share_of(1e30) == 1e-8
