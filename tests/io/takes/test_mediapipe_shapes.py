import json
from pathlib import Path

import numpy as np
import pytest

from usdface.errors import InputError
from usdface.findings import Finding
from usdface.io.takes.files import read_take
from usdface.options import TakeOptions
from usdface.takes import WeightsTake

SCORES = {"jawOpen": 0.25, "eyeBlinkLeft": 1.0}


def rows(scores: dict[str, float], key: str = "category_name") -> list[dict[str, object]]:
    """As MediaPipe lists them, its neutral first."""
    return [{"index": i, key: name, "score": s} for i, (name, s) in enumerate(scores.items())]


def read(path: Path, document: object, rate: float | None = None) -> tuple[WeightsTake, set[str]]:
    path.write_text(json.dumps(document))
    take, findings = read_take(path, TakeOptions(rate=rate))
    assert isinstance(take, WeightsTake)
    return take, {each.code for each in findings}


def ignored(findings: list[Finding]) -> list[str]:
    (one,) = [each for each in findings if each.code == "CHANNEL_IGNORED"]
    return list(one.values["channels"])


@pytest.mark.parametrize(
    "frame",
    [
        {"face_blendshapes": [rows({"_neutral": 0.0} | SCORES)]},
        {"face_blendshapes": rows(SCORES), "face_landmarks": []},
        {"faceBlendshapes": [{"categories": rows(SCORES, "categoryName")}]},
        {"faceBlendshapes": {"categories": rows(SCORES, "categoryName")}},
        {"blendshapes": SCORES},
    ],
)
def test_scores_are_found_however_they_are_nested(tmp_path: Path, frame: object) -> None:
    take, _ = read(tmp_path / "a.json", {"fps": 25, "frames": [frame, frame]})
    assert take.names == ("jawOpen", "eyeBlinkLeft") and take.rate == 25.0
    np.testing.assert_array_equal(take.weights, [[0.25, 1.0]] * 2)
    np.testing.assert_allclose(take.times, [0.0, 0.04])


def test_frames_without_a_face_are_left_out_and_times_are_kept(tmp_path: Path) -> None:
    stamps = (1000, 1040, 1080, 1160, 1200)
    shown = [rows({"jawOpen": time / 2000}) for time in stamps]
    frames = [
        {"face_blendshapes": [own], "timestamp_ms": time, "matrix": 0}
        for own, time in zip(shown, stamps, strict=True)
    ]
    frames[1]["face_blendshapes"] = []
    take, codes = read(tmp_path / "a.json", frames)
    np.testing.assert_allclose(take.times, [0.0, 0.08, 0.16, 0.2])
    np.testing.assert_allclose(take.column("jawOpen"), [0.5, 0.54, 0.58, 0.6])
    assert {"FRAME_EMPTY", "CHANNEL_IGNORED"} <= codes


def test_landmarks_come_first(tmp_path: Path) -> None:
    path, mark = tmp_path / "a.json", {"x": 0.5, "y": 0.5}
    path.write_text(json.dumps([{"landmarks": [mark, mark], "blendshapes": SCORES}] * 2))
    take, findings = read_take(path, TakeOptions(rate=25.0, image_size=(100, 100)))
    assert take.names == ("landmark_0", "landmark_1")
    assert "blendshapes" in next(f for f in findings if f.code == "CHANNEL_IGNORED").message


def test_landmarks_in_few_frames_are_announced(tmp_path: Path) -> None:
    path, mark = tmp_path / "a.json", {"x": 0.5, "y": 0.5}
    frames = [{"blendshapes": SCORES}] * 3
    path.write_text(json.dumps([{"landmarks": [mark, mark], "blendshapes": SCORES}, *frames]))
    take, findings = read_take(path, TakeOptions(rate=25.0))
    assert take.names == tuple(SCORES)
    assert ignored(findings) == ["landmarks, which fewer frames have"]


def test_frame_numbers_give_the_times(tmp_path: Path) -> None:
    frames = [{"frame": number, "blendshapes": SCORES} for number in (0, 10, 20)]
    take, codes = read(tmp_path / "a.json", {"fps": 30, "frames": frames})
    np.testing.assert_allclose(take.times, [0, 10 / 30, 20 / 30])
    assert "FRAMES_RENUMBERED" not in codes
    take, codes = read(tmp_path / "a.json", {"fps": 30, "frames": frames[1:]})
    np.testing.assert_allclose(take.times, [0, 10 / 30])
    assert "FRAMES_RENUMBERED" in codes


def test_what_a_file_has_beside_the_scores_of_one_face_is_announced(tmp_path: Path) -> None:
    path, shown = tmp_path / "a.json", rows(SCORES)
    one = {"blendshapes": [shown, shown], "timestamp_ms": 5}
    document = {"fps": 30, "frames": [one, {"blendshapes": [shown]}], "model": "v2"}
    path.write_text(json.dumps(document))
    _, findings = read_take(path, TakeOptions())
    expected = ["timestamp_ms, which some frames lack", "model"]
    assert ignored(findings) == expected
    document["frames"] = [{"faceBlendshapes": [{"categories": shown}] * 2}] * 2
    path.write_text(json.dumps(document))
    assert ignored(read_take(path, TakeOptions())[1]) == ["model"]


def test_scores_of_several_faces_are_a_warning(tmp_path: Path) -> None:
    """A frame lists faces in any order: the first of each may be another person."""
    path, shown = tmp_path / "a.json", rows(SCORES)
    frames = [{"blendshapes": [shown] * count} for count in (1, 2, 3)]
    path.write_text(json.dumps({"fps": 30, "frames": frames}))
    (found,) = [f for f in read_take(path, TakeOptions())[1] if f.code == "FACES_LEFT_OUT"]
    assert found.severity == "warning" and dict(found.values) == {"frame_count": 2}


def test_a_score_that_is_missing_is_bridged(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    shown = [rows({"jawOpen": value, "smile": 0.5, "puff": 0.1}) for value in (0.2, 0.0, 0.6)]
    del shown[1][0]["score"]
    shown[2][1]["score"] = None
    shown[0].pop()
    shown[1].pop()
    path.write_text(json.dumps([{"blendshapes": own} for own in shown]))
    take, findings = read_take(path, TakeOptions(rate=25.0))
    np.testing.assert_allclose(take.weights, [[0.2, 0.5], [0.4, 0.5], [0.6, 0.5]])
    bridged = [f for f in findings if f.code == "WEIGHT_BRIDGED"]
    assert [f.values["frames"] for f in bridged] == [[1], [2]]
    assert bridged[0].where.endswith("jawOpen") and ignored(findings) == ["puff"]


@pytest.mark.parametrize(
    ("frames", "message"),
    [
        ([{"face_blendshapes": []}], "no frame has landmarks or blend shapes"),
        ([{"blendshapes": {"jawOpen": "wide"}}], "no frame has landmarks or blend shapes"),
        ([{"blendshapes": {"jawOpen": 5000.0}}] * 2, "go up to 5000"),
        ([{"blendshapes": SCORES, "timestamp_ms": 7}] * 2, "increas"),
        ([{"blendshapes": {n: 0.5}} for n in "abc"], "in half of the frames"),
    ],
)
def test_what_holds_no_weights_is_one_line(tmp_path: Path, frames: object, message: str) -> None:
    path = tmp_path / "a.json"
    path.write_text(json.dumps(frames))
    with pytest.raises(InputError, match=message):
        read_take(path, TakeOptions())
