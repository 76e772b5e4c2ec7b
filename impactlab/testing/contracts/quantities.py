"""Contract suite of the quantities of sweeps."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, ClassVar

import numpy as np

from impactlab.contact.addition_deletion import AdditionDeletion
from impactlab.contact.impulse_momentum import ImpulseMomentum
from impactlab.history.base import AbstractHistory
from impactlab.scene.problem import Scene
from impactlab.sweeps.quantities import BODY, CONTACT, LINK, PAIR, WHOLE, labels_of
from impactlab.testing.contracts.common import has_description
from impactlab.testing.contracts.metrics import judged, rigid


class QuantityContract:
    """Properties of every quantity: ``quantity(scene, history)``, a number or one for each label it states."""

    part: ClassVar[Callable[[Scene, AbstractHistory], Any]]

    def found(self, scene: Scene, history: AbstractHistory) -> dict[str, float]:
        """Return the values by label.

        A quantity of the whole run has an empty label.
        """
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
        stepped, exact, scene = judged(AdditionDeletion())
        kicked, _, its_scene = judged(ImpulseMomentum())
        balls, of_balls = rigid()
        return [(scene, stepped), (scene, exact), (its_scene, kicked), (of_balls, balls)]
