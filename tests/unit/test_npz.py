"""The file of arrays is one of numpy."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from impactlab.report.npz import write_npz

ARRAYS = {
    "rows": np.arange(12.0).reshape(3, 4),
    "every second column": np.arange(12.0).reshape(3, 4)[:, ::2],
    "columns": np.asfortranarray(np.arange(6.0).reshape(2, 3)),
    "number": np.array(3.0),
    "texts": np.array(["left", "a|b"]),
    "none": np.array([], dtype=str),
    "whole": np.array([1, 2]),
    "force:a|b": np.array([np.nan, np.inf, -0.0]),
}


def test_numpy_reads_what_is_written(tmp_path: Path) -> None:
    write_npz(tmp_path / "arrays.npz", ARRAYS)
    with np.load(tmp_path / "arrays.npz") as found:
        assert found.files == [*ARRAYS]
        for name, values in ARRAYS.items():
            assert found[name].dtype == values.dtype
            np.testing.assert_array_equal(found[name], values)


def test_smooth_channels_are_compressed(tmp_path: Path) -> None:
    write_npz(tmp_path / "zeros.npz", {"a": np.zeros(10_000)})
    assert (tmp_path / "zeros.npz").stat().st_size < 10_000


def test_a_folder_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        write_npz(tmp_path / "nowhere" / "a.npz", ARRAYS)
