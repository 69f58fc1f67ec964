"""Findings of lids that would cross."""

from dataclasses import replace

import numpy as np
import pytest
from slits import slit_face

from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.closure.closed_eyes import close_eyes
from usdface.closure.lid_apertures import LidApertures
from usdface.closure.solved_performance import SolvedPerformance
from usdface.face.bound_face import BoundFace
from usdface.takes import WeightsTake

NAMES = ("blink", "sneer")
FACE = BoundFace(slit_face(), (), np.zeros(0, int)).with_layout(())
FRAMES = 40
# Of two places along an eye 8 mm open, a sneer lifts the lower lid of one three times as far.
APERTURES = LidApertures(
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
    closed = close_eyes(
        SolvedPerformance(FACE, take, take, None, still), weights, {"left": APERTURES}
    )
    assert closed is not None
    assert APERTURES.least(closed.weights).min() > -0.00017
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


def closings_of(wide: float, pinned: float) -> tuple[int, float]:
    """Return the number of completed blinks, and the aperture [m] at a blink that is whole."""
    names, times = ("blink", "wide"), np.arange(0.0, 4.0, 1 / 60)
    rise = np.clip(np.minimum((times - 2.0) / 0.08, (2.26 - times) / 0.16), 0, 1)
    weights = np.stack([0.5 - 0.5 * np.cos(np.pi * rise), np.full(len(times), wide)], axis=1)
    apertures = replace(
        APERTURES,
        evaluator=BlendShapeEvaluator(np.array([[-0.008, -0.008], [0.003, 0.003]])),
        raisers=(1,),
        movers=np.array([True, False]),
    )
    take, near = WeightsTake(names, times, weights, 60.0), np.full_like(weights, pinned)
    found = close_eyes(
        SolvedPerformance(FACE, take, take, None, near), weights, {"left": apertures}
    )
    assert found is not None
    # The closing shape as it becomes: a second run changes at most the other one.
    weights[:, 0] = found.weights[:, 0]
    closed = close_eyes(
        SolvedPerformance(FACE, take, take, None, near), weights, {"left": apertures}
    )
    assert closed is not None
    findings = [each.code for each in closed.findings if each.code == "EYES_CLOSED"]
    assert bool(findings) == bool(closed.closings)
    return len(closed.closings), float(apertures.widest(closed.weights)[125])


def test_a_blink_is_completed_also_where_only_a_raised_lid_comes_down() -> None:
    count, aperture = closings_of(wide=0.4, pinned=0.0)
    assert count == 1 and aperture < 1e-4


def test_a_blink_that_changes_nothing_was_not_completed() -> None:
    """Because pins hold its weights, or they were closed."""
    assert closings_of(wide=0.4, pinned=1.0)[0] == closings_of(wide=0.0, pinned=0.0)[0] == 0


def test_a_blink_that_only_the_recording_names_is_closed_and_reported() -> None:
    times = np.arange(0.0, 4.0, 1 / 60)
    still = np.zeros((len(times), 2))
    take = WeightsTake(NAMES, times, still, 60.0)
    rise = np.clip(np.minimum((times - 2.0) / 0.08, (2.26 - times) / 0.16), 0, 1)
    closed = close_eyes(
        SolvedPerformance(FACE, take, take, None, still),
        still,
        {"left": APERTURES},
        blink=0.3 * rise,
    )
    assert closed is not None
    aperture = APERTURES.widest(closed.weights)
    assert aperture[120:136].min() < 1e-4
    assert aperture[:115].min() == aperture[140:].min() == APERTURES.opening
    assert [each.code for each in closed.findings] == ["BLINK_RECORDED", "EYES_CLOSED"]
    pinned = close_eyes(
        SolvedPerformance(FACE, take, take, None, still + 1.0),
        still,
        {"left": APERTURES},
        blink=0.3 * rise,
    )
    assert pinned is not None and not pinned.findings
    unreported = close_eyes(
        SolvedPerformance(FACE, take, take, None, still), still, {"left": APERTURES}
    )
    assert unreported is not None and not unreported.closings
