"""Raising: held where the performance is held, once, and only where the face matches the pose."""

from itertools import pairwise

import numpy as np
import pytest

from usdface import options
from usdface.correction.evidence import Evidence
from usdface.correction.pose_blend import respond
from usdface.correction.raised_events import RaisedEvents, raised_events

POSE = np.array([1.0, 0.9, 0.6])  # brows, mouth, eyes
EVIDENCE = Evidence(
    np.diag([1.0, 1.0, 0.1]),
    np.diag([0.01, 0.01, 0.0001]),
    options.EVIDENCE,
    {"brows": np.array([True, False, False]), "mouth": np.array([False, True, False])},
)
RISE = np.linspace(0, 1, 30)
CURVE = np.concatenate([np.zeros(10), RISE, np.ones(60), RISE[::-1], np.zeros(10)])
INSIDE = slice(45, 95)


def events(
    weights: np.ndarray, output: np.ndarray, by_rules: np.ndarray, step: float | None = 1 / 60
) -> RaisedEvents:
    return raised_events(
        output,
        by_rules,
        weights=weights,
        judged=weights,
        pose=POSE,
        evidence=EVIDENCE,
        response=(0.15, 0.4),
        step=step,
    )


def judged(weights: np.ndarray, output: np.ndarray) -> RaisedEvents:
    return events(weights, output, output)


def raised(weights: np.ndarray, output: np.ndarray, gain: np.ndarray | float = 1.0) -> np.ndarray:
    """Return what is added to weights (F, 3)."""
    added, reached = np.zeros(weights.shape), np.zeros(weights.shape)
    gains = np.broadcast_to(gain, len(weights))
    judged(weights, output).raise_part(POSE, gains, added, reached)
    assert (reached <= POSE + 1e-12).all()
    return added


def test_half_an_expression_becomes_a_whole_one_and_stays_it() -> None:
    weights = 0.5 * CURVE[:, None] * POSE
    jitter = 0.01 * np.random.default_rng(0).standard_normal(weights.shape)
    added = raised(weights + jitter, 0.5 * CURVE)
    whole = np.minimum(POSE, 1 - 0.015)  # less the jitter, which would else be cut off at 1
    np.testing.assert_allclose((weights + added)[INSIDE], np.tile(whole, (50, 1)), atol=0.01)
    assert np.ptp(added[INSIDE], axis=0).max() == 0
    assert np.diff(added[:45], axis=0).min() >= 0 >= np.diff(added[95:], axis=0).max()
    assert not added[:10].any() and not added[-10:].any()


def test_a_whole_expression_gets_nothing_even_on_its_way() -> None:
    assert raised(CURVE[:, None] * POSE, CURVE).max() == pytest.approx(0, abs=0.01)


def test_raising_twice_by_the_same_outputs_is_raising_once() -> None:
    weights = 0.5 * CURVE[:, None] * POSE
    once = weights + raised(weights, 0.5 * CURVE)
    assert raised(once, 0.5 * CURVE).max() < 1e-12


def test_what_was_raised_in_part_goes_on_towards_the_pose() -> None:
    """By partial evidence of the mouth, which is more in the raised weights."""
    weights = 0.5 * CURVE[:, None] * POSE * [1.0, 0.62, 1.0]
    runs = [weights]
    for _ in range(8):
        runs.append(runs[-1] + raised(runs[-1], 0.5 * CURVE))
    steps = [float(np.abs(b - a).max()) for a, b in pairwise(runs)]
    assert steps[0] > 0.05 and steps[1] > 0.02 and steps[-1] < 0.01
    assert (runs[-1][INSIDE] < POSE + 0.01).all()


def test_a_region_at_rest_keeps_the_expression_out_of_the_others() -> None:
    frown = 0.5 * CURVE[:, None] * [1.0, 0.0, 0.0]
    assert not raised(frown, 0.5 * CURVE).any()
    events = judged(frown, 0.5 * CURVE)
    assert events.missing("mouth", len(frown))[INSIDE].all()
    assert not events.missing("brows", len(frown)).any()
    assert not events.intensity(np.ones(len(frown))).any()


def test_a_gain_counts_in_its_frames() -> None:
    weights = 0.5 * CURVE[:, None] * POSE
    gain = np.where(np.arange(len(CURVE)) < 70, 1.0, 0.7)
    added = raised(weights, 0.5 * CURVE, gain)
    np.testing.assert_allclose(added[[60, 80], 0], [0.5, 0.2], atol=0.01)
    intensity = judged(weights, 0.5 * CURVE).intensity(gain)
    np.testing.assert_allclose(intensity[[60, 80]], [1.0, 0.7])


def test_the_correction_is_a_continuous_function_of_weights_and_outputs() -> None:
    rng = np.random.default_rng(1)
    for mouth in np.linspace(0.0, 0.5, 51):
        weights = CURVE[:, None] * [0.5, mouth, 0.3]
        before = raised(weights, 0.5 * CURVE)
        noise = 1e-4 * rng.standard_normal(weights.shape)
        after = raised(weights + noise, 0.5 * CURVE + noise[:, 0])
        assert np.abs(after - before).max() < 0.01


def test_what_the_classifier_alone_detects_is_raised_as_far_as_its_output_says() -> None:
    weights = 0.3 * CURVE[:, None] * POSE
    output, none = 0.5 * CURVE, np.zeros(len(CURVE))
    levels = [events(weights, output, by).level for by in (none, 0.25 * CURVE, output)]
    expected = [0.5, respond(np.array(0.25), (0.15, 0.4)), 1.0]
    for level, value in zip(levels, np.maximum(expected, 0.5), strict=True):
        np.testing.assert_allclose(level, value, atol=1e-9)
    # A single frame is an event of its own, by the same measure.
    alone = events(weights, output, none, step=None)
    own = output[alone.events.frames]
    np.testing.assert_allclose(alone.level, np.minimum(respond(own, (0.15, 0.4)), own))
