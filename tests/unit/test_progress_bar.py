"""Bars of long runs: on a terminal alone, one at a time, with the runs of an automatic choice counted."""

from __future__ import annotations

import io
import sys

import pytest

import impactlab as il
from impactlab.report import progress_bar


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def attached(monkeypatch: pytest.MonkeyPatch) -> Terminal:
    """Return a terminal as standard error, set in the test itself: pytest sets its own before each."""
    made = Terminal()
    monkeypatch.setattr(sys, "stderr", made)
    monkeypatch.setenv("TERM", "xterm")
    return made


def test_a_long_run_says_which_run_of_the_choice_it_is(monkeypatch):
    terminal = attached(monkeypatch)
    monkeypatch.setattr(progress_bar, "SHOWN_AFTER_S", 0.0)
    with progress_bar.of_long_run("drop", choosing=True) as show:
        for fraction in (0.0, 0.6, 1.0, 0.0, 0.3):
            show(fraction)
    assert "drop: run 2 of the automatic choice" in terminal.getvalue()
    assert "30%" in terminal.getvalue()
    assert "run 3" not in terminal.getvalue()


def test_a_short_run_draws_nothing(monkeypatch):
    terminal = attached(monkeypatch)
    il.run(il.load_case("axial_impact").method("base"))
    assert terminal.getvalue() == ""


def test_a_bar_is_removed_where_a_run_fails(monkeypatch):
    attached(monkeypatch)
    bodies = {"ball": il.Mass(1.0, velocity=1.0), "wall": il.Wall()}
    solve = {"duration": 1.0, "integrator": {"kind": "central_difference"}, "step": {"dt": 0.1}}
    law = {"kind": "penalty", "stiffness": 1e9}
    with pytest.raises(il.CaseError):
        il.run(il.Case(bodies=bodies, contacts=[il.Contact("ball", "wall", law)], solve=solve))
    with progress_bar.of_long_run("next", choosing=False) as show:
        assert show is not None


def test_no_second_bar_is_drawn_beside_another_one(monkeypatch):
    attached(monkeypatch)
    with progress_bar.progress(), progress_bar.of_long_run("drop", choosing=False) as show:
        assert show is None
    with progress_bar.of_long_run("drop", choosing=False) as show:
        assert show is not None


def test_without_a_terminal_and_with_a_function_given_there_is_no_bar(monkeypatch):
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    seen = []
    with progress_bar.of_long_run("drop", choosing=False) as show:
        assert show is None
    with progress_bar.of_long_run("drop", False, seen.append) as show:
        show(0.5)
    assert seen == [0.5]
