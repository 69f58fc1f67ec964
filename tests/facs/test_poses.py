import numpy as np
import pytest

from usdface.face.expression_poses import EMOTIONS, expressions_for
from usdface.facs.movements import MOVEMENTS, POINTS, prototype
from usdface.facs.poses import PAPER_CRITERIA, judge_pose, units_expected
from usdface.facs.report import FacsReport, judge_rig
from usdface.rigs import Rig


def shown(units: dict[str, float]) -> np.ndarray:
    return sum(
        (mm * prototype(MOVEMENTS[unit], "") for unit, mm in units.items()),
        np.zeros((len(POINTS), 3)),
    )


@pytest.fixture(scope="module")
def posed(head: Rig) -> FacsReport:
    return judge_rig(head, expressions_for(head.shape_names)[0])


def test_units_of_a_pose_are_parted() -> None:
    """Also where one lowers what another raises. Amounts are the ways of the farthest points."""
    moved = shown({"1": 6.0, "4": 3.0, "15": 5.0})
    verdict = judge_pose("sadness", moved, ("1", "4", "15"), 0.3, 0.1)
    farthest = [6.0, 3.0 * np.linalg.norm((5, 10, 3)) / 10, 5.0 * np.linalg.norm((4, 10, 3)) / 10]
    assert [a.mm for a in verdict.expected] == pytest.approx(farthest)
    assert verdict.missing == () and verdict.others == () and verdict.criteria is True


def test_a_unit_that_is_not_there_is_named() -> None:
    verdict = judge_pose("sadness", shown({"1": 6.0, "15": 5.0}), ("1", "4", "15"), 0.3, 0.1)
    assert verdict.missing == ("4",) and verdict.criteria is False


def test_another_unit_that_moves_is_named() -> None:
    verdict = judge_pose("joy", shown({"12": 6.0, "2": 5.0, "9": 0.2}), ("6", "12"), 0.3, 0.1)
    assert verdict.missing == ("6",)
    assert [other.unit for other in verdict.others] == ["2"]


def test_a_still_face_shows_nothing() -> None:
    verdict = judge_pose("joy", shown({}), ("6", "12"), 0.3, 0.1)
    assert verdict.missing == ("6", "12") and verdict.criteria is False and not verdict.others


def test_pressed_lips_are_tightened_ones_too() -> None:
    verdict = judge_pose("anger", shown({"24": 4.0, "4": 5.0}), ("4", "23"), 0.3, 0.1)
    assert verdict.missing == () and verdict.criteria is True


def test_the_six_poses_of_the_paper(posed: FacsReport) -> None:
    """The example's poses meet the criteria of the paper; of their own units one is hidden: lids
    that are wide open in fear do not tighten.
    """
    assert {pose.name for pose in posed.poses} == set(PAPER_CRITERIA) == set(EMOTIONS)
    assert all(pose.criteria for pose in posed.poses)
    assert {pose.name: pose.missing for pose in posed.poses if pose.missing} == {"fear": ("7",)}
    assert not any(pose.others for pose in posed.poses)


@pytest.mark.slow
def test_poses_under_each_other_s_names_fail(posed: FacsReport) -> None:
    """No pose passes for another: units are missing, or others move (fear has all of surprise)."""
    expressions, _ = expressions_for(posed.rig.shape_names)
    for pose, expression in zip(posed.poses, expressions, strict=True):
        weights = np.zeros((1, len(posed.rig.shape_names)))
        for shape, weight in zip(expression.shapes, expression.weights, strict=True):
            weights[0, posed.rig.shape_names.index(shape)] = weight
        moved = posed.points.displaced(posed.rig, posed.rig.shape_names, weights)[0]
        for other in EMOTIONS:
            verdict = judge_pose(other, moved, units_expected(other), 0.3, 0.1)
            assert other == pose.name or verdict.missing or verdict.others, (pose.name, other)
