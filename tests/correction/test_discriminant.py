"""Fisher's discriminant: log odds of normal classes with one covariance."""

import numpy as np
from scipy.stats import multivariate_normal

from usdface.correction.discriminant import fisher_discriminant, with_room_for_wider_classes

RNG = np.random.default_rng(0)
CLASSES = np.repeat(np.arange(3), 4000)


def test_differences_of_scores_are_log_odds():
    means = np.array([[0.0, 0], [2, 1], [-1, 2]])
    covariance = np.array([[1.0, 0.6], [0.6, 0.8]])
    spread = RNG.multivariate_normal([0, 0], covariance, size=len(CLASSES))
    scores = fisher_discriminant(means[CLASSES] + spread, CLASSES, 0.0).scores(np.eye(2))
    odds = np.array([multivariate_normal(m, covariance).logpdf(np.eye(2)) for m in means]).T
    np.testing.assert_allclose(np.diff(scores), np.diff(odds), atol=0.2)


def test_shrunk_whole_it_is_the_nearest_mean():
    features = RNG.standard_normal((len(CLASSES), 4)) * [1, 2, 3, 4] + CLASSES[:, None]
    judged = fisher_discriminant(features, CLASSES, 1.0)
    means = np.array([features[k == CLASSES].mean(axis=0) for k in range(3)])
    distance = np.linalg.norm(features[:, None] - means, axis=2)
    np.testing.assert_array_equal(judged.scores(features).argmax(axis=1), distance.argmin(axis=1))


def test_fewer_examples_than_features_give_the_same():
    features = RNG.standard_normal((9, 9)) + np.repeat(np.arange(3), 3)[:, None]
    classes = np.repeat(np.arange(3), 3)
    wide = np.c_[features, np.zeros((9, 5))]
    size = 14 / 9  # the sphere of the same trace is smaller in more dimensions
    own = 0.3 * size / (0.7 + 0.3 * size)
    scores = [
        fisher_discriminant(rows, classes, share).scores(rows)
        for rows, share in ((features, 0.3), (wide, own))
    ]
    ratio = np.ptp(scores[1]) / np.ptp(scores[0])
    np.testing.assert_allclose(scores[1], ratio * scores[0], rtol=1e-9)


def test_a_narrow_class_leaves_room_for_the_typical_member_of_a_wide_one():
    wide = RNG.standard_normal((4000, 2)) * [2.0, 0.5]
    narrow = [1.2, 0.0] + 0.1 * RNG.standard_normal((4000, 2))
    classes = np.repeat([0, 1], 4000)
    members = np.array([[0.9, 0.0], [1.2, 0.0]])
    found = fisher_discriminant(np.concatenate([wide, narrow]), classes, 0.0)
    assert found.scores(members)[0].argmax() == 1
    made = with_room_for_wider_classes(found, members, np.array([False, True]), 7.0)
    scores = made.scores(members)
    # The boundary is midway between the two members.
    np.testing.assert_allclose(np.diff(scores[0]), -np.diff(scores[1]))
    assert (scores.argmax(axis=1) == [0, 1]).all()
    # Neither a wide class nor one that is far enough behind gives way.
    for flags, lead in (([True, False], 7.0), ([False, False], 7.0), ([False, True], -99.0)):
        same = with_room_for_wider_classes(found, members, np.array(flags), lead)
        np.testing.assert_array_equal(same.offsets, found.offsets)
