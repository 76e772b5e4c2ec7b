"""Times outside a run have no answer: every history refuses them, and allows for the rounding of its own end."""

from __future__ import annotations

import math

import numpy as np
import pytest

from impactlab.contact.penalty import Penalty
from impactlab.errors import ImpactlabError
from impactlab.integrators.adaptive import Adaptive
from impactlab.integrators.newmark import Newmark
from impactlab.models.continuous import Continuous
from impactlab.models.finite_element import FiniteElement
from impactlab.scene.method import Simulation, StepRule
from impactlab.simulate import run
from impactlab.testing.scenes import mass_on_rod

END = 1e-4  # s


def scene(kind: str) -> Simulation:
    model = Continuous() if kind == "exact" else FiniteElement(4)
    integrator = {"exact": None, "stepped": Newmark(), "adaptive": Adaptive()}[kind]
    return mass_on_rod(model, Penalty(1e8), integrator, StepRule(dt=1e-6), duration=END, snapshots=(5e-5,))


@pytest.mark.parametrize("kind", ["exact", "stepped", "adaptive"])
def test_values_outside_the_run_are_refused_and_not_those_of_its_end(kind: str) -> None:
    history = run(*scene(kind))
    for channel in ("position:hammer", "force:hammer|rod.left", "momentum:rod"):
        for outside in (-1e-6, END + 1e-6, math.inf, math.nan):
            with pytest.raises(ImpactlabError, match=r"lies outside the run, 0 to 0\.0001 s") as refused:
                history.evaluate([5e-5, outside], channel)
            assert "longer duration" in refused.value.remedy
        # The end of the run, as sums and products of its steps give it.
        ends = history.evaluate([END, math.nextafter(END, 1.0), END * (1.0 + 1e-12)], channel)
        assert np.all(ends == ends[0])
        assert history.evaluate(-1e-18, channel) == history.evaluate(0.0, channel)
    assert history.evaluate([], "position:hammer").shape == (0,)
    for outside in (-1e-6, 2.0 * END, math.nan):
        with pytest.raises(ImpactlabError, match="lies outside the run"):
            history.field("rod", outside, "displacement")
