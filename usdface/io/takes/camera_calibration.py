"""Calibrations of several cameras: OpenCV's FileStorage as YAML or JSON, and TOML.

Two forms, with the names that programs use for the same thing:

* a stereo pair: ``K1``, ``D1``, ``K2``, ``D2``, ``R``, ``T`` (``M1``, ``cameraMatrix1``,
  ``distCoeffs1``, ...); the world is the first camera's space;
* a list or map of cameras, as ``cameras`` or at the top: each has ``K`` (``camera_matrix``,
  ``matrix``), ``D`` (``distortion_coefficients``, ``distortions``), ``R`` (a matrix, or a rotation
  vector as ``rvec``, ``rotation``), ``T`` (``tvec``, ``translation``), and perhaps ``image_size``
  (``size``, ``image_width``) and ``name``.

``x_camera = R x_world + T``. Matrices are lists, lists of rows, or ``{rows, cols, data}``.
"""

import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from usdface.arrays import FloatArray
from usdface.errors import InputError, errors_at
from usdface.geometry.camera import COEFFICIENTS, Camera
from usdface.io.takes.json_text import number, read_json
from usdface.io.takes.text_table import read_text
from usdface.io.takes.yaml_text import read_yaml

__all__ = ["read_calibration"]

_LARGEST = 4_000_000  # bytes; read in 20 s at most
_MOST_CAMERAS = 100
_NAMES = {
    "matrix": ("k", "cameramatrix", "matrix", "m", "intrinsicmatrix", "intrinsic", "mtx"),
    "distortion": (
        "d",
        "distortioncoefficients",
        "distcoeffs",
        "distortions",
        "distortion",
        "dist",
    ),
    "rotation": ("r", "rvec", "rotation", "rotationmatrix", "rotationvector"),
    "translation": ("t", "tvec", "translation", "translationvector"),
}
_PLACED = ("rotation", "translation")


def read_calibration(path: Path) -> tuple[Camera, ...]:
    """Read the cameras of a calibration, in the order of the file.

    Raises
    ------
    InputError
        If the file is missing or too large, of neither form above, or a camera is none.
    """
    if path.is_file() and path.stat().st_size > _LARGEST:
        raise InputError(
            f"{path} is larger than any calibration of cameras; give the file of the cameras alone",
            "TOO_LARGE",
        )
    document = _document(path)
    if isinstance(document, list):
        document = {"cameras": document}
    if not isinstance(document, dict):
        raise InputError(f"{path}: expected cameras with their matrices", "SCHEMA_BROKEN")
    pair = [_numbered(document, n) for n in (1, 2)]
    if all(_find(each, "matrix") is not None for each in pair):
        still = {"r": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "t": [0, 0, 0]}
        plain = _plain(document)
        shared = {name: value for name, value in plain.items() if name.startswith("image")}
        if all(_find(plain, name) is not None for name in _PLACED):
            # Beside R and T, those with a number rectify the images.
            pair = [{k: v for k, v in each.items() if k not in ("r", "t")} for each in pair]
        entries = [("camera 1", shared | still | pair[0]), ("camera 2", shared | plain | pair[1])]
    else:
        entries = _entries(path, document)
    if len(entries) < 2:
        raise InputError(
            f"{path}: {len(entries)} cameras with a matrix; expected two or more: "
            "K1, D1, K2, D2, R, T, or a list of cameras with K, D, R, T each",
            "SCHEMA_BROKEN",
        )
    if len(entries) > _MOST_CAMERAS:
        raise InputError(
            f"{path}: more than {_MOST_CAMERAS} cameras; leave out those that filmed no marker",
            "TOO_LARGE",
        )
    return tuple(_camera(path, name, entry) for name, entry in entries)


def _document(path: Path) -> Any:
    if path.suffix.lower() == ".json":
        return read_json(path)
    if path.suffix.lower() in (".yml", ".yaml"):
        return read_yaml(path)
    if path.suffix.lower() == ".toml":
        try:
            return tomllib.loads(read_text(path))
        except (ValueError, RecursionError) as error:
            raise InputError(
                f"{path} is no TOML: {error}; is it cut off, or in another format?", "SCHEMA_BROKEN"
            ) from error
    raise InputError(
        f"{path}: calibrations of kind {path.suffix!r} are not read; expected .yml, .json or .toml",
        "FILE_KIND_UNKNOWN",
    )


def _plain(entry: Mapping[str, Any]) -> dict[str, Any]:
    """Return a map with its keys in lower case, without separators between words."""
    return {re.sub(r"[\W_]", "", str(key)).lower(): value for key, value in entry.items()}


def _numbered(document: Mapping[str, Any], camera: int) -> dict[str, Any]:
    """Return the entries whose keys end in a number, without it."""
    ends = str(camera)
    return {k.removesuffix(ends): v for k, v in _plain(document).items() if k.endswith(ends)}


def _entries(path: Path, document: Mapping[str, Any]) -> list[tuple[str, dict[str, Any]]]:
    """Return the cameras of a list or a map; other entries may stand beside those of a map."""
    cameras = _plain(document).get("cameras", document)
    if isinstance(cameras, list):
        named = [(f"camera {n}", each) for n, each in enumerate(cameras, 1)]
    else:
        named = list(cameras.items()) if isinstance(cameras, dict) else []
    found = [(str(name), _plain(each)) for name, each in named if isinstance(each, dict)]
    bare = [name for name, each in found if _find(each, "matrix") is None]
    if bare and isinstance(cameras, list):  # those after it would take its place
        raise InputError(
            f"{path}: {bare[0]} of the list has no matrix of 9 numbers; "
            "give it one, or remove it with its take",
            "SCHEMA_BROKEN",
        )
    return [
        (str(each.get("name") or name)[:40], each)
        for name, each in found
        if _find(each, "matrix") is not None
    ]


def _find(entry: Mapping[str, Any], field: str) -> FloatArray | None:
    """Return the numbers of a field, flat; None if it is not there or not of numbers."""
    value = next((entry[name] for name in _NAMES[field] if name in entry), None)
    if isinstance(value, dict):
        value = value.get("data")
    if not isinstance(value, list):
        return None
    flat = [each for row in value[:64] for each in (row if isinstance(row, list) else [row])][:64]
    numbers = np.array([number(each) for each in flat])
    return numbers if field != "matrix" or numbers.size == 9 else None


def _camera(path: Path, name: str, entry: Mapping[str, Any]) -> Camera:
    if (
        str(entry.get("fisheye")).lower() == "true"
        or str(entry.get("distortionmodel", "")) in _OTHER_LENSES
    ):
        raise InputError(
            f"{path}: {name!r} is a fisheye camera, which is not read; "
            "calibrate it as a pinhole camera with distortion",
            "SCHEMA_BROKEN",
        )
    given = {field: _find(entry, field) for field in _NAMES}
    missing = [field for field in ("matrix", "rotation", "translation") if given[field] is None]
    if missing:
        raise InputError(
            f"{path}: {name!r} has no {missing[0]}; expected matrix, rotation and translation",
            "SCHEMA_BROKEN",
        )
    written = any(entry.get(key) is not None for key in _NAMES["distortion"])
    if given["distortion"] is None and written:
        raise InputError(
            f"{path}: the distortion of {name!r} is no list of numbers; expected up to "
            f"{len(COEFFICIENTS)}: {' '.join(COEFFICIENTS)}",
            "SCHEMA_BROKEN",
        )
    distortion = given["distortion"] if given["distortion"] is not None else np.zeros(0)
    tail = distortion[len(COEFFICIENTS) :]
    if np.any(tail != 0):
        raise InputError(
            f"{path}: {name!r} has {len(distortion)} coefficients of distortion; "
            f"expected up to {len(COEFFICIENTS)}: {' '.join(COEFFICIENTS)}",
            "SCHEMA_BROKEN",
        )
    coefficients = np.zeros(len(COEFFICIENTS))
    coefficients[: min(len(distortion), len(COEFFICIENTS))] = distortion[: len(COEFFICIENTS)]
    matrix, rotation, translation = (given[f] for f in ("matrix", "rotation", "translation"))
    assert matrix is not None and rotation is not None and translation is not None
    with errors_at(path):
        return Camera(
            matrix=matrix.reshape(3, 3),
            distortion=coefficients,
            rotation=_rotation(name, rotation),
            translation=translation,
            image_size=_image_size(entry),
            name=name,
        )


_OTHER_LENSES = ("equidistant", "fisheye", "omnidirectional")
_LARGEST_SKEW = 1e-2  # of a rotation that was written with three digits


def _rotation(name: str, numbers: FloatArray) -> FloatArray:
    """Return the rotation nearest to a matrix, or that of a rotation vector."""
    if not np.isfinite(numbers).all() or np.abs(numbers).max(initial=0.0) > 1e3:
        raise InputError(
            f"the rotation matrix of camera {name!r} is no rotation; "
            "expected 9 numbers of a rotation, or 3 of a rotation vector",
            "VALUES_WRONG",
        )
    if numbers.size == 3:
        from scipy.spatial.transform import Rotation  # costs more to import than most takes need

        return np.asarray(Rotation.from_rotvec(numbers.copy()).as_matrix())
    if numbers.size != 9:
        raise InputError(
            f"the rotation of camera {name!r} has {numbers.size} numbers; expected 3 or 9",
            "VALUES_WRONG",
        )
    matrix = numbers.reshape(3, 3)
    left, _, right = np.linalg.svd(matrix)
    nearest = left @ right
    if np.abs(nearest - matrix).max() > _LARGEST_SKEW or np.linalg.det(nearest) < 0:
        raise InputError(
            f"the rotation matrix of camera {name!r} is no rotation; "
            "expected orthogonal rows and a determinant of 1",
            "VALUES_WRONG",
        )
    return np.asarray(nearest)


def _image_size(entry: Mapping[str, Any]) -> tuple[int, int] | None:
    listed = next((entry[n] for n in ("imagesize", "size", "resolution") if n in entry), None)
    if not (isinstance(listed, list) and len(listed) == 2):
        listed = [entry.get(f"image{side}", entry.get(side)) for side in ("width", "height")]
    width, height = (number(side) for side in listed)
    if not (1 <= width < 1 << 20 and 1 <= height < 1 << 20):
        return None
    return round(width), round(height)
