from dataclasses import replace

import numpy as np
import pytest
from fit_world import COLUMN, NOISE, make_examples

from usdface.rule_learning.terms import linguistic_terms


def terms(values, noise=NOISE, name="chin_y"):
    """Make the terms of one feature that takes a value in each of several emotions."""
    rules = {(f"e{i}", ""): set() for i in range(len(values))}
    examples = make_examples(rules, scatter=0.0)
    features = np.zeros(examples.features.shape)
    for i, value in enumerate(values):
        features[examples.rows(f"e{i}"), COLUMN[name]] = value
    groups = [examples.rows(emotion) for emotion in examples.names]
    terms = linguistic_terms(replace(examples, features=features, noise=np.full(18, noise)), groups)
    signs = (1, -1)
    return {t.name: t.parameters for s in signs for t in terms.terms_of(COLUMN[name], s)}


def test_tops_are_the_minimum_the_medium_and_the_maximum_over_the_emotions():
    found = terms([0.05, 0.1, 0.12, 0.2, 0.3, 0.0])
    assert list(found) == ["slightly_raised", "raised", "far_raised"]
    tops = [top for _, top in found.values()]
    assert tops == pytest.approx([0.95 * 0.05, 0.95 * 0.12, 0.95 * 0.3])


def test_each_direction_has_words_of_its_own():
    found = terms([0.1, -0.05, -0.2])
    assert list(found) == ["raised", "slightly_lowered", "lowered", "far_lowered"]
    assert found["far_lowered"][1] == pytest.approx(-0.95 * 0.2)


def test_values_that_hardly_differ_are_one_term():
    assert list(terms([0.1, 0.11, 0.12])) == ["raised"]


def test_no_term_begins_within_the_dead_zone():
    assert terms([0.04])["raised"][0] == pytest.approx(0.5 * NOISE)
    assert terms([0.1], noise=0.0)["raised"][0] == pytest.approx(0.03 * 0.95 * 0.1)


def test_a_motion_within_two_deviations_of_the_noise_has_no_term():
    assert terms([1.9 * NOISE]) == {}
    assert list(terms([2.1 * NOISE])) == ["raised"]


def test_degrees_are_those_of_the_terms():
    examples = make_examples()
    terms = linguistic_terms(examples, [examples.rows(emotion) for emotion in examples.names])
    features = np.random.default_rng(0).normal(scale=0.05, size=(20, 18))
    features[3] = np.nan
    degrees = terms.membership(features)
    assert not degrees[3].any()
    assert degrees.min() == 0
    assert degrees.max() == 1
    at = terms.names.index("lowered")
    inside = (features[:, terms.feature[at]] - terms.foot[at]) / (terms.top[at] - terms.foot[at])
    assert degrees[:, at] == pytest.approx(np.clip(np.nan_to_num(inside), 0, 1))
