import numpy as np
import pytest
from expression_systems import expression_system

from usdface.correction.features import MILLIMETRE, face_unit, measure, smooth, smoothed_blocks
from usdface.errors import InputError
from usdface.expression_system import MarkerFeature
from usdface.geometry.marker_spread import marker_spread

NAMES = ("nose", "Lip L", "brow")
NEUTRAL = np.array([[0, 0, 0.1], [0.03, -0.04, 0.08], [-0.02, 0.05, 0.09]])
ROLES = {"lip": "Lip L"}


def features(measure_):
    return [
        *(MarkerFeature("lip", axis, measure_) for axis in "xyz"),
        MarkerFeature("brow", "y", measure_),
    ]


def take(*moves):
    positions = np.repeat(NEUTRAL[None], len(moves), axis=0)
    for frame, (marker, move) in enumerate(moves):
        positions[frame, marker] += move
    return positions


def measured(positions, kind, unit=1.0, neutral=NEUTRAL):
    return measure(positions, neutral, NAMES, features(kind), ROLES, "nose", unit)


def test_known_answers():
    # Down and outward; the lip hangs below the nose tip, so |p - nose| grows when it sinks.
    positions = take((1, (0.01, -0.02, 0)), (2, (0, 0.003, 0)), (0, (0, 0, 0)))
    signed = [[0.01, -0.02, 0, 0], [0, 0, 0, 0.003], [0, 0, 0, 0]]
    np.testing.assert_allclose(measured(positions, "signed"), signed, atol=1e-15)
    np.testing.assert_allclose(measured(positions, "absolute"), np.abs(signed), atol=1e-15)


def test_absolute_is_the_change_of_a_distance():
    # 0.03 to the left of the nose, then 0.03 to its right: the same distance.
    crossed = take((1, (-0.06, 0, 0)))
    assert measured(crossed, "absolute")[0, 0] == pytest.approx(0, abs=1e-15)
    assert measured(crossed, "signed")[0, 0] == pytest.approx(-0.06)


@pytest.mark.parametrize("kind", ["signed", "absolute"])
def test_moving_the_whole_face_changes_nothing(kind):
    positions = take((1, (0.01, -0.02, 0.004)))
    np.testing.assert_allclose(
        measured(positions + np.array([0.5, -0.2, 3]), kind), measured(positions, kind), atol=1e-14
    )


@pytest.mark.parametrize("kind", ["signed", "absolute"])
def test_a_larger_face_measures_the_same_in_its_own_unit(kind):
    positions = take((1, (0.01, -0.02, 0.004)))
    there = measured(positions, kind, marker_spread(NEUTRAL))
    scaled = measured(2.5 * positions, kind, marker_spread(2.5 * NEUTRAL), 2.5 * NEUTRAL)
    np.testing.assert_allclose(scaled, there, rtol=1e-12)


def test_an_occluded_marker_gives_nan_where_it_is_read():
    positions = take((1, (0, 0, 0)))
    positions[0, 1] = np.nan
    assert np.isnan(measured(positions, "signed")[0]).tolist() == [True, True, True, False]


def test_marker_spread_is_rigid_and_skips_the_unseen():
    square = np.array([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0.0]])
    assert marker_spread(square) == pytest.approx(np.sqrt(2))
    turned = square @ np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0.0]]) + 7
    assert marker_spread(turned) == pytest.approx(np.sqrt(2))
    assert marker_spread(np.vstack([square, [[np.nan] * 3]])) == pytest.approx(np.sqrt(2))


def test_face_unit():
    assert face_unit(expression_system((), (), face_unit="none"), NEUTRAL) == MILLIMETRE
    assert face_unit(expression_system((), ()), NEUTRAL) == marker_spread(NEUTRAL)


def test_missing_markers_are_named():
    with pytest.raises(InputError, match="no nose tip"):
        measure(NEUTRAL[None], NEUTRAL, NAMES, [], {}, "Nose", 1.0)
    with pytest.raises(InputError, match="'lip_x' is of the role 'lip'"):
        measure(NEUTRAL[None], NEUTRAL, NAMES, features("signed"), {}, "nose", 1.0)
    for neutral in (np.zeros((3, 3)), np.full((3, 3), np.nan), np.zeros((0, 3))):
        with pytest.raises(InputError, match="no extent"):
            marker_spread(neutral)


def test_no_features_are_no_columns():
    assert measure(NEUTRAL[None], NEUTRAL, NAMES, [], {}, "nose", 1.0).shape == (1, 0)


TIMES = np.arange(200) / 100.0


def test_smoothing_keeps_what_is_still_and_straight():
    still = np.full((200, 2), 0.7)
    np.testing.assert_allclose(smooth(still, TIMES, 0.1), still, atol=1e-12)
    straight = TIMES[:, None] * [1.0, -2.0]
    inner = slice(60, 140)
    np.testing.assert_allclose(smooth(straight, TIMES, 0.1)[inner], straight[inner], atol=1e-9)
    assert not smooth(np.zeros((200, 2)), TIMES, 0.1).any()


def test_smoothing_does_not_lag_nor_depend_on_the_rate():
    bump = np.exp(-(((TIMES - 1.0) / 0.2) ** 2))[:, None]
    smoothed = smooth(bump, TIMES, 0.1)
    assert smoothed.argmax() == bump.argmax()
    # A Gaussian of a Gaussian is a Gaussian: 0.2^2 + 2 * 0.1^2.
    wider = np.sqrt(0.06)
    expected = 0.2 / wider * np.exp(-(((TIMES - 1.0) / wider) ** 2))
    np.testing.assert_allclose(smoothed[:, 0], expected, atol=2e-3)
    np.testing.assert_allclose(smooth(bump[::2], TIMES[::2], 0.1), smoothed[::2], atol=2e-3)


def test_what_was_not_seen_stays_so_and_does_not_spread():
    gaps = np.full((200, 1), 0.7)
    gaps[50:60] = np.nan
    smoothed = smooth(gaps, TIMES, 0.1)
    np.testing.assert_array_equal(np.isnan(smoothed), np.isnan(gaps))
    np.testing.assert_allclose(smoothed[~np.isnan(gaps)], 0.7, atol=1e-12)


def test_no_width_or_a_single_frame_changes_nothing():
    noise = np.random.default_rng(0).normal(size=(200, 2))
    np.testing.assert_array_equal(smooth(noise, TIMES, 0.0), noise)
    np.testing.assert_array_equal(smooth(noise[:1], TIMES[:1], 0.1), noise[:1])


@pytest.mark.parametrize("width", [0.0, 0.02, 0.4, 5.0])
def test_blocks_are_smoothed_as_the_whole_is(width):
    values = np.random.default_rng(5).normal(size=(len(TIMES), 3, 2))
    values[40:50, 1] = np.nan
    block = smoothed_blocks(lambda frames: values[frames], TIMES, width)
    found = np.concatenate([block(slice(a, min(a + 64, 200))) for a in range(0, 200, 64)])
    whole = smooth(values.reshape(200, -1), TIMES, width).reshape(values.shape)
    np.testing.assert_array_equal(found, whole)


def test_frames_on_either_side_of_a_gap_are_smoothed_by_themselves():
    gap = TIMES + np.where(np.arange(len(TIMES)) < 100, 0.0, 1.0)
    steps = np.repeat([0.0, 1.0], 100)[:, None]
    np.testing.assert_allclose(smooth(steps, gap, 0.1), steps, atol=1e-12)
    assert 0.4 < smooth(steps, TIMES, 0.1)[99, 0] < 0.6
    block = smoothed_blocks(lambda frames: steps[frames], gap, 0.1)
    found = np.concatenate([block(slice(a, min(a + 64, 200))) for a in range(0, 200, 64)])
    np.testing.assert_array_equal(found, smooth(steps, gap, 0.1))
