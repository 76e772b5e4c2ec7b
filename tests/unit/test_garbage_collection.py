"""The collector of unreachable objects is off in the context, and as before after it, whatever happens inside."""

from __future__ import annotations

import gc

import pytest

from impactlab.numerics.garbage_collection import MIN_PAUSED, GarbageCollectionPaused


def seen(fails: bool) -> bool:
    """Return whether the collector is on inside the context; raise there if asked for."""
    with GarbageCollectionPaused():
        if fails:
            raise ValueError("inside")
        return gc.isenabled()


def test_it_is_off_inside_and_on_again_after_an_error() -> None:
    assert not seen(fails=False)
    assert gc.isenabled()
    with pytest.raises(ValueError, match="inside"):
        seen(fails=True)
    assert gc.isenabled()


def test_an_inner_context_does_not_switch_it_on_for_the_outer_one() -> None:
    with GarbageCollectionPaused():
        with GarbageCollectionPaused():
            pass
        assert not gc.isenabled()
    assert gc.isenabled()


def test_of_few_bodies_it_is_left_alone() -> None:
    with GarbageCollectionPaused(MIN_PAUSED - 1):
        assert gc.isenabled()
