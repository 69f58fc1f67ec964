"""Arrays read from files."""

import numpy as np
import pytest
from processed import Done
from worlds import animation_of

import usdface


def test_a_result_is_what_its_layers_hold(done: Done) -> None:
    played, _ = usdface.read_result(done.root)
    np.testing.assert_array_equal(played.corrected.weights, animation_of(done.root).weights)
    assert len(played.residual) == len(played.corrected.times)
    assert len(played.firing) == len(played.corrected.times)


def test_a_file_without_a_setup_is_no_result(done: Done) -> None:
    with pytest.raises(usdface.InputError):
        usdface.read_result(done.folder / "rig.usda")
