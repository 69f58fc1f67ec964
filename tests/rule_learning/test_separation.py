from dataclasses import replace

import numpy as np
import pytest
from fit_world import COLUMN, NOISE, RULES, make_examples

from usdface.rule_learning.separation import pose_separations, separations


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
    (reported,) = pair.findings()
    assert reported.code == "MARKERS_CANNOT_SEPARATE"
    assert f"{pair.mistaken} of 40 held-out examples" in reported.message
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


def test_poses_lie_apart_by_the_noise_and_the_farthest_motion_comes_first():
    variables = make_examples().marker_features
    seen = np.zeros((3, len(variables)))
    seen[1, [COLUMN["chin_y"], COLUMN["corner_l_x"]]] = 12 * NOISE, -20 * NOISE
    seen[2] = seen[1] * 0.95
    found = pose_separations("abc", seen, np.full(len(variables), NOISE), variables)
    assert [s.emotions for s in found] == [("a", "b"), ("a", "c"), ("b", "c")]
    assert [s.sensitivity for s in found] == pytest.approx([20, 19, 1])
    assert found[0].features[:2] == ("corner_l_x", "chin_y")
    assert [s.separated for s in found] == [True, True, False]
    assert "these markers cannot separate b from c: by the best" in found[2].findings()[0].message
