"""Crossing lids of both eyes."""

from dataclasses import replace

import numpy as np
import pytest

from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.closure.lid_apertures import LidApertures
from usdface.closure.parted_lids import part_eyes

# Of two places along an eye 8 mm open, the squint of the left eye lifts one 1.6 times as far.
LEFT = LidApertures(
    "left",
    np.array([0.008, 0.008]),
    BlendShapeEvaluator(0.001 * np.array([[-8, -8], [-6.4, -4], [0, 0]])),
    np.array([0, 1]),
    0.008,
    closer=0,
    tighteners=(1,),
    cheek_raisers=(),
    raisers=(),
    movers=np.array([True, True, False]),
)
RIGHT = replace(
    LEFT,
    eye="right",
    evaluator=BlendShapeEvaluator(0.001 * np.array([[-8, -8], [0, 0], [-6.4, -4]])),
    tighteners=(2,),
    movers=np.array([True, False, True]),
)
TIMES = np.arange(20) / 60


def test_lids_that_one_shape_closes_do_not_cross_on_either_eye() -> None:
    for squints in ((0.65, 1.0), (1.0, 0.65), (0.9, 0.8), (0.0, 1.0)):
        weights = np.tile([0.5, *squints], (len(TIMES), 1))
        apertures = {"left": LEFT, "right": RIGHT}
        parted, _ = part_eyes(weights, apertures, np.zeros_like(weights), TIMES)
        assert min(own.least(parted).min() for own in apertures.values()) > -0.00017
        again, _ = part_eyes(parted, apertures, np.zeros_like(weights), TIMES)
        np.testing.assert_allclose(again, parted, atol=2e-5)


def test_a_take_of_one_frame_is_parted() -> None:
    parted, _ = part_eyes(np.array([[1.0, 0.8, 0.0]]), {"left": LEFT}, np.zeros((1, 3)), TIMES[:1])
    assert LEFT.least(parted)[0] > -0.00017


def test_pinned_weights_stay() -> None:
    weights = np.tile([1.0, 0.8, 0.0], (len(TIMES), 1))
    near = np.zeros_like(weights)
    near[5:10, 1] = 1.0
    parted, _ = part_eyes(weights, {"left": LEFT}, near, TIMES)
    np.testing.assert_array_equal(parted[5:10, 1], 0.8)
    assert (parted[15:, 1] < 0.6).all()
    assert LEFT.least(parted).min() > -0.00017


def test_lids_that_one_shape_closes_are_parted_alike_on_a_mirrored_face() -> None:
    """Neither eye is judged by what the parting of the other left of its weights."""
    apertures = {"left": LEFT, "right": RIGHT}
    for shut, *squints in ((0.5, 0.65, 1.0), (1.0, 0.65, 1.0), (0.8, 0.9, 0.8), (1.0, 0.2, 0.9)):
        weights = np.tile([shut, *squints], (len(TIMES), 1))
        parted, findings = part_eyes(weights, apertures, np.zeros_like(weights), TIMES)
        other, also = part_eyes(weights[:, [0, 2, 1]], apertures, np.zeros_like(weights), TIMES)
        np.testing.assert_allclose(other[:, [0, 2, 1]], parted, atol=2e-5)
        mirrored = {"left eye": "right eye", "right eye": "left eye"}
        assert {mirrored[found.where] for found in findings} == {found.where for found in also}


def test_an_eye_that_opens_as_the_other_is_parted_is_reported_as_it_is_in_the_end() -> None:
    """The shape that closes both eyes comes down for the lids of the right one alone."""
    apertures = {"left": LEFT, "right": RIGHT}
    weights = np.tile([1.0, 0.0, 1.0], (len(TIMES), 1))
    parted, findings = part_eyes(weights, apertures, np.zeros_like(weights), TIMES)
    assert [(found.code, found.where) for found in findings] == [
        ("LIDS_PARTED", "left eye"),
        ("LIDS_PARTED", "right eye"),
    ]
    for found, own in zip(findings, apertures.values(), strict=True):
        assert found.values["gap_mm"] == pytest.approx(1000 * own.widest(parted).max(), abs=1e-4)
        assert found.values["depth_mm"] == pytest.approx(6.4)


def test_eyes_that_are_shut_alike_lose_as_much_of_their_squint() -> None:
    """On a mesh whose eyes differ a little; a wink is its own matter."""
    left = replace(
        LEFT,
        evaluator=BlendShapeEvaluator(0.001 * np.array([[-8, -8], [0, 0], [-6.4, -4.9], [0, 0]])),
        tighteners=(2,),
        movers=np.array([True, False, True, False]),
    )
    right = replace(
        left,
        eye="right",
        evaluator=BlendShapeEvaluator(0.001 * np.array([[0, 0], [-8, -8], [0, 0], [-6.4, -4.2]])),
        closer=1,
        tighteners=(3,),
        movers=np.array([False, True, False, True]),
    )
    apertures = {"left": left, "right": right}

    def squints(*weights: float) -> np.ndarray:
        frames = np.tile(weights, (len(TIMES), 1))
        return part_eyes(frames, apertures, np.zeros_like(frames), TIMES)[0][0, 2:]

    alone = [
        part_eyes(np.array([[0.8, 0.8, 0.9, 0.9]]), {own.eye: own}, np.zeros((1, 4)), TIMES[:1])[0]
        for own in (left, right)
    ]
    assert abs(alone[0][0, 2] - alone[1][0, 3]) > 0.2
    one, other = squints(0.8, 0.8, 0.9, 0.9)
    assert abs(one - other) < 0.02
    one, other = squints(0.8, 0.0, 0.9, 0.0)
    assert other == 0.0 and one == pytest.approx(alone[0][0, 2], abs=1e-4)


def test_the_lower_lid_gives_way_where_eyes_stay_shut_and_not_in_a_blink() -> None:
    """Cheeks that fall in each blink of a smile are seen, a slit for some frames is not."""
    apertures, times = {"left": LEFT}, np.arange(240) / 60
    weights = np.tile([0.0, 0.8, 0.0], (len(times), 1))
    weights[60:72, 0] = 1.0
    blink, findings = part_eyes(weights, apertures, np.zeros_like(weights), times)
    np.testing.assert_array_equal(blink[:, 1], 0.8)
    assert LEFT.least(blink).min() > -0.00017
    assert [found.code for found in findings] == ["LIDS_PARTED"]
    weights[60:150, 0] = 1.0
    held, _ = part_eyes(weights, apertures, np.zeros_like(weights), times)
    assert held[60:150, 1].max() < 0.6
    # A pin elsewhere in the take changes nothing of it.
    pins = np.zeros_like(weights)
    pins[200:210, 1] = 1.0
    np.testing.assert_array_equal(part_eyes(weights, apertures, pins, times)[0], held)


def test_a_pin_counts_near_itself_alone() -> None:
    """A closing shape that is pinned elsewhere still gives way first where another pin holds."""
    times = np.arange(240) / 60
    own = replace(
        LEFT,
        evaluator=BlendShapeEvaluator(0.001 * np.array([[-8, -8], [-2, -2], [-1, -1]])),
        movers=np.array([True, True, True]),
    )
    weights = np.tile([0.9, 0.5, 0.8], (len(times), 1))
    near = np.zeros_like(weights)
    near[180:200, 1] = 1.0
    alone, _ = part_eyes(weights, {"left": own}, near, times)
    near[40:60, 0] = 1.0
    both, _ = part_eyes(weights, {"left": own}, near, times)
    np.testing.assert_array_equal(both[180:200], alone[180:200])
    np.testing.assert_array_equal(both[180:200, 2], 0.8)
