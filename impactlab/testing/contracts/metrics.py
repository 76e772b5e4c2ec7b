"""Contract suite of metrics."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any, ClassVar

import numpy as np

from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.base import AbstractContactLaw
from impactlab.contact.impulse_momentum import ImpulseMomentum
from impactlab.contact.penalty import Penalty
from impactlab.history.base import AbstractHistory
from impactlab.integrators.exact_modal import ExactModal
from impactlab.metrics.norms import Metric
from impactlab.models.continuous import Continuous
from impactlab.models.modal import Modal
from impactlab.scene.bodies import End, Mass, Wall
from impactlab.scene.method import StepRule
from impactlab.scene.problem import Contact, Point, Scene
from impactlab.simulate import driver as simulate
from impactlab.sweeps.quantities import BODY, CONTACT, LINK, PAIR, WHOLE, labels_of
from impactlab.testing.contracts.common import has_description
from impactlab.testing.scenes import mass_on_rod, simulation


@cache
def stepped_and_exact(law: AbstractContactLaw) -> tuple[AbstractHistory, AbstractHistory, Scene]:
    """Return a run, the exact history, and the scene of the run.

    A mass strikes a free rod, described by few modes.
    """
    options: dict[str, Any] = {"right": End("free"), "mass_ratio": 0.5, "round_trips": 2.0}
    run = mass_on_rod(Modal(None, 6), law, ExactModal(), **options)
    exact = mass_on_rod(Continuous(), AdditionDeletion(), **options)
    return simulate.run(*run), simulate.run(*exact), run.scene


@cache
def rigid() -> tuple[AbstractHistory, Scene]:
    """Return a run without a rod, so without a T, and its scene."""
    bodies: dict[str, Any] = {"ball": Mass("ball", 1.0, 1.0), "wall": Wall("wall")}
    contact = Contact(Point("ball", 0.0, "ball"), Point("wall", 0.0, "wall"), 0.5)
    run = simulation("rigid", bodies, (contact,), 1.0, ExactModal(), StepRule(dt=1e-3), law=Penalty(1.0e4))
    return simulate.run(*run), run.scene


def sound(value: Any) -> bool:
    """Return whether a metric may have a value: None, or a number from 0."""
    return value is None or (isinstance(value, int | float) and math.isfinite(value) and value >= 0.0)


class MetricContract:
    """Properties of every metric: ``metric(history, reference, scene)``, a number or None."""

    part: ClassVar[Metric]

    def measured(self, history: AbstractHistory, reference: AbstractHistory, scene: Scene) -> float | None:
        """Return the value of the metric."""
        return type(self).part(history, reference, scene)

    def test_it_has_a_description(self) -> None:
        has_description(type(self).part)

    def test_its_value_is_a_number_or_none(self) -> None:
        found = self.measured(*stepped_and_exact(AdditionDeletion()))
        assert sound(found), f"its value is {found!r}, neither None nor a number from 0 on"

    def test_a_reference_is_at_no_distance_from_itself(self) -> None:
        _, exact, scene = stepped_and_exact(AdditionDeletion())
        found = self.measured(exact, exact, scene)
        assert found is None or abs(found) < 1e-12, f"its value is {found!r}, not 0"

    def test_it_gives_the_same_value_twice(self) -> None:
        run = stepped_and_exact(AdditionDeletion())
        assert self.measured(*run) == self.measured(*run)

    def test_a_law_without_a_force_does_not_stop_it(self) -> None:
        found = self.measured(*stepped_and_exact(ImpulseMomentum()))
        assert found is None or isinstance(found, int | float), f"its value is {found!r}, neither None nor a number"

    def test_a_scene_without_a_rod_does_not_stop_it(self) -> None:
        history, scene = rigid()
        found = self.measured(history, history, scene)
        assert sound(found), f"its value is {found!r}, neither None nor a number from 0 on"


class QuantityContract:
    """Properties of every quantity: ``quantity(scene, history)``, a number or one for each label it states."""

    part: ClassVar[Callable[[Scene, AbstractHistory], Any]]

    def found(self, scene: Scene, history: AbstractHistory) -> dict[str, float]:
        """Return the values by label, which is empty for a quantity of the whole run."""
        value = type(self).part(scene, history)
        return dict(value) if isinstance(value, Mapping) else {"": value}

    def test_it_has_a_description(self) -> None:
        has_description(type(self).part)

    def test_it_states_its_unit_and_its_labels(self) -> None:
        assert isinstance(getattr(type(self).part, "unit", None), str)
        assert getattr(type(self).part, "over", None) in (CONTACT, PAIR, BODY, LINK, WHOLE)

    def test_its_values_are_numbers_of_its_own_labels(self) -> None:
        for scene, history in self.runs():
            allowed = {*labels_of(scene, getattr(type(self).part, "over", WHOLE))} or {""}
            for label, value in self.found(scene, history).items():
                assert label in allowed, f"{label!r} is not one of the labels {', '.join(map(repr, sorted(allowed)))}"
                assert isinstance(value, int | float | np.integer | np.floating), f"{value!r} is no number"

    def test_it_gives_the_same_value_twice(self) -> None:
        for scene, history in self.runs():
            assert repr(self.found(scene, history)) == repr(self.found(scene, history))

    def runs(self) -> list[tuple[Scene, AbstractHistory]]:
        """Return scenes with their runs: stepped, exact, of impulses, and without a rod."""
        stepped, exact, scene = stepped_and_exact(AdditionDeletion())
        kicked, _, its_scene = stepped_and_exact(ImpulseMomentum())
        balls, of_balls = rigid()
        return [(scene, stepped), (scene, exact), (its_scene, kicked), (of_balls, balls)]
