import json

import numpy as np
import pytest
from camera_worlds import SIZE, make_cameras, write_json, write_stereo_yaml, write_toml

from usdface.errors import InputError
from usdface.io.takes.camera_calibration import read_calibration

CAMERAS = make_cameras(2)


@pytest.mark.parametrize(
    ("file", "write", "count"),
    [
        ("stereo.yml", write_stereo_yaml, 2),
        ("rig.json", write_json, 3),
        ("rig.toml", write_toml, 3),
    ],
)
def test_every_form_gives_the_cameras(tmp_path, file, write, count):
    cameras = make_cameras(count)
    path = tmp_path / file
    path.write_text(write(cameras))
    found = read_calibration(path)
    assert len(found) == count
    for camera, expected in zip(found, cameras, strict=True):
        for field in ("matrix", "distortion", "rotation", "translation"):
            np.testing.assert_allclose(getattr(camera, field), getattr(expected, field), atol=1e-12)
        assert camera.image_size == SIZE


def test_names_of_other_programs_are_known(tmp_path):
    text = write_stereo_yaml(CAMERAS)
    for n in "12":
        text = text.replace(f"K{n}:", f"cameraMatrix{n}:").replace(f"D{n}:", f"distCoeffs{n}:")
    path = tmp_path / "a.yaml"
    path.write_text(text)
    np.testing.assert_allclose(read_calibration(path)[1].matrix, CAMERAS[1].matrix)


def test_rotations_that_rectify_the_images_are_not_those_of_the_cameras(tmp_path):
    """As OpenCV's stereoRectify writes them beside the calibration."""
    turn = "R{}: [0.96, 0, 0.28, 0, 1, 0, -0.28, 0, 0.96]\nP{}: [1, 0, 0, 0]\n"
    path = tmp_path / "a.yml"
    path.write_text(write_stereo_yaml(CAMERAS) + turn.format(1, 1) + turn.format(2, 2))
    for camera, expected in zip(read_calibration(path), CAMERAS, strict=True):
        np.testing.assert_allclose(camera.rotation, expected.rotation, atol=1e-12)


def test_both_cameras_of_a_pair_may_have_a_place_of_their_own(tmp_path):
    text = write_stereo_yaml(CAMERAS).replace("R:", "R2:").replace("T:", "T2:")
    path = tmp_path / "a.yml"
    path.write_text(text + "R1: [0, 0.5, 0]\nT1: [1, 2, 3]\n")
    left, right = read_calibration(path)
    np.testing.assert_allclose(left.translation, [1, 2, 3])
    np.testing.assert_allclose(right.rotation, CAMERAS[1].rotation, atol=1e-12)


def test_a_list_of_yaml_maps(tmp_path):
    path = tmp_path / "a.yml"
    path.write_text(
        "cameras:\n"
        "- name: left  # the one at the window\n"
        "  K: [[1000., 0, 320], [0, 1000, 240], [0, 0, 1]]\n"
        "  D: [0.1, 0, 0, 0]\n  R: [0, 0, 0]\n  T: [0, 0, 0]\n"
        "- name: 'right'\n"
        "  K:\n    rows: 3\n    cols: 3\n    data: [1000, 0, 320,\n      0, 1000, 240, 0, 0, 1]\n"
        "  rvec: [0, 0.5, 0]\n  tvec:\n  - 100\n  - 0\n  - 0\n"
    )
    left, right = read_calibration(path)
    assert (left.name, right.name) == ("left", "right")
    assert left.distortion[0] == 0.1
    np.testing.assert_allclose(right.rotation[0, 2], np.sin(0.5))
    np.testing.assert_allclose(right.translation, [100, 0, 0])


def edited(**changes):
    document = json.loads(write_json(CAMERAS))
    document["cameras"][1] |= changes
    return json.dumps(document)


def test_a_camera_of_a_list_without_a_matrix_gives_its_take_to_no_other(tmp_path):
    path = tmp_path / "a.json"
    document = json.loads(write_json(make_cameras(3)))
    listed = document["cameras"] if isinstance(document, dict) else document
    del listed[0]["camera_matrix"]
    path.write_text(json.dumps({"cameras": listed}))
    with pytest.raises(InputError, match=r"camera 1 of the list has no matrix of 9 numbers"):
        read_calibration(path)


@pytest.mark.parametrize(
    ("file", "text", "words"),
    [
        ("a.json", "{}", "0 cameras with a matrix; expected two or more"),
        ("a.json", "3", "expected cameras with their matrices"),
        ("a.json", edited(tvec=None), "'camera 2' has no translation"),
        ("a.json", edited(tvec=[1, 2]), "translation has shape (2,)"),
        ("a.json", edited(rvec=[1, 2]), "the rotation of camera 'camera 2' has 2 numbers"),
        ("a.json", edited(rvec=np.diag([1, 1, -1]).tolist()), "camera 'camera 2' is no rotation"),
        ("a.json", edited(rvec=[[0] * 3] * 3), "matrix of camera 'camera 2' is no rotation"),
        ("a.json", edited(camera_matrix=[[0] * 3] * 3), "expected the matrix [fx s cx; 0"),
        ("a.json", edited(distortion_coefficients=[0.1] * 14), "14 coefficients of distortion"),
        ("a.json", edited(distortion_coefficients={"k1": -0.2}), "distortion of 'camera 2' is no"),
        ("a.json", edited(distortion_coefficients=-0.2), "distortion of 'camera 2' is no list"),
        ("a.json", edited(fisheye=True), "is a fisheye camera"),
        ("a.yml", edited(fisheye=True), "is a fisheye camera"),
        ("a.xml", "<a/>", "calibrations of kind '.xml' are not read"),
        ("a.toml", "=", "is no TOML"),
        ("a.yml", "just words", "expected cameras with their matrices"),
        ("a.yml", "a: 1\na: 2\n", "line 2: 'a' occurs twice"),
    ],
)  # fmt: skip
def test_bad_calibrations_are_one_clear_line(tmp_path, file, text, words):
    path = tmp_path / file
    path.write_text(text)
    with pytest.raises(InputError) as raised:
        read_calibration(path)
    assert words in str(raised.value)
    assert "\n" not in str(raised.value)
