import numpy as np
import pytest

from usdface.fuzzy.defuzzify import defuzzify, sample_points
from usdface.fuzzy.system import FuzzySystem
from usdface.fuzzy.variables import Term, Variable

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


def test_matlabs_documented_defuzzified_sets():
    """Fuzzy Logic Toolbox: `defuzz`; "Defuzzification Methods", 201 values of x."""

    def number(defuzzifier, *cuts):
        out = Variable("out", "output", range=(-10, 10), terms=tuple(term for _, term in cuts))
        settings = {"inference": "mamdani", "implication": "prod", "samples": 201}
        system = FuzzySystem((out,), (), defuzzifier=defuzzifier, **settings)
        return defuzzify(system, out, [(np.array([f]), term) for f, term in cuts], 1)[0]

    one = (1.0, Term("one", "trapezoidal", (-10, -8, -4, 7)))
    assert number("centroid", one) == pytest.approx(-3.2857, abs=5.1e-5)
    three = (
        (0.9, Term("a", "trapezoidal", (-10, -8, -2, 2))),
        (0.5, Term("b", "trapezoidal", (-5, -3, 2, 4))),
        (0.1, Term("c", "trapezoidal", (2, 3, 8, 9))),
    )
    assert number("mean_of_max", *three) == pytest.approx(-5, abs=1e-9)
    # MATLAB prints som = -2 and lom = -8: smallest and largest by their distance to 0.
    assert number("smallest_of_max", *three) == pytest.approx(-8, abs=1e-9)
    assert number("largest_of_max", *three) == pytest.approx(-2, abs=1e-9)


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
