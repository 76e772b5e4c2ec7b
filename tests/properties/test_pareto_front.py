"""The Pareto front against its definition, for any points."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from impactlab.bench.report.fronts import front

NUMBERS = st.integers(0, 6) | st.floats(0.0, 1e9)  # the few integers make ties common
POINTS = st.lists(st.tuples(NUMBERS, NUMBERS), max_size=40)


def beaten(point: tuple[float, float], others: list[tuple[float, float]]) -> bool:
    """The definition: some other point is nowhere worse and somewhere better."""
    return any(other[0] <= point[0] and other[1] <= point[1] and other != point for other in others)


@given(POINTS)
def test_the_front_is_what_no_point_beats(points: list[tuple[float, float]]) -> None:
    assert set(front(points)) == {i for i, point in enumerate(points) if not beaten(point, points)}


@given(POINTS)
def test_along_the_front_errors_fall_as_costs_rise(points: list[tuple[float, float]]) -> None:
    along = [points[i] for i in front(points)]
    assert along == sorted(along)
    assert [error for _, error in along] == sorted((error for _, error in along), reverse=True)


@given(POINTS, st.randoms(use_true_random=False))
def test_the_order_of_the_points_does_not_matter(points: list[tuple[float, float]], random: object) -> None:
    mixed = list(points)
    random.shuffle(mixed)  # type: ignore[attr-defined]
    assert [mixed[i] for i in front(mixed)] == [points[i] for i in front(points)]
