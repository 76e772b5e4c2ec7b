"""Properties of every exact answer: momentum, energy, characteristics, causality, mirror, units."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from impactlab.contact.penalty import Penalty
from impactlab.exact.solve import solve
from impactlab.scene import End, Mass, Segment
from tests.reference.exact_scenes import CLAMPED, FREE, HARD, point, rod, scene, struck

pytestmark = pytest.mark.slow

alphas = st.floats(-1.5, 1.5).map(lambda x: 10.0**x)
ends = st.one_of(
    st.just(FREE),
    st.just(CLAMPED),
    st.builds(End, st.just("spring"), st.floats(0.1, 10.0)),
    st.builds(End, st.just("dashpot"), st.floats(0.1, 10.0)),
    st.builds(End, st.just("mass"), st.floats(0.1, 10.0)),
)
laws = st.one_of(st.just(HARD), st.builds(Penalty, st.floats(0.1, 50.0), st.floats(0.0, 5.0)))
quick = settings(max_examples=20, deadline=None, print_blob=True)


@quick
@given(alphas, ends, laws, st.sampled_from([0.0, 0.05, -0.05]))
def test_energy_balance(alpha, far, law, gravity):
    history = solve(*struck(alpha, 12.0, far, law).but(gravity=gravity))
    book = history.energy
    scale = max(1.0, float(np.max(book.total)) / book.scale)
    assert max(book.largest_gain, book.largest_loss) < 1e-12 * scale * (10.0 if gravity else 1.0)
    for loss in book.booked.values():
        assert np.min(np.diff(loss)) >= -1e-13 * book.scale
    for span in history.contacts:
        assert span.impulse >= 0.0


@quick
@given(alphas, laws)
def test_the_momentum_of_the_mass_goes_to_the_free_rod(alpha, law):
    history = solve(*struck(alpha, 12.0, FREE, law))
    impulse = sum(span.impulse for span in history.contacts)
    given_ = (1.0 - float(history.evaluate(12.0, "velocity:hammer"))) / alpha
    taken = float(history.evaluate(12.0, "momentum:rod"))
    assert given_ == pytest.approx(impulse, abs=1e-12 / min(alpha, 1.0))
    assert taken == pytest.approx(impulse, abs=1e-12 / min(alpha, 1.0))


@quick
@given(alphas, ends, st.floats(0.05, 0.95), st.floats(0.05, 0.95), st.floats(0.0, 9.0))
def test_characteristics(alpha, far, x0, x1, t):
    history = solve(*struck(alpha, 12.0, far))
    low, high = sorted((x0, x1))
    for sign, start, stop in ((1.0, low, high), (-1.0, high, low)):
        jumps = np.concatenate([history.jumps(f"velocity:rod@{start:.6g}"), [-1.0]])
        if np.min(np.abs(jumps - t)) < 1e-4:
            continue
        first = [float(history.evaluate(t, f"{what}:rod@{float(f'{start:.6g}')!r}")) for what in ("velocity", "stress")]
        there, here = float(f"{stop:.6g}"), float(f"{start:.6g}")
        later = t + abs(there - here)
        last = [float(history.evaluate(later, f"{what}:rod@{there!r}")) for what in ("velocity", "stress")]
        assert last[0] + sign * last[1] == pytest.approx(first[0] + sign * first[1], abs=1e-9)


@quick
@given(alphas, ends, st.floats(0.01, 0.99), st.floats(0.0, 0.999))
def test_nothing_moves_before_the_wave_arrives(alpha, far, x, share):
    history = solve(*struck(alpha, 2.0, far))
    name = float(f"{x:.6g}")
    for quantity in ("displacement", "velocity", "stress", "strain", "force"):
        assert float(history.evaluate(share * name, f"{quantity}:rod@{name!r}")) == 0.0


@quick
@given(alphas, ends, laws)
def test_mirrored_scene_has_the_mirrored_solution(alpha, far, law):
    one, other = solve(*struck(alpha, 8.0, far, law)), solve(*struck(alpha, 8.0, far, law, mirrored=True))
    assert [e.kind for e in one.events] == [e.kind for e in other.events]
    force = next(channel for channel in other.channels() if channel.startswith("force:"))
    for mine, theirs in zip(one.events, other.events, strict=True):
        if abs(mine.time - theirs.time) > 1e-12:  # a force that falls to zero slowly: rounding of it over its rate
            assert mine.kind == "open"
            assert abs(mine.time - theirs.time) < 1e-9
            assert float(other.evaluate(mine.time, force)) == pytest.approx(0.0, abs=1e-14)
    t = np.linspace(0.0, 8.0, 97)
    assert one.evaluate(t, "position:hammer") == pytest.approx(-other.evaluate(t, "position:hammer"), abs=1e-12)
    t = np.minimum(t + 0.0123, 8.0)
    there = other.evaluate(t, "displacement:rod@0.75")
    assert one.evaluate(t, "displacement:rod@0.25") == pytest.approx(-there, abs=1e-12)


@quick
@given(st.floats(0.1, 0.95), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_results_scale_with_units(alpha, length, time, weight):
    metre, second, kilogram = 10.0**length, 10.0**time, 10.0**weight
    plain = solve(*struck(alpha, 6.0))
    bar = rod(length=metre, right=CLAMPED)
    segment = Segment(metre, metre**2, kilogram / (metre * second**2), kilogram / metre**3)
    bar = replace(bar, segments=(segment,))
    hammer = Mass("hammer", kilogram / alpha, metre / second)
    other = solve(
        *scene([hammer, bar], [(point(hammer), point(bar, "left"), 0.0, HARD)], 6.0 * second, round_trip=2.0 * second)
    )
    assert [e.time / second for e in other.events] == pytest.approx([e.time for e in plain.events], abs=1e-10)
    newton = kilogram * metre / second**2
    assert other.contacts[0].peak_force / newton == pytest.approx(plain.contacts[0].peak_force, rel=1e-11)
