import numpy as np
import pytest

from usdface.retarget.performer_check import OTHER_PERSON, shared_difference

RNG = np.random.default_rng(4)
# Markers on a dome 120 mm across.
AT = RNG.uniform(-0.06, 0.06, (40, 2))
REST = np.column_stack([AT, 0.06 - 6.0 * (AT**2).sum(axis=1)])
SHAPES = (
    0.01
    * np.exp(-(((AT[None] - AT[[3, 9, 17]][:, None]) / 0.03) ** 2).sum(axis=2))[..., None]
    * RNG.normal(size=(3, 1, 3))
)


def test_what_one_marker_is_off_is_not_shared() -> None:
    for seed in range(20):
        off = 0.001 * np.random.default_rng(seed).normal(size=REST.shape)
        assert shared_difference(REST, REST + off, SHAPES) < OTHER_PERSON


def test_other_proportions_are_shared_by_size() -> None:
    found = [
        shared_difference(REST, REST * [1.0 + stretch, 1.0, 1.0], SHAPES)
        for stretch in (0.0, 0.02, 0.04)
    ]
    assert found[0] == pytest.approx(0.0, abs=1e-9)
    assert found[1] > OTHER_PERSON and found[2] == pytest.approx(2.0 * found[1], rel=0.1)


def test_what_the_rest_shows_is_no_difference() -> None:
    shown = REST + np.tensordot([0.2, 0.1, 0.3], SHAPES, 1)
    assert shared_difference(REST, shown, SHAPES) < 0.5 * OTHER_PERSON
    assert shared_difference(REST, shown, SHAPES[:0]) > 2.0 * OTHER_PERSON


def test_a_few_markers_do_not_tell() -> None:
    assert shared_difference(REST[:11], REST[:11] * [1.3, 1.0, 1.0], SHAPES[:, :11]) == 0.0
