"""A collision is the same in every frame: what is measured of it may not depend on a common drift of the bodies."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

import impactlab as il
from impactlab import metrics
from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.energy_conserving import EnergyConserving
from impactlab.contact.penalty import Penalty
from impactlab.errors import StepError
from impactlab.history.frame import carried_energy, common_drift, drift, drift_velocities, groups, touched_in
from impactlab.integrators.base import AbstractIntegrator
from impactlab.integrators.generalised_alpha import GeneralisedAlpha
from impactlab.integrators.newmark import Newmark
from impactlab.models.continuous import Continuous
from impactlab.models.finite_element import FiniteElement
from impactlab.scene import Body, End, Mass, Rod, Segment, Wall
from impactlab.scene.method import Simulation, StepRule
from impactlab.simulate import run
from impactlab.testing.scenes import FREE, in_a_row, simulation, touching
from tests.solving import in_steps, mesh

STEEL = Segment(0.3, 9e-4, 2.1e11, 7850.0)


def train(
    drift: float,
    law: AbstractContactLaw,
    integrator: AbstractIntegrator,
    trips: float = 6.0,
    gravity: float = 0.0,
    force: float = 0.0,
) -> Simulation:
    """Two free steel rods, the left one 1 m/s faster than the right one."""
    one = Rod("one", (STEEL,), End("free", force=force), FREE, drift + 1.0)
    two = Rod("two", (dataclasses.replace(STEEL, length=0.45),), FREE, FREE, drift)
    model, step = FiniteElement(40, "lumped"), StepRule(dt=7.27e-7)
    return in_a_row((one, two), model, law, integrator, step, round_trips=trips, gravity=gravity)


def gain_of(velocity: float) -> float:
    """Return the gain of energy that a run is failed for."""
    with pytest.raises(StepError, match="energy grew by") as failed:
        run(*train(velocity, EnergyConserving(), GeneralisedAlpha()))
    assert failed.value.history is not None
    return failed.value.history.energy.largest_gain


def test_energy_created_is_reported_alike_in_a_moving_frame() -> None:
    assert gain_of(0.0) > 5.0
    assert gain_of(10.0) == pytest.approx(gain_of(0.0), rel=0.05)


def test_gravity_and_a_load_on_a_train_give_its_frame_no_more_energy() -> None:
    # Free fall: the work of gravity on the drift is no energy that a collision could lose or gain.
    falling = run(*train(50.0, Penalty(1e9), Newmark(), gravity=9.81))
    resting = run(*train(0.0, Penalty(1e9), Newmark()))
    assert falling.energy.scale == pytest.approx(resting.energy.scale, rel=1e-9)
    pushed, alone = (train(v, Penalty(1e9), Newmark(), gravity=g, force=1e5) for v, g in ((50.0, 9.81), (0.0, 0.0)))
    works = []
    for scene in (pushed, alone):
        book = run(*scene).energy
        works.append(np.max(np.abs(book.work - carried_energy(scene.scene, book.time).work)))
    assert drift_velocities(alone.scene)["one"] == pytest.approx(0.4)
    assert works[0] == pytest.approx(works[1], rel=1e-7)


@pytest.mark.parametrize("velocity", [0.0, 10.0, 1000.0])
def test_errors_do_not_shrink_in_a_moving_frame(velocity: float) -> None:
    scene = train(velocity, Penalty(2e9), Newmark(), trips=3.0)
    exact = run(*scene.but(integrator=None, model=Continuous()))
    history = run(*scene)
    at_rest = ERRORS.setdefault("face", metrics.face_displacement(history, exact, scene.scene))
    assert at_rest is not None
    assert metrics.face_displacement(history, exact, scene.scene) == pytest.approx(at_rest, rel=1e-3)
    leaving = metrics.installed()["exit_velocity"]
    first = ERRORS.setdefault("exit", leaving(history, exact, scene.scene))
    assert leaving(history, exact, scene.scene) == pytest.approx(first, rel=1e-3)


ERRORS: dict[str, float | None] = {}


def balls(*contacts: tuple[str, str], wall: bool = False) -> Simulation:
    bodies: dict[str, Body] = {name: Mass(name, 1.0 + n, 2.0 * n) for n, name in enumerate("abc")}
    bodies |= {"wall": Wall("wall")} if wall else {}
    joined = tuple(touching(bodies[a], bodies[b]) for a, b in contacts)
    return simulation("balls", bodies, joined, 1.0, None, StepRule(dt=1e-3), gravity=3.0, law=Penalty(1e6))


def test_bodies_joined_by_contacts_share_a_frame_and_a_wall_holds_it() -> None:
    assert {group.bodies for group in groups(balls(("a", "b")).scene)} == {("a", "b"), ("c",)}
    assert drift_velocities(balls(("a", "b")).scene) == {"a": 4.0 / 3.0, "b": 4.0 / 3.0, "c": 4.0}
    held = balls(("a", "b"), ("b", "wall"), wall=True)
    assert drift_velocities(held.scene) == {"a": 0.0, "b": 0.0, "c": 4.0, "wall": 0.0}
    # A wall that nobody reached holds nobody.
    assert drift_velocities(held.scene, {"a|b"})["a"] == 4.0 / 3.0
    t = np.array([0.0, 2.0])
    assert drift(held.scene, "position:c", t).tolist() == [0.0, 14.0]
    assert drift(held.scene, "position:a", t).tolist() == [0.0, 0.0]


def test_bodies_that_only_drift_keep_the_energy_of_their_drift_as_scale() -> None:
    scene = balls().but(bodies={"a": Mass("a", 2.0, 3.0)}, gravity=0.0, integrator=None, step=StepRule(dt=0.1))
    assert math.isclose(run(*scene).energy.scale, 9.0)


@pytest.mark.parametrize(
    "integrator",
    [{"kind": "hht_alpha"}, {"kind": "newmark", "beta": 0.3025, "gamma": 0.6}, {"kind": "bathe"}],
    ids=lambda each: each["kind"],
)
def test_a_rod_that_falls_freely_neither_gains_nor_loses(integrator: dict[str, Any]) -> None:
    """The rounding of its energy less that of its fall was the scale: 1e5 steps had losses of 190 %."""
    solve = in_steps(2e-3, integrator, mesh(10), dt=1e-7)
    rod = il.Rod(length=1.0, area=1e-4, material="steel")
    book = il.run(il.Case(bodies={"rod": rod}, gravity=9.81, solve=solve)).energy
    assert book.scale == pytest.approx(0.5 * 0.785 * (9.81 * 2e-3) ** 2, rel=1e-6)  # J, of the fall
    assert max(book.largest_gain, book.largest_loss) < 1e-6


def test_the_error_of_a_body_that_only_falls_is_relative_to_its_way() -> None:
    """Of two runs that are a little off alike, their distance from free fall is no scale."""
    bodies: list[Body] = [Mass("one", 1.0, 0.2), Mass("two", 2.0), Mass("three", 1.0)]
    contacts = touching(bodies[0], bodies[1]), touching(bodies[1], bodies[2], 1.0)
    by_name = {body.name: body for body in bodies}
    law, step = Penalty(stiffness=1e6), StepRule(dt=1e-6)
    scene, _ = simulation("s", by_name, contacts, 2e-3, None, step, gravity=9.81, law=law)
    t, met = metrics.midpoints(scene.duration), {contacts[0].name}
    fall = 0.5 * 9.81 * t**2
    assert np.array_equal(common_drift(scene, "position:three", t, met), np.zeros_like(t))
    assert (
        metrics.relative_l2(fall * (1 + 2e-9), fall * (1 + 1e-9), common_drift(scene, "position:three", t, met))
        < 1.1e-9
    )
    # Bodies that meet drift together, and that is no part of their scale.
    assert common_drift(scene, "position:one", t, met) == pytest.approx(0.2 / 3.0 * t + fall)
    assert drift(scene, "position:three", t) == pytest.approx(0.05 * t + fall)


@pytest.mark.parametrize("speed", [0.0, 1.0])
def test_a_link_to_a_wall_holds_the_frame(speed: float) -> None:
    """A mass strikes another one that a joint ties to a wall: all of its energy counts, as in a rod's exact solution.

    By the contacts that close alone both seemed to be free, and a third of the energy seemed to drift away with them.
    """
    bodies = {"hammer": il.Mass(1.0, velocity=1.0 + speed), "block": il.Mass(2.0, velocity=speed), "wall": il.Wall()}
    contacts = [
        il.Contact("hammer", "block", {"kind": "penalty", "stiffness": 1e6}),
        il.Contact("block", "wall", {"kind": "slack", "stiffness": 1e5}),
    ]
    solve = {"duration": 5e-3, "integrator": {"kind": "newmark"}, "step": {"dt": 1e-5}}
    history = il.run(il.Case(bodies=bodies, contacts=contacts, solve=solve))
    assert [span.contact for span in history.contacts] == ["hammer|block"]
    assert touched_in(history) == {"hammer|block", "block|wall"}
    assert history.energy.at_stake == pytest.approx(0.5 * (1.0 + speed) ** 2 + speed**2, rel=1e-12)
    assert drift_velocities(history.scene, touched_in(history)) == {"hammer": 0.0, "block": 0.0, "wall": 0.0}
