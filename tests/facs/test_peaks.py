from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from usdface.face.expression_poses import expressions_for
from usdface.facs.peaks import TakePeaks, judge_peaks
from usdface.facs.report import FacsReport, facs_findings
from usdface.io.bind_file import read_bind
from usdface.rigs import Rig

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture(scope="module")
def peaks(head: Rig) -> TakePeaks:
    """Joy and surprise as the example's poses, at its markers and on its face alike."""
    setup, _ = read_bind(EXAMPLES / "bind.json")
    mesh, names = head.face(), head.shape_names
    vertices = setup.binding.points
    poses = {e.name: e for e in expressions_for(names)[0]}
    emotions = ("joy", "surprise")
    weights = np.zeros((2, len(names)))
    for row, emotion in zip(weights, emotions, strict=True):
        for shape, weight in zip(poses[emotion].shapes, poses[emotion].weights, strict=True):
            row[names.index(shape)] = weight
    neutral = mesh.points[vertices]
    own = weights[:, [names.index(name) for name in mesh.shape_names]]
    moved = np.einsum("ks,svx->kvx", own, mesh.offsets_at(vertices))
    return TakePeaks(
        emotions,
        np.array([10, 70]),
        np.array([0.1, 0.7]),
        neutral,
        neutral + moved,
        np.array([0.0002, 0.0004]),
        names,
        weights,
        weights,
    )


def test_units_are_seen_at_the_markers_and_on_the_face(
    judged_head: FacsReport, peaks: TakePeaks
) -> None:
    for verdict in judge_peaks(judged_head, peaks):
        assert verdict.solved.missing == verdict.corrected.missing == ()
        assert verdict.lost == ()
        for at, on in zip(verdict.markers.expected, verdict.solved.expected, strict=True):
            assert at.mm == pytest.approx(on.mm, rel=0.6), (verdict.emotion, at)


def test_the_noise_is_that_of_the_solve_and_of_a_marker_at_least(
    judged_head: FacsReport, peaks: TakePeaks
) -> None:
    verdicts = judge_peaks(judged_head, peaks)
    assert [v.noise for v in verdicts] == pytest.approx([0.3, 0.4])


def test_a_unit_that_the_solve_loses_is_named(judged_head: FacsReport, peaks: TakePeaks) -> None:
    still = peaks.corrected.copy()
    still[1, [peaks.names.index(n) for n in peaks.names if n.startswith("brow")]] = 0.0
    verdicts = judge_peaks(judged_head, replace(peaks, corrected=still))
    assert [v.lost for v in verdicts] == [(), ("1", "2")]
    (found,) = facs_findings(replace(judged_head, peaks=verdicts))
    assert found.code == "FACS_UNIT_LOST" and found.where == "frame 70"
    assert found.values["emotion"] == "surprise"


def test_emotions_without_units_and_occluded_markers(
    judged_head: FacsReport, peaks: TakePeaks
) -> None:
    gone = np.full_like(peaks.markers, np.nan)
    verdicts = judge_peaks(judged_head, replace(peaks, emotions=("joy", "contempt"), markers=gone))
    assert [v.emotion for v in verdicts] == ["joy"]
    assert verdicts[0].markers.missing == ("6", "12")
