"""Poses blended over a take: what both halves of a face perform is raised on both."""

import numpy as np
import pytest
from chin_system import chin

from usdface import options
from usdface.correction.evidence import Evidence
from usdface.correction.gains import Gains
from usdface.correction.held_back import held_back_findings
from usdface.correction.take_blending import Outputs, TakeBlending
from usdface.face.layout import FaceLayout

NAMES = ("browDown_L", "browDown_R", "mouthPress_L", "mouthPress_R", "jaw")
POSE = np.array([1.0, 1.0, 0.8, 0.8, 0.0])
EVIDENCE = Evidence(
    np.eye(5),
    0.01 * np.eye(5),
    options.EVIDENCE,
    {
        "brows": np.array([True, True, False, False, False]),
        "mouth": np.array([False, False, True, True, True]),
    },
)
LAYOUT = FaceLayout(("browDown_L", "mouthPress_L"), ("browDown_R", "mouthPress_R"))


def raised(left: float, right: float, outputs: tuple[float, float]) -> np.ndarray:
    """Return what is added to half a pose whose mouth is pressed by so much on each side: (5,)."""
    weights = np.tile([0.5, 0.5, left, right, 0.2], (3, 1))
    blending = TakeBlending(
        chin("take"), POSE[None], NAMES, LAYOUT, Gains(), EVIDENCE, weights, None
    )
    by_side = dict(zip(("both", "left", "right"), (min(outputs), *outputs), strict=True))
    given = {side: np.full((3, 1), output) for side, output in by_side.items()}
    return np.asarray((blending.raise_up(given, given).weights - weights)[0])


def test_halves_that_show_an_emotion_alike_are_raised_alike() -> None:
    """Mouths on either side of the similarity that raises half, by the noise of the solve."""
    alone = [raised(mouth, mouth, (0.6, 0.6)) for mouth in (0.15, 0.26)]
    assert alone[0][0] < 0.5 * alone[1][0]
    added = raised(0.26, 0.15, (0.6, 0.6))
    assert 0.1 < added[1] == pytest.approx(added[0])
    assert added[3] == pytest.approx(added[2], abs=0.1)


def test_an_emotion_that_both_halves_have_peaks_on_both_at_once() -> None:
    """Two peaks with another mouth; of one half this, of the other that is the higher."""
    frames = 60
    ramp = np.interp(np.arange(frames), [0, 8, 22, 30, 38, 52, 59], [0, 1, 1, 0.8, 1, 1, 0])
    first = np.arange(frames) < 30
    weights = np.tile([0.5, 0.5, 0.0, 0.0, 0.2], (frames, 1)) * ramp[:, None]
    weights[first, 2:4] = 0.4 * ramp[first, None]
    outputs: Outputs = {
        "left": (ramp * np.where(first, 0.62, 0.58))[:, None],
        "right": (ramp * np.where(first, 0.58, 0.66))[:, None],
        "both": (ramp * 0.6)[:, None],
    }
    blending = TakeBlending(
        chin("take"), POSE[None], NAMES, LAYOUT, Gains(), EVIDENCE, weights,
        np.arange(frames) / 30.0,
    )  # fmt: skip
    added = blending.raise_up(outputs, outputs).weights - weights
    np.testing.assert_allclose(added[:, 0], added[:, 1], atol=0.05)


def test_the_papers_addition_follows_each_half_by_itself() -> None:
    weights = np.zeros((3, 5))
    blending = TakeBlending(
        chin("take"), POSE[None], NAMES, LAYOUT, Gains(), EVIDENCE, weights, None
    )
    outputs: Outputs = {
        "both": np.full((3, 1), 0.6), "left": np.full((3, 1), 0.6), "right": np.full((3, 1), 0.56)
    }  # fmt: skip
    added = blending.add(outputs).weights
    assert (added[:, 0] > added[:, 1]).all()
    np.testing.assert_allclose(added[:, 1] / added[:, 0], 0.56 / 0.6)


def test_a_half_that_shows_it_alone_is_judged_alone() -> None:
    assert raised(0.4, 0.0, (0.6, 0.0))[0] == pytest.approx(raised(0.4, 0.4, (0.6, 0.6))[0])
    assert raised(0.0, 0.4, (0.6, 0.0))[0] == 0.0


@pytest.mark.parametrize(("solved", "raised"), [(0.4, True), (0.0, False)])
def test_half_an_expression_that_is_raised_on_its_half_is_not_held_back(
    solved: float, raised: bool
) -> None:
    system = chin("take")
    weights = np.tile([0.5, 0.5, solved, 0.0, 0.0], (3, 1))
    blending = TakeBlending(system, POSE[None], NAMES, LAYOUT, Gains(), EVIDENCE, weights, None)
    outputs: Outputs = {
        "both": np.full((3, 1), 0.6), "left": np.full((3, 1), 0.6), "right": np.full((3, 1), 0.2)
    }  # fmt: skip
    blended = blending.raise_up(outputs, outputs)
    assert blended.missing["both"]["mouth"].all()
    assert ((blended.weights[:, 0] - weights[:, 0]) > 0.4).all() == raised
    assert len(held_back_findings(system, outputs, blended.missing)) == (not raised)
