import numpy as np
import pytest

from usdface.numerics.ramps import linear_ramp
from usdface.rule_design.feature_errors import FeatureErrors
from usdface.rule_design.negative_conditions import (
    LEAST_FIRING,
    negative_conditions,
    suppression,
)

# Four features: what both do, what only the other does (a little, far), and what moves in speech.
OWN = np.array([0.010, 0.0, 0.0, 0.0])
OTHER = np.array([0.004, 0.002, 0.008, 0.016])
RAMP = (0.0, 0.010)
SPEECH = np.array([[0.0, 0.0, 0.0, 0.03]])
QUIET = np.full(4, 1e-5)
ALONE = np.arange(4)


def rule(features):
    return linear_ramp(features[:, 0], *RAMP)


def excluded(own=OWN, others=(OTHER,), single=SPEECH, noise=QUIET, error=QUIET, twins=ALONE):
    errors = FeatureErrors(noise, np.maximum(noise, error))
    return negative_conditions(own, np.array(others), rule, single, errors, twins)


def test_a_ramp_goes_either_way():
    values = np.array([-0.02, -0.005, 0.0, 0.005, 0.02])
    assert linear_ramp(values, 0.0, 0.01).tolist() == [0, 0, 0, 0.5, 1]
    assert linear_ramp(values, 0.0, -0.01).tolist() == [1, 0.5, 0, 0, 0]


def test_what_only_the_other_does_and_speech_does_not():
    """Of what speech leaves alone, that which stands out of the noise most."""
    (((feature, (foot, top)),),), left = excluded()
    assert feature == 2
    assert (foot, top) == pytest.approx((0.1 * 0.008, 0.4 * 0.008))
    assert left.tolist() == [0.0]


def test_of_two_the_one_that_is_large_against_its_error():
    """On another person a feature moves that does not in the rig's own pose."""
    own, other = np.append(OWN, 0.0), np.append(OTHER, 0.0079)
    wide = np.array([0.0, 0.0, 0.006, 0.0, 0.0])
    speech, twins = np.append(SPEECH, [[0.0]], axis=1), np.arange(5)
    for error, expected in ((np.zeros(5), 2), (wide, 4)):
        given = {"noise": np.full(5, 1e-5), "error": error, "twins": twins}
        (((feature, _),),), _ = excluded(own, (other,), speech, **given)
        assert feature == expected


def test_at_no_intensity_is_much_left_of_the_other():
    (((feature, ramp),),), _ = excluded()
    for intensity in np.linspace(0, 1, 101):
        shown = intensity * OTHER
        fired = min(linear_ramp(shown[0], *RAMP), 1 - linear_ramp(shown[feature], *ramp))
        assert fired <= 0.15 and (fired == 0 or intensity < 0.4)


def test_the_expression_itself_is_kept_whole():
    own = np.array([0.010, 0.0, -0.003, 0.001])
    (((feature, ramp),),), _ = excluded(own=own)
    assert linear_ramp(np.linspace(0, 1, 11) * own[feature], *ramp).max() == 0


def test_little_is_let_be():
    found, left = excluded(others=(OTHER * [LEAST_FIRING / 0.4, 1, 1, 1],))
    assert found == () and left == pytest.approx([LEAST_FIRING])


@pytest.mark.parametrize(
    "given",
    [
        {"noise": np.full(4, 0.004)},  # nothing clear
        {"others": (0.5 * OWN,)},  # nothing besides
        {"own": OWN + OTHER},  # all of it itself
    ],
)
def test_nothing_helps(given):
    found, left = excluded(**given)
    assert found == () and left.max() >= 0.4


def test_one_condition_may_do_for_two():
    others = (OTHER, 0.9 * OTHER)
    found, left = excluded(others=others)
    assert len(found) == 1 and left.tolist() == [0.0, 0.0]


def test_mirrored_markers_give_the_first_whatever_their_last_bits():
    other = np.array([0.004, 0.0, 0.008, 0.008])
    for bits in (-1e-16, 1e-16):
        nudged = other + np.array([0.0, 0.0, 0.0, bits])
        (found,), _ = excluded(others=(nudged,), single=np.zeros((1, 4)))
        assert found[0][0] == 2


def test_a_condition_has_two_sides_where_the_other_expression_has():
    twins = np.array([0, 1, 3, 2])
    other = np.array([0.004, 0.0, 0.008, 0.008])
    (found,), left = excluded(others=(other,), single=np.zeros((1, 4)), twins=twins)
    assert [feature for feature, _ in found] == [2, 3] and left.tolist() == [0.0]
    one_sided = other * [1, 1, 1, 0]
    assert suppression(one_sided[None], found).tolist() == [0.0]
    (found,), _ = excluded(others=(one_sided,), single=np.zeros((1, 4)), twins=twins)
    assert [feature for feature, _ in found] == [2]
