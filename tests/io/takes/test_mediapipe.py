import json

import numpy as np
import pytest
from track_writers import SIZE

from usdface.errors import InputError
from usdface.io.takes.files import read_take
from usdface.io.takes.mediapipe import read_mediapipe
from usdface.options import TakeOptions

FACE = [{"x": 0.25, "y": 0.5, "z": 0.0}, {"x": 0.75, "y": 0.25, "z": 0.0}]
PLACES = [[480, -540], [1440, -270]]
LISTED = [[0.25, 0.5, 0.0], [0.75, 0.25, 0.0]]


@pytest.mark.parametrize(
    "document",
    [
        [FACE, FACE],
        [LISTED, LISTED],
        [[FACE], [FACE]],
        {"frames": [{"landmarks": FACE}, {"landmarks": FACE}]},
        {"frames": [{"faceLandmarks": [FACE, LISTED]}, {"faceLandmarks": [FACE]}]},
        {"results": [{"multi_face_landmarks": [{"landmark": FACE}]}] * 2},
        [{"face_landmarks": [LISTED]}] * 2,
    ],
)
def test_landmarks_are_found_however_they_are_nested(tmp_path, document):
    path = tmp_path / "a.json"
    path.write_text(json.dumps(document))
    take, _ = read_take(path, TakeOptions(rate=25.0, image_size=SIZE))
    assert take.names == ("landmark_0", "landmark_1")
    np.testing.assert_allclose(take.positions, [PLACES] * 2)


def ignored(findings):
    (one,) = [found for found in findings if found.code == "CHANNEL_IGNORED"]
    return list(one.values["channels"])


def test_what_frames_have_beside_the_landmarks_of_one_face_is_announced(tmp_path):
    """As MediaPipe's face landmarker does: blend shapes, a transform, presence."""
    seen = [{**landmark, "presence": 1.0} for landmark in FACE]
    frames = [{"faceLandmarks": [seen, FACE], "faceBlendshapes": [{"score": 0.5}]}]
    path = tmp_path / "a.json"
    path.write_text(json.dumps([{"faceLandmarks": [seen]}, *frames]))
    _, findings = read_take(path, TakeOptions(rate=25.0, image_size=SIZE))
    assert ignored(findings) == ["z", "faceBlendshapes", "presence"]
    stamped = [{"landmarks": FACE, "timestamp_ms": 0}, {"landmarks": FACE}]
    path.write_text(json.dumps({"frames": stamped, "fps": 25, "blendshapes": [[0.5]]}))
    _, findings = read_take(path, TakeOptions(image_size=SIZE))
    assert ignored(findings) == ["z", "timestamp_ms, which some frames lack", "blendshapes"]
    path = tmp_path / "a.csv"
    path.write_text("frame,landmark,x,y,z,visibility\n0,1,0.5,0.5,0,1\n1,1,0.5,0.5,0,1\n")
    _, findings = read_take(path, TakeOptions(rate=25.0, image_size=SIZE))
    assert ignored(findings) == ["z", "visibility"]
    path.write_text("frame,x_0,y_0,z_0,blink\n0,0.5,0.5,0,1\n1,0.5,0.5,0,1\n")
    _, findings = read_mediapipe(path, TakeOptions(rate=25.0, image_size=SIZE))
    assert ignored(findings) == ["z", "blink"]


def test_a_frame_without_a_face_is_occluded(tmp_path):
    path = tmp_path / "a.json"
    path.write_text(json.dumps({"fps": 50, "frames": [FACE, [], {"face_landmarks": []}, FACE]}))
    take, _ = read_take(path, TakeOptions(image_size=SIZE))
    assert take.rate == 50
    assert take.visible[:, 0].tolist() == [True, False, False, True]


@pytest.mark.parametrize(
    "column", ["x_{}|y_{}", "{}_x|{}_y", "landmark_{}_x|landmark_{}_y", "x{}|y{}"]
)
def test_a_row_for_each_frame(tmp_path, column):
    path = tmp_path / "a.csv"
    header = [part.format(n) for n in range(478) for part in column.split("|")]
    row = ["0.25", "0.5"] * 478
    path.write_text(",".join(["frame", *header]) + "\n" + ",".join(["3", *row]) + "\n")
    take, findings = read_take(path, TakeOptions(rate=25.0, image_size=SIZE))
    assert len(take.names) == 478
    np.testing.assert_allclose(take.positions[0], [PLACES[0]] * 478)
    assert "FRAMES_RENUMBERED" in [found.code for found in findings]


def test_pixels_are_refused(tmp_path):
    path = tmp_path / "a.json"
    path.write_text(json.dumps([[[640, 400, 0]]]))
    with pytest.raises(InputError, match="reach 640; expected parts of the image as MediaPipe"):
        read_take(path, TakeOptions(image_size=SIZE))
