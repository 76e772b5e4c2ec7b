"""The Pareto front of rows against its definition, for any costs and errors."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from impactlab.bench.report.fronts import front_of
from impactlab.bench.report.views import NORMS, gathered
from impactlab.bench.schema import Row

NUMBERS = st.integers(1, 6).map(float) | st.integers(1, 999).map(float)  # the few make ties common
POINTS = st.lists(st.tuples(NUMBERS, NUMBERS), min_size=1, max_size=40)
Pair = tuple[float, float]


def front(points: list[Pair]) -> list[Pair]:
    """Return the points on the front of a scene whose rows have these times [s] and errors."""
    known = {"case": "a", "status": "completed", "reference": "st_venant", "reference_uncertainty": 0.0}
    rows = [
        Row(**known, method=f"m{i}", solve_s=cost, displacement=error, impulse=error)  # type: ignore[arg-type]
        for i, (cost, error) in enumerate(points)
    ]
    (scene,) = gathered(rows)
    return [(point.cost, point.error) for point in front_of(scene.rows, NORMS[0], scene)]


def beaten(point: Pair, others: list[Pair]) -> bool:
    """The definition: some other point is nowhere worse and somewhere better."""
    return any(other[0] <= point[0] and other[1] <= point[1] and other != point for other in others)


@given(POINTS)
def test_the_front_has_the_points_that_none_dominates(points: list[Pair]) -> None:
    assert sorted(front(points)) == sorted(point for point in points if not beaten(point, points))


@given(POINTS)
def test_along_the_front_errors_fall_as_costs_rise(points: list[Pair]) -> None:
    along = front(points)
    assert along == sorted(along)
    assert [error for _, error in along] == sorted((error for _, error in along), reverse=True)


@given(POINTS, st.randoms(use_true_random=False))
def test_the_order_of_the_points_does_not_matter(points: list[Pair], random: object) -> None:
    mixed = list(points)
    random.shuffle(mixed)  # type: ignore[attr-defined]
    assert front(mixed) == front(points)
