"""Cameras with distortion around a moving cloud of points, and calibration files of them."""

import json

import numpy as np
from scipy.spatial.transform import Rotation

from usdface.geometry.camera import Camera, project

__all__ = [
    "SIZE",
    "make_cameras",
    "moving_points",
    "project_all",
    "write_json",
    "write_stereo_yaml",
    "write_toml",
]

SIZE = (1280, 960)


def make_cameras(count: int = 2) -> tuple[Camera, ...]:
    """Cameras 0.6 m from the origin of the first one's view, 20 degrees apart; units are metres."""
    cameras = []
    for n in range(count):
        turn = Rotation.from_euler("y", -20 * n, degrees=True).as_matrix()
        centre = np.array([0, 0, 0.6])
        cameras.append(
            Camera(
                matrix=[[1400.0 + 10 * n, 0, 655.5], [0, 1395.0, 470.25 + n], [0, 0, 1]],
                distortion=[-0.21, 0.09, 8e-4, -5e-4, -0.01, 0, 0, 0],
                rotation=turn,
                translation=centre - turn @ centre,
                image_size=SIZE,
                name=f"camera {n + 1}",
            )
        )
    return tuple(cameras)


def moving_points(frames: int = 30, markers: int = 8, seed: int = 0) -> np.ndarray:
    """Points (F, M, 3) [m] in front of the cameras, in the world of the first."""
    rng = np.random.default_rng(seed)
    rest = rng.uniform(-0.08, 0.08, (markers, 3)) + np.array([0, 0, 0.6])
    phase = rng.uniform(0, 2 * np.pi, (markers, 3))
    wave = 0.005 * np.sin(np.arange(frames)[:, None, None] * 0.3 + phase)
    return rest + wave


def project_all(cameras, points: np.ndarray) -> np.ndarray:
    """Pixels (C, ..., 2)."""
    return np.stack([project(camera, points) for camera in cameras])


def _opencv(name: str, values: np.ndarray) -> str:
    values = np.atleast_2d(values)
    data = ", ".join(f"{v:.16e}" for v in values.ravel())
    half = data.index(",", len(data) // 2) + 1  # FileStorage breaks long lines
    rows, cols = values.shape
    return (
        f"{name}: !!opencv-matrix\n   rows: {rows}\n   cols: {cols}\n   dt: d\n"
        f"   data: [ {data[:half]}\n       {data[half:]} ]\n"
    )


def write_stereo_yaml(cameras) -> str:
    """A stereo calibration as OpenCV's FileStorage writes it."""
    first, second = cameras
    text = f"%YAML:1.0\n---\nimage_width: {SIZE[0]}\nimage_height: {SIZE[1]}\n"
    for n, camera in enumerate(cameras, 1):
        text += _opencv(f"K{n}", camera.matrix) + _opencv(f"D{n}", camera.distortion[:5])
    assert np.allclose(first.rotation, np.eye(3))
    return text + _opencv("R", second.rotation) + _opencv("T", second.translation[:, None])


def write_json(cameras) -> str:
    """A list of cameras as JSON of FileStorage."""
    entries = [
        {
            "name": camera.name,
            "image_size": list(SIZE),
            "camera_matrix": _matrix(camera.matrix),
            "distortion_coefficients": _matrix(camera.distortion[None]),
            "rvec": Rotation.from_matrix(camera.rotation.copy()).as_rotvec().tolist(),
            "tvec": camera.translation.tolist(),
        }
        for camera in cameras
    ]
    return json.dumps({"cameras": entries})


def _matrix(values: np.ndarray) -> dict[str, object]:
    rows, cols = values.shape
    data = values.ravel().tolist()
    return {"type_id": "opencv-matrix", "rows": rows, "cols": cols, "dt": "d", "data": data}


def write_toml(cameras) -> str:
    """A calibration as multi-camera pose programs write it."""
    text = ""
    for n, camera in enumerate(cameras):
        turn = Rotation.from_matrix(camera.rotation.copy()).as_rotvec().tolist()
        text += (
            f'[cam_{n}]\nname = "{camera.name}"\nsize = {list(SIZE)}\nfisheye = false\n'
            f"matrix = {camera.matrix.tolist()}\ndistortions = {camera.distortion[:5].tolist()}\n"
            f"rotation = {turn}\ntranslation = {camera.translation.tolist()}\n\n"
        )
    return text + "[metadata]\nerror = 0.3\n"
