"""Findings of lids that would cross."""

import numpy as np
import pytest
from slits import slit_face

from usdface.blend_shape_evaluator import BlendShapeEvaluator
from usdface.closure.closed_eyes import close_eyes
from usdface.closure.lid_gaps import LidGaps
from usdface.face.bound_face import BoundFace
from usdface.takes import WeightsTake

NAMES = ("blink", "sneer")
FACE = BoundFace(slit_face(), (), np.zeros(0, int)).with_layout(())
FRAMES = 40
# Of two places along an eye 8 mm open, a sneer lifts the lower lid of one three times as far.
GAPS = LidGaps(
    "left",
    np.array([0.008, 0.008]),
    BlendShapeEvaluator(np.array([[-0.008, -0.008], [-0.003, -0.001]])),
    np.array([0, 1]),
    0.008,
    closer=0,
    tighteners=(),
    cheek_raisers=(),
    raisers=(),
    movers=np.array([True, True]),
)


def findings_of(blink: float, sneer: float) -> list[tuple[str, dict[str, object]]]:
    """Return findings of a take that holds both in its second half."""
    weights = np.zeros((FRAMES, 2))
    weights[FRAMES // 2 :] = blink, sneer
    take = WeightsTake(NAMES, np.arange(FRAMES) / 30, weights, 30.0)
    still = np.zeros_like(weights)
    closed = close_eyes(FACE, take, weights, None, still, {"left": GAPS})
    assert closed is not None
    assert GAPS.least(closed.weights).min() > -0.00017
    return [(f.code, dict(f.values)) for f in closed.findings if f.code.startswith("LIDS")]


def test_shut_lids_that_are_parted_and_stay_open_are_reported() -> None:
    ((code, values),) = findings_of(1.0, 1.0)
    assert code == "LIDS_PARTED"
    assert (values["frame_count"], values["first_frame"]) == (FRAMES // 2, FRAMES // 2)
    assert values["depth_mm"] == pytest.approx(3.0)
    # Parted to a depth of 0.16 mm at the one place, they are 2 mm further apart at the other.
    assert values["gap_mm"] == pytest.approx(2.0 - 0.16, abs=0.01)


@pytest.mark.parametrize(("blink", "sneer"), [(1.0, 0.0), (0.0, 1.0), (0.7, 1.0), (1.0, 0.4)])
def test_lids_that_close_or_were_open_are_not(blink: float, sneer: float) -> None:
    """At 0.7 one place was open by 1.4 mm before; a weaker sneer leaves 0.6 mm, a twelfth."""
    assert findings_of(blink, sneer) == []
