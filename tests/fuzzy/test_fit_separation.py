from dataclasses import replace

import numpy as np
import pytest
from fit_world import COLUMN, NOISE, RULES, make_examples

from usdface.fuzzy.fit_separation import separations


def of(found, *pair):
    return next(s for s in found if set(s.emotions) == set(pair))


def test_the_motion_that_two_emotions_differ_in_comes_first():
    found = separations(make_examples(), "recording")
    assert all(s.separated and s.mistaken == 0 and not s.findings() for s in found)
    assert len(found) == 5 * 4 / 2
    pair = of(found, "surprise", "fear")
    assert set(pair.features[:2]) == {"chin_y", "corner_l_x"}


def test_two_emotions_that_move_alike_cannot_be_separated():
    twins = {**RULES, ("awe", ""): RULES["surprise", ""]}
    found = separations(make_examples(twins, takes=10), "recording")
    pair = of(found, "awe", "surprise")
    assert pair.tested == 40
    assert pair.mistaken > 10  # 20 by chance
    assert not pair.separated
    (said,) = pair.findings()
    assert said.code == "MARKERS_CANNOT_SEPARATE"
    assert f"{pair.mistaken} of 40 held-out examples" in said.message
    assert sum(not s.separated for s in found) == 1


def test_the_figure_is_the_distance_of_the_means_by_the_noise():
    """Examples that do not scatter differ by 6 times the markers' noise in one feature."""
    clean = make_examples({("a", ""): set(), ("b", ""): set()}, scatter=0.0)
    features = np.zeros(clean.features.shape)
    features[clean.rows("b"), COLUMN["chin_y"]] = 6 * NOISE
    (pair,) = separations(replace(clean, features=features), "recording")
    assert pair.sensitivity == pytest.approx(6)
    assert pair.features[0] == "chin_y"


@pytest.mark.parametrize(("apart", "separated"), [(1.9, False), (2.1, True)])
def test_without_a_second_recording_the_distance_decides(apart, separated):
    clean = make_examples({("a", ""): set(), ("b", ""): set()}, takes=1, scatter=0.0)
    features = np.zeros(clean.features.shape)
    features[clean.rows("b"), COLUMN["chin_y"]] = apart * NOISE
    (pair,) = separations(replace(clean, features=features), "none")
    assert pair.tested == 0
    assert pair.separated is separated
    assert [f.code for f in pair.findings()] == ([] if separated else ["MARKERS_CANNOT_SEPARATE"])
