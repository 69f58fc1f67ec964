"""The closure layer on a performer whose markers show a part of each blink."""

from dataclasses import replace

import numpy as np
import pytest
from closing_world import BLINKS, TIMES, markers, performance, result
from slits import slit_face

from usdface.arrays import FloatArray, IntArray
from usdface.closure import lid_apertures
from usdface.closure.closure_layer import Closure, close_eyes_and_lips
from usdface.closure.lid_apertures import lid_apertures_of
from usdface.closure.rims import RimPairs, rim_pairs
from usdface.closure.solved_performance import SolvedPerformance
from usdface.face.bound_face import BoundFace
from usdface.options import ClosureOptions, ProcessOptions
from usdface.retarget.exaggeration import Exaggeration
from usdface.rigs import Mesh
from usdface.setup.pin import Pin
from usdface.shot.retarget import retarget
from usdface.shot.shot import ShotResult
from usdface.takes import WeightsTake

MESH = slit_face()
NAMES = MESH.shape_names
FACE = BoundFace(MESH, (), np.zeros(0, int)).with_layout(())
APERTURES = lid_apertures_of(FACE, NAMES)


@pytest.fixture(scope="module", name="weak")
def _weak() -> ShotResult:
    """Of a performer whose lid markers move by 40 % of the character's."""
    return result(markers(MESH, performance(NAMES), share=0.4))


def closure_of(shot: ShotResult) -> Closure:
    assert shot.closure is not None
    return shot.closure


def codes(shot: ShotResult) -> set[str]:
    return {finding.code for finding in shot.findings}


def test_blinks_that_the_markers_show_in_part_close_the_eyes(weak: ShotResult) -> None:
    closings = closure_of(weak).closings
    assert [each.closing.kind for each in closings] == ["blink"] * len(BLINKS)
    for each, start in zip(closings, BLINKS, strict=True):
        assert abs(TIMES[each.peak] - start - 0.08) < 0.05
        assert max(each.before) < 0.6 and min(each.after) > 0.95
        assert max(each.apertures) < 1e-4
    assert "EYES_CLOSED" in codes(weak)


def test_between_the_blinks_the_eyes_stay_as_solved(weak: ShotResult) -> None:
    closure = closure_of(weak)
    still = closure.eyes.max(axis=1) == 0
    assert still.mean() > 0.7
    np.testing.assert_array_equal(closure.weights[still], weak.solved.weights[still])
    assert weak.weights.weights is closure.weights


def test_a_second_run_on_its_own_result_changes_nothing(weak: ShotResult) -> None:
    performance = SolvedPerformance.of(weak.shot.face, weak.solved, weak.solution)
    again = close_eyes_and_lips(performance, closure_of(weak).weights)
    assert again is not None
    np.testing.assert_allclose(again.weights, closure_of(weak).weights, atol=2e-5)


@pytest.mark.slow
def test_left_out_by_option_or_by_setting() -> None:
    take = markers(MESH, performance(NAMES))
    off = ProcessOptions(express=False, closure=False)
    assert result(take, options=off).closure is None
    assert result(take, closure=ClosureOptions(lids=False, lips=False)).closure is None
    lips_only = closure_of(result(take, closure=ClosureOptions(lids=False)))
    assert not lips_only.eyes.any()


def test_a_squint_stays_open() -> None:
    squint = 0.6 * np.clip(np.minimum(TIMES - 3.2, 3.9 - TIMES) / 0.35, 0, 1)
    both = {f"eyeSquint{side}": squint for side in ("Left", "Right")}
    shot = result(markers(MESH, performance(NAMES, **both)))
    assert not closure_of(shot).eyes[TIMES > 3.1].any()


_slow = pytest.mark.slow


@pytest.mark.slow
@pytest.mark.parametrize(
    ("first", "last", "of_weights"),
    [
        (0.2, 3.0, False),
        (1.0, 0.2, True),
        pytest.param(0.2, 0.2, False, marks=_slow),
        pytest.param(1.0, 0.2, False, marks=_slow),
        pytest.param(0.2, 0.2, True, marks=_slow),
        pytest.param(0.2, 3.0, True, marks=_slow),
    ],
)
def test_blinks_close_eyes_that_are_exaggerated(
    first: float, last: float, of_weights: bool
) -> None:
    """A blink is one by what the performer did, whatever the animator makes of the face."""
    curves = performance(NAMES)
    shot = result(markers(MESH, curves)).shot
    if of_weights:
        shot = replace(shot, take=WeightsTake(NAMES, TIMES, curves, 60.0))
    factors = Exaggeration({"face": np.linspace(first, last, len(TIMES))})
    played = retarget(replace(shot, exaggeration=factors), options=ProcessOptions(express=False))
    closings = closure_of(played).closings
    assert [each.closing.kind for each in closings] == ["blink"] * len(BLINKS)
    assert min(min(each.after) for each in closings) > 0.95


@pytest.mark.slow
def test_a_larger_mouth_contradicts_no_marker() -> None:
    """Lips that opened less on the performer open as far as the animator wants."""
    opened = 0.2 * np.clip(np.sin(2 * np.pi * TIMES), 0, None)
    take = markers(MESH, performance(NAMES, jawOpen=opened))
    for factor in (2.0, 4.0):
        larger = result(take, exaggeration={"face": factor})
        assert not codes(larger) & {"LIPS_CLOSED", "LIPS_UNSEEN"}
        assert not closure_of(larger).mouth.any()


@pytest.mark.slow
def test_a_pin_stays_and_lids_that_it_makes_cross_are_reported() -> None:
    frame = int(3.3 * 60)
    pinned = {"eyeBlinkLeft": 1.0, "eyeSquintLeft": 1.0, "eyeWideLeft": 0.0}
    pins = [Pin(name, np.array([frame]), np.array([weight])) for name, weight in pinned.items()]
    shot = result(markers(MESH, performance(NAMES)), pins=pins)
    final = shot.weights.weights[frame]
    assert final[NAMES.index("eyeBlinkLeft")] == final[NAMES.index("eyeSquintLeft")] == 1.0
    assert "LIDS_CROSS" in codes(shot)


@pytest.mark.slow
def test_beside_one_pin_other_shapes_give_way() -> None:
    frame = int(3.3 * 60)
    squint = np.where(np.abs(TIMES - 3.3) < 0.6, 0.8, 0.0)
    pins = [Pin("eyeBlinkLeft", np.array([frame]), np.array([1.0]))]
    shot = result(markers(MESH, performance(NAMES, eyeSquintLeft=squint)), pins=pins)
    final = shot.weights.weights
    assert final[frame, NAMES.index("eyeBlinkLeft")] == 1.0
    assert APERTURES["left"].least(final).min() > -0.0003
    assert "LIDS_CROSS" not in codes(shot)


@pytest.mark.slow
def test_a_pin_at_0_keeps_an_eye_open_in_a_blink() -> None:
    frame = int((BLINKS[0] + 0.09) * 60)
    pins = [Pin("eyeBlinkLeft", np.array([frame]), np.array([0.0]))]
    shot = result(markers(MESH, performance(NAMES)), pins=pins)
    final = shot.weights.weights[frame]
    assert final[NAMES.index("eyeBlinkLeft")] == 0.0
    assert final[NAMES.index("eyeBlinkRight")] > 0.95


def test_without_markers_at_the_lids_it_is_reported() -> None:
    shot = result(markers(MESH, performance(NAMES), without=("eye",)))
    assert "LIDS_UNSEEN" in codes(shot)
    assert not closure_of(shot).closings


def test_blinks_named_so_that_bring_no_lids_together_are_reported() -> None:
    """As on a mesh of few vertices, where lids have no rims."""
    short = tuple(
        replace(s, offsets=0.5 * s.offsets) if s.name.startswith("eyeBlink") else s
        for s in MESH.shapes
    )
    shot = result(markers(MESH, performance(NAMES)), mesh=replace(MESH, shapes=short))
    (found,) = (f for f in shot.findings if f.code == "LIDS_NOT_FOUND")
    assert found.values["shapes"] == ["eyeBlinkLeft", "eyeBlinkRight"]
    unnamed = tuple(replace(s, name=f"target_{k}") for k, s in enumerate(short))
    other = result(markers(MESH, performance(NAMES)), mesh=replace(MESH, shapes=unnamed))
    assert "LIDS_NOT_FOUND" not in codes(other)


@pytest.mark.slow
def test_one_eye_without_markers_blinks_with_the_other() -> None:
    shot = result(markers(MESH, performance(NAMES), without=("eye_left",)))
    assert {"LIDS_UNSEEN", "BLINK_GUESSED"} <= codes(shot)
    assert APERTURES["left"].widest(shot.weights.weights).min() < 1e-4


@pytest.mark.slow
def test_the_lids_are_measured_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """By the check of the lids' markers, which hands them on."""
    measured = []

    def counted(mesh: Mesh, lids: IntArray, closed: FloatArray, reach: float) -> RimPairs:
        measured.append(mesh)
        return rim_pairs(mesh, lids, closed, reach)

    monkeypatch.setattr(lid_apertures, "rim_pairs", counted)
    shown = result(markers(MESH, performance(NAMES)), mesh=MESH)
    assert shown.closure is not None
    assert len(measured) == 2  # eyes
