"""Arrays in files: the rows that were added, in memory that can be taken back."""

import resource
from pathlib import Path

import numpy as np
import pytest

from usdface.errors import OutputError
from usdface.io.mapped_arrays import MappedArrays


def test_rows_come_back_as_one_array(tmp_path: Path) -> None:
    arrays, rng = MappedArrays(tmp_path), np.random.default_rng(0)
    parts = [rng.standard_normal((count, 4, 3)) for count in (5, 1, 7)]
    for part in parts:
        arrays.append("points", part)
        arrays.append("times", part[:, 0, 0])
    points, times = arrays.mapped("points"), arrays.mapped("times")
    np.testing.assert_array_equal(points, np.concatenate(parts))
    np.testing.assert_array_equal(times, points[:, 0, 0])
    assert not points.flags.writeable


def test_nothing_is_left_in_the_folder(tmp_path: Path) -> None:
    arrays = MappedArrays(tmp_path)
    arrays.append("kept", np.ones((3, 2)))
    arrays.append("left", np.ones((3, 2)))
    kept = arrays.mapped("kept")
    arrays.close()
    assert list(tmp_path.iterdir()) == [] and kept.sum() == 6.0


def test_a_full_disk_is_an_error(tmp_path: Path) -> None:
    arrays = MappedArrays(tmp_path)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, limits[1]))
    try:
        with pytest.raises(OutputError, match="cannot write to"):
            arrays.append("points", np.ones((1000, 3)))
            arrays.mapped("points")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        arrays.close()
