"""Lips that touch on the performer and were solved open."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from closing_world import TIMES, markers, performance, result, shot_of
from slits import slit_face

from usdface.closure.closed_lips import close_lips
from usdface.closure.lip_contact import lip_apertures_of
from usdface.closure.solved_performance import SolvedPerformance
from usdface.options import ProcessOptions
from usdface.rigs import Rig
from usdface.shot.retarget import retarget
from usdface.shot.shot import ShotResult

MESH = slit_face()
NAMES = MESH.shape_names
OPEN = 0.3 * np.clip(np.sin(2 * np.pi * TIMES), 0, None)
FREE = np.zeros((len(TIMES), len(NAMES)))


@cache
def speaking() -> ShotResult:
    return result(
        markers(MESH, performance(NAMES, jawOpen=OPEN)),
        options=ProcessOptions(express=False, closure=False),
    )


def left_open(by: float) -> np.ndarray:
    """Return the solved weights with a jaw that is open too far."""
    weights = speaking().solved.weights.copy()
    weights[:, NAMES.index("jawOpen")] += by
    return weights


def test_lips_that_touch_are_brought_together_and_open_ones_are_left() -> None:
    face, solution = speaking().shot.face, speaking().solution
    wrong = replace(speaking().solved, weights=left_open(0.12))
    assert solution is not None
    closed = close_lips(SolvedPerformance(face, wrong, wrong, solution, FREE), wrong.weights)
    apertures = lip_apertures_of(face, NAMES)
    assert closed is not None and apertures is not None
    touching = OPEN == 0
    touching[:25] = False
    inside = touching & np.roll(touching, 5) & np.roll(touching, -5)
    before, after = (
        apertures.opened(wrong.weights).max(axis=1),
        apertures.opened(closed.weights).max(axis=1),
    )
    assert before[inside].min() > 0.0015
    assert after[inside].max() < 0.0006
    wide = (OPEN > 0.25) & (TIMES > 0.5)
    np.testing.assert_array_equal(closed.weights[wide], wrong.weights[wide])
    assert closed.course[inside].min() > 0.6 and not closed.course[wide].any()
    assert [finding.code for finding in closed.findings] == ["LIPS_CLOSED"]


def test_lips_of_a_take_of_weights_stay_as_they_are() -> None:
    curves = replace(speaking().solved, weights=left_open(0.12))
    performance = SolvedPerformance.of(speaking().shot.face, curves, None)
    assert close_lips(performance, curves.weights) is None


def test_lips_that_stay_open_are_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("usdface.closure.lip_contact._ROUNDS", 0)
    face, solution = speaking().shot.face, speaking().solution
    wrong = replace(speaking().solved, weights=left_open(0.12))
    assert solution is not None
    closed = close_lips(SolvedPerformance(face, wrong, wrong, solution, FREE), wrong.weights)
    assert closed is not None
    (apart,) = closed.findings
    assert apart.code == "LIPS_APART" and apart.values["frame_count"] > 20
    assert apart.values["gap_mm"] == pytest.approx(2.4, abs=0.8)
    # Speaking, they are open by 8 mm, of which the markers allow all but these.
    assert "mm at most more than the markers allow" in apart.message


def test_a_solve_that_the_markers_agree_with_stays() -> None:
    solution = speaking().solution
    assert solution is not None
    solved = speaking().solved
    closed = close_lips(
        SolvedPerformance(speaking().shot.face, solved, solved, solution, FREE), solved.weights
    )
    assert closed is not None and not closed.findings
    np.testing.assert_array_equal(closed.weights, solved.weights)


def test_exaggerated_lips_open_as_much_further_and_touch_as_before() -> None:
    """On another person's face, whose lips are limited in all frames."""
    face, solution = speaking().shot.face, speaking().solution
    assert solution is not None
    tolerance = face.tolerance
    unlike = replace(solution, misfit=2.0 * tolerance)
    jaw = NAMES.index("jawOpen")
    performed = replace(speaking().solved, weights=left_open(0.04))
    factors = np.ones(len(NAMES))
    factors[jaw] = 1.5
    exaggerated = replace(performed, weights=performed.weights * factors)
    apertures = lip_apertures_of(face, NAMES)
    assert apertures is not None
    opened = []
    for solved in (performed, exaggerated):
        closed = close_lips(
            SolvedPerformance(face, solved, performed, unlike, FREE), solved.weights
        )
        assert closed is not None
        opened.append(apertures.opened(closed.weights).max(axis=1))
    plain, larger = opened
    apart = (plain > 2.5 * tolerance) & (plain < 0.004)
    assert apart.sum() > 10 and plain[OPEN == 0][30:].max() < 1.3 * tolerance
    assert (larger[apart] / plain[apart]).min() > 1.2
    assert larger[OPEN == 0][30:].max() < 1.3 * tolerance


def test_pinned_frames_stay() -> None:
    face, solution = speaking().shot.face, speaking().solution
    wrong = replace(speaking().solved, weights=left_open(0.12))
    pinned = FREE.copy()
    pinned[40:60, NAMES.index("jawOpen")] = 1.0
    assert solution is not None
    closed = close_lips(SolvedPerformance(face, wrong, wrong, solution, pinned), wrong.weights)
    assert closed is not None
    np.testing.assert_array_equal(closed.weights[40:60], wrong.weights[40:60])


@pytest.mark.slow
def test_without_lip_markers_it_is_reported() -> None:
    shot = result(
        markers(MESH, performance(NAMES, jawOpen=OPEN), without=("mouth_up",)),
        options=ProcessOptions(express=False),
    )
    assert "LIPS_UNSEEN" in {finding.code for finding in shot.findings}


def test_no_tolerance_is_the_least_one() -> None:
    """A shot may author 0: finite weights, closed as by a hundredth of a millimetre."""
    face, solution = speaking().shot.face, speaking().solution
    wrong = replace(speaking().solved, weights=left_open(0.12))
    assert solution is not None
    found = []
    for tolerance in (0.0, 1e-5):
        own = replace(face, layout=replace(face.layout, tolerance=tolerance))
        closed = close_lips(SolvedPerformance(own, wrong, wrong, solution, FREE), wrong.weights)
        assert closed is not None and np.isfinite(closed.weights).all()
        found.append(closed)
    np.testing.assert_array_equal(found[0].weights, found[1].weights)
    np.testing.assert_array_equal(found[0].course, found[1].course)


@pytest.mark.parametrize("size", [0.5, 4.0])
def test_lips_of_a_face_of_any_size_are_closed_alike(size: float) -> None:
    """Also where the shot has no layout, whose tolerance then is that of a human face."""
    solution = speaking().solution
    assert solution is not None
    shown = markers(MESH, performance(NAMES, jawOpen=OPEN))
    shot = shot_of(replace(shown, positions=size * shown.positions), MESH)
    shot = replace(shot, rig=Rig("Face", (MESH.scaled(size),)))
    large = retarget(shot, options=ProcessOptions(express=False, closure=False))
    assert large.solution is not None
    closed = []
    for of, found in ((speaking(), solution), (large, large.solution)):
        wrong = replace(of.solved, weights=left_open(0.12))
        bare = replace(of.shot.face, layout=replace(of.shot.face.layout, tolerance=None))
        closed.append(close_lips(SolvedPerformance(bare, wrong, wrong, found, FREE), wrong.weights))
    one, other = closed
    assert one is not None and other is not None and one.course.max() > 0.5
    np.testing.assert_allclose(other.weights, one.weights, atol=1e-3)
    assert [f.code for f in other.findings] == [f.code for f in one.findings] == ["LIPS_CLOSED"]
