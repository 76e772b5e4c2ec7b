"""Names of bodies above a Lagrange diagram stand over their bodies and not over one another."""

import itertools

import numpy as np
import pytest
from matplotlib.text import Text

import impactlab as il
from impactlab.report.figures.animation import film

LENGTHS = {"striker": 0.2, "incident": 1.0, "first_disc": 0.008, "second_disc": 0.008, "transmission": 1.0}


@pytest.fixture(scope="module")
def history():
    names = list(LENGTHS)
    faces = [(f"{left}.right", f"{right}.left") for left, right in itertools.pairwise(names)]
    bodies = {name: il.Rod(length=length, area=1e-4, material="steel") for name, length in LENGTHS.items()}
    bodies["striker"]["velocity"] = 1.0
    return il.run(
        il.Case(
            bodies=bodies,
            contacts=[il.Contact(left, right, {"kind": "addition_deletion"}) for left, right in faces],
            solve={"model": {"kind": "continuous"}, "duration": 3e-4},
        )
    )


@pytest.mark.parametrize("make", [lambda run: run.plot_xt(), lambda run: film(run)[0]], ids=["diagram", "animation"])
def test_names_of_short_bodies_are_not_printed_over_each_other(history, make):
    figure = make(history)
    figure.canvas.draw()
    above = [
        text
        for axis in figure.axes
        for text in axis.findobj(Text)
        if text.get_text() in LENGTHS and text.get_transform() == axis.get_xaxis_transform()
    ]
    shown = {text.get_text(): text for text in above}
    assert {"striker", "incident", "transmission"} <= set(shown)
    assert len(shown) == len(above)
    boxes = [text.get_window_extent() for text in above]
    assert not any(one.overlaps(other) for one, other in itertools.combinations(boxes, 2))
    starts = dict(zip(LENGTHS, itertools.accumulate(LENGTHS.values(), initial=0.0), strict=False))
    for name in ("striker", "incident", "transmission"):
        assert shown[name].get_position()[0] == pytest.approx(starts[name] + 0.5 * LENGTHS[name])


def test_each_of_many_exact_rods_is_drawn_in_places_by_its_share_of_the_length() -> None:
    steel = {"young": 2.1e11, "density": 7850.0}
    lengths = [0.5, *[0.05] * 20]
    rods = {
        f"rod_{number}": il.Rod(length=length, area=1e-4, material=steel, velocity=0.0 if number else 1.0)
        for number, length in enumerate(lengths)
    }
    law = {"kind": "addition_deletion"}
    contacts = [il.Contact(f"rod_{k}.right", f"rod_{k + 1}.left", law=law) for k in range(20)]
    solve = {"duration": 2e-4, "model": {"kind": "continuous"}}
    history = il.run(il.Case(bodies=rods, contacts=contacts, solve=solve))
    drawn = [np.asarray(image.get_array()) for image in history.plot_xt().axes[0].images]
    assert [each.shape[1] for each in drawn] == [361, *[134] * 20]  # 4000 * 0.05 / 1.5
    times = np.linspace(0.0, 2e-4, drawn[1].shape[0])
    exact = history.fields_at("rod_1", times, "stress", np.linspace(0.0, 0.05, 134)).values
    assert np.max(np.abs(drawn[1] * 1e6 - exact)) <= 1e-9 * np.max(np.abs(exact))
