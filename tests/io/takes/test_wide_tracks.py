"""DeepLabCut, SLEAP and OpenFace: what their tables have beside x and y."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from usdface.errors import InputError
from usdface.io.takes.deeplabcut import read_deeplabcut
from usdface.io.takes.files import read_take
from usdface.io.takes.openface import read_openface
from usdface.io.takes.sleap import read_sleap
from usdface.options import TakeOptions


@pytest.fixture
def write(tmp_path):
    def write(*lines):
        path = tmp_path / "a.csv"
        path.write_text("\n".join(lines) + "\n")
        return path

    return write


def codes(findings):
    return [found.code for found in findings]


@pytest.mark.parametrize(
    ("confidence", "seen"), [(None, [True, False]), (0.3, [True, True]), (0.95, [False, False])]
)
def test_an_unlikely_point_is_occluded(write, confidence, seen):
    path = write(
        "scorer,n,n,n,n,n,n", "bodyparts,a,a,a,b,b,b", "coords" + ",x,y,likelihood" * 2,
        "0,1,2,0.9,3,4,0.99", "1,1,2,0.5,3,4,0.99",
    )  # fmt: skip
    take, findings = read_deeplabcut(path, TakeOptions(rate=25.0, confidence=confidence))
    assert take.select(("b",)).shape == (2, 1, 2)
    found = take.visible[:, 0].tolist() if "a" in take.names else [False, False]
    assert found == seen
    assert ("CONFIDENCE_LOW" in codes(findings)) == (seen != [True, True])


def test_individuals_stay_apart(write):
    path = write(
        "scorer,n,n,n,n", "individuals,anna,anna,ben,ben", "bodyparts,chin,chin,chin,chin",
        "coords,x,y,x,y", "0,1,2,3,4",
    )  # fmt: skip
    take, _ = read_deeplabcut(path, TakeOptions(rate=25.0))
    assert take.names == ("anna:chin", "ben:chin")
    np.testing.assert_allclose(take.positions[0], [[1.5, -2.5], [3.5, -4.5]])


def test_what_points_have_beside_a_place_in_the_image_is_announced(write):
    path = write(
        "scorer,n,n,n", "bodyparts,a,a,a", "coords,x,y,z", "0,1,2,3", "1,1,2,3",
    )  # fmt: skip
    _, findings = read_deeplabcut(path, TakeOptions(rate=25.0))
    assert [f.values["channels"] for f in findings if f.code == "CHANNEL_IGNORED"] == [["z"]]
    path = write(
        "track,frame_idx,instance.score,chin.x,chin.y,chin.z,area", ",0,0.9,1,2,3,4",
    )  # fmt: skip
    _, findings = read_sleap(path, TakeOptions(rate=25.0))
    assert [f.values["channels"] for f in findings if f.code == "CHANNEL_IGNORED"] == [
        ["instance.score", "chin.z", "area"]
    ]


def test_instances_of_sleap_stay_apart(write):
    path = write(
        "track,frame_idx,instance.score,chin.x,chin.y,chin.score,nose.x,nose.y,nose.score",
        "anna,0,0.9,1,2,0.9,3,4,0.9", "ben,0,0.9,5,6,0.9,7,8,0.1", "anna,2,0.9,1,2,0.9,,,",
        "ben,2,0.9,5,6,0.9,7,8,0.9",
    )  # fmt: skip
    take, findings = read_sleap(path, TakeOptions(rate=25.0))
    assert take.names == ("anna:chin", "anna:nose", "ben:chin", "ben:nose")
    assert take.visible.tolist() == [[True, True, True, False], [True, False, True, True]]
    np.testing.assert_allclose(take.times, [0, 0.08])
    assert codes(findings).count("CONFIDENCE_LOW") == 1


OPENFACE = "frame, face_id, timestamp, confidence, success, x_0, x_1, y_0, y_1"


def test_a_face_that_openface_lost_is_occluded(write):
    path = write(
        OPENFACE, "1, 0, 0.000, 0.98, 1, 10, 20, 30, 40", "2, 0, 0.040, 0.1, 0, 10, 20, 30, 40",
        "3, 0, 0.080, 0.75, 1, 10, 20, 30, 40",
    )  # fmt: skip
    take, findings = read_openface(path)
    assert (take.rate, take.names) == (25, ("landmark_0", "landmark_1"))
    (lost,) = [found for found in findings if found.code == "CONFIDENCE_LOW"]
    assert lost.message == "2 samples that the program calls lost are taken as occluded"
    assert take.visible[:, 0].tolist() == [True, False, True]
    np.testing.assert_allclose(take.positions[0], [[10.5, -30.5], [20.5, -40.5]])
    take, _ = read_openface(path, TakeOptions(confidence=0.9))
    assert take.visible[:, 0].tolist() == [True, False, False]


def test_times_that_stand_still_are_announced(write):
    """As OpenFace has them of single images."""
    rows = [f"{frame}, 0, 0.000, 0.98, 1, 10, 20, 30, 40" for frame in (1, 2)]
    take, findings = read_openface(write(OPENFACE, *rows), TakeOptions(rate=25.0))
    np.testing.assert_allclose(take.times, [0, 0.04])
    (lost,) = [f for f in findings if f.code == "CHANNEL_IGNORED"]
    assert "times, which do not increase" in lost.values["channels"]


def test_of_the_action_units_the_blink_is_read(write):
    path = write(
        OPENFACE + ", AU01_r, AU45_r", "1, 0, 0.000, 0.98, 1, 10, 20, 30, 40, 4, 0.5",
        "2, 0, 0.040, 0.5, 1, 10, 20, 30, 40, 4, 5.2", "3, 0, 0.080, 0.2, 0, 1, 2, 3, 4, 4, 2",
    )  # fmt: skip
    take, findings = read_openface(path)
    np.testing.assert_allclose(take.blink, [0.1, 1.0, np.nan])
    assert take.rate == 25
    sure, _ = read_openface(path, TakeOptions(confidence=0.9))
    np.testing.assert_allclose(sure.blink, [0.1, np.nan, np.nan])
    assert any("other action units" in found.message for found in findings)
    assert read_openface(write(OPENFACE, "1, 0, 0, 1, 1, 1, 2, 3, 4"))[0].blink is None


def test_a_blink_that_the_other_detector_denies_is_no_pulse(write):
    path = write(
        OPENFACE + ", AU45_r, AU45_c", "1, 0, 0.000, 0.98, 1, 10, 20, 30, 40, 2, 1",
        "2, 0, 0.040, 0.98, 1, 10, 20, 30, 40, 2, 0", "3, 0, 0.080, 0.2, 0, 1, 2, 3, 4, 2, 0",
    )  # fmt: skip
    np.testing.assert_allclose(read_openface(path)[0].blink, [0.4, 0.08, np.nan])


def test_a_file_of_openface_that_is_cut_short_is_refused_with_its_line(write):
    """The last 3 was 30: a place that is wrong without a trace."""
    whole = (OPENFACE, "1, 0, 0.000, 0.98, 1, 10, 20, 30, 40")
    for cut in ("2, 0, 0.040, 0.98, 1, 10, 20, 3", "2, 0"):
        with pytest.raises(InputError, match=r"line 3: \d cells; expected 9") as raised:
            read_openface(write(*whole, cut))
        assert raised.value.code == "FILE_CUT_OFF"
    assert len(read_openface(write(*whole))[0].times) == 1


GAZE = ", ".join(
    [*(f"gaze_{eye}_{axis}" for eye in (0, 1) for axis in "xyz"), "pose_Rx, pose_Ry, pose_Rz"]
)


@pytest.mark.parametrize("head", [[0.0, 0.0, 0.0], [0.3, -0.4, 0.2]])
def test_openface_names_the_gaze_before_its_camera(write, head):
    """With x right, y down and z ahead of it: a face that looks at it looks along -z."""
    yaw, pitch = 0.3, 0.2  # to the face's left, on the right of the image, and up
    gaze = np.array([np.sin(yaw) * np.cos(pitch), -np.sin(pitch), -np.cos(yaw) * np.cos(pitch)])
    seen = Rotation.from_euler("XYZ", head).as_matrix() @ gaze
    numbers = ", ".join(f"{value:.9f}" for value in [*seen, *seen, *head])
    path = write(
        f"{OPENFACE}, {GAZE}",
        f"1, 0, 0.000, 0.98, 1, 10, 20, 30, 40, {numbers}",
        f"2, 0, 0.040, 0.1, 0, 10, 20, 30, 40, {numbers}",
    )
    take, findings = read_openface(path)
    np.testing.assert_allclose(take.gaze, [[yaw, pitch], [np.nan, np.nan]], atol=1e-8)
    (ignored,) = (found for found in findings if found.code == "CHANNEL_IGNORED")
    assert "gaze" not in ignored.values["channels"]
    assert read_openface(write(OPENFACE, "1, 0, 0, 1, 1, 1, 2, 3, 4"))[0].gaze is None


def test_a_real_file_of_openface(shared_data):
    path = shared_data / "pyfeat" / "tests_data" / "OpenFace_Test.csv"
    if not path.is_file():
        pytest.skip(f"no real data: {path}")
    take, _ = read_take(path, TakeOptions(rate=30.0))
    assert len(take.names) == 68
    np.testing.assert_allclose(take.positions[0, 0, 0], 277.276 + 0.5)
    assert take.blink is not None and take.blink.argmax() == 41
    # The head leans by 17 to 20 degrees, and the eyes look at the camera all the time.
    np.testing.assert_allclose(np.degrees(np.median(take.gaze, axis=0)), [-0.2, 15.8], atol=0.3)
    assert np.degrees(np.std(take.gaze[10:], axis=0)).max() < 1.0
