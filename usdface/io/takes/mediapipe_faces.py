"""The faces in a frame of MediaPipe's landmarks, however they are nested, and the one that is read.

A frame lists its faces in any order, and another one in the next frame.
"""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from usdface.arrays import FloatArray
from usdface.findings import Finding
from usdface.io.takes.json_text import number
from usdface.io.takes.several_faces import faces_left_out, follow_faces

__all__ = ["LANDMARKS", "Face", "faces_of", "main_faces", "place_of"]

LANDMARKS = ("landmarks", "face_landmarks", "faceLandmarks", "multi_face_landmarks", "landmark")
Face = list[Any]  # landmarks of a face
_DEEPEST = 4  # an object, of a list of faces, of objects, of landmarks


def faces_of(frame: Any, deepest: int = _DEEPEST) -> list[Face]:
    """Return the landmarks of each face in a frame."""
    if isinstance(frame, dict):
        frame = next((frame[key] for key in LANDMARKS if key in frame), None)
    if not isinstance(frame, list) or not frame or not deepest:
        return []
    if _is_landmark(frame[0]):
        return [frame]
    return [face for each in frame for face in faces_of(each, deepest - 1)]


def main_faces(path: Path, frames: Sequence[Any]) -> tuple[list[Face], list[Finding]]:
    """Return the face that is seen in most frames, in each frame; empty where it is not seen."""
    faces = [faces_of(frame) for frame in frames]
    if max(map(len, faces), default=0) < 2:
        return [own[0] if own else [] for own in faces], []
    places = [[_centre(face) for face in own] for own in faces]
    people = follow_faces(places)
    counts = dict(sorted(Counter(person for own in people for person in own).items()))
    main = max(counts, key=counts.__getitem__)
    names = {person: _name(person, people, places) for person in counts}
    named = {names[person]: count for person, count in counts.items()}
    chosen = [
        own[who.index(main)] if main in who else [] for own, who in zip(faces, people, strict=True)
    ]
    return chosen, [faces_left_out(path, names[main], named)]


def place_of(landmark: Any) -> tuple[float, float]:
    """Return x and y of a landmark, in parts of the image; NaN = none."""
    if isinstance(landmark, dict):
        return number(landmark.get("x")), number(landmark.get("y"))
    if isinstance(landmark, list) and len(landmark) > 1:
        return number(landmark[0]), number(landmark[1])
    return np.nan, np.nan


def _is_landmark(value: Any) -> bool:
    if isinstance(value, dict):
        return "x" in value and "y" in value
    return (
        isinstance(value, list) and len(value) in (2, 3) and not isinstance(value[0], list | dict)
    )


def _centre(face: Face) -> FloatArray:
    places = np.array([place_of(landmark) for landmark in face])
    centre: FloatArray = np.nan_to_num(places).mean(axis=0)
    return centre


def _name(person: int, people: Sequence[list[int]], places: Sequence[Sequence[FloatArray]]) -> str:
    """Name a person by number and the place at which it is first seen, in parts of the image."""
    at = next(n for n, own in enumerate(people) if person in own)
    x, y = places[at][people[at].index(person)]
    return f"face {person} (first at {x:.2f}, {y:.2f} of frame {at})"
