import numpy as np
import pytest

from usdface.fuzzy.defuzzify import defuzzify, sample_points
from usdface.fuzzy.system import FuzzySystem, Term, Variable

SHAPE = Term("some", "trapezoidal", (0, 2, 4, 10))
OUT = Variable("out", "output", terms=(SHAPE,), range=(0, 20), default=7)


def answer(strengths, **settings):
    system = FuzzySystem((OUT,), (), inference="mamdani", **settings)
    strengths = np.asarray(strengths, dtype=float)
    return defuzzify(system, OUT, [(strengths, SHAPE)], len(strengths))


@pytest.mark.parametrize("sampling", ["ends", "middles"])
@pytest.mark.parametrize(
    ("defuzzifier", "expected"),
    [
        # Areas 1, 2, 3 with centroids 4/3, 3, 6
        ("centroid", (4 / 3 + 6 + 18) / 6),
        ("bisector", 4.0),
        ("mean_of_max", 3.0),
        ("smallest_of_max", 2.0),
        ("largest_of_max", 4.0),
    ],
)
def test_known_areas(sampling, defuzzifier, expected):
    found = answer([1.0], defuzzifier=defuzzifier, sampling=sampling, samples=4001)
    assert found[0] == pytest.approx(expected, abs=0.006)


def test_an_empty_set_gives_the_default():
    np.testing.assert_array_equal(answer([0.0, 0.0]), [7, 7])


def test_sampling():
    ends = FuzzySystem((OUT,), (), inference="mamdani", samples=5)
    middles = FuzzySystem((OUT,), (), inference="mamdani", samples=4, sampling="middles")
    np.testing.assert_array_equal(sample_points(ends, OUT), [0, 5, 10, 15, 20])
    np.testing.assert_array_equal(sample_points(middles, OUT), [2.5, 7.5, 12.5, 17.5])


@pytest.mark.parametrize("kind", ["centroid", "bisector", "mean_of_max", "largest_of_max"])
def test_frame_by_frame_and_all_at_once_are_bit_equal(kind):
    strengths = np.random.default_rng(0).uniform(size=3000)
    whole = answer(strengths, defuzzifier=kind, implication="prod")
    single = [answer([s], defuzzifier=kind, implication="prod")[0] for s in strengths[::31]]
    np.testing.assert_array_equal(whole[::31], single)
