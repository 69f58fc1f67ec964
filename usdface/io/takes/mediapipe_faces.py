"""The faces in a frame of MediaPipe's landmarks, however they are nested, and the one that is read.

A frame lists its faces in any order, and another one in the next frame.
"""

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
_FARTHEST = 1e6  # parts of the image; more is no place that counts
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
    """Return the face that is seen in most frames, in each frame; empty where it is not seen.

    One that is never seen beside it is taken for the same person, who came back elsewhere.
    """
    faces = [[face for face in faces_of(frame) if len(_places(face))] for frame in frames]
    if max(map(len, faces), default=0) < 2:
        return [own[0] if own else [] for own in faces], []
    places = [[_places(face) for face in own] for own in faces]
    centres = [[each.mean(axis=0) for each in own] for own in places]
    people = follow_faces(centres, [[_size(each) for each in own] for own in places])
    seen: dict[int, set[int]] = {}
    for frame, own in enumerate(people):
        for person in own:
            seen.setdefault(person, set()).add(frame)
    mine: dict[int, int] = {}  # frame -> person
    for person in sorted(seen, key=lambda each: -len(seen[each])):
        if not seen[person] & mine.keys():
            mine |= dict.fromkeys(seen[person], person)
    main, same = mine[min(mine)], set(mine.values())
    names = {
        person: _name(person, centres[min(at)][people[min(at)].index(person)], min(at))
        for person, at in seen.items()
        if person == main or person not in same
    }
    counts = {name: len(mine if person == main else seen[person]) for person, name in names.items()}
    chosen = [faces[n][people[n].index(mine[n])] if n in mine else [] for n in range(len(frames))]
    return chosen, [faces_left_out(path, names[main], counts)]


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


def _places(face: Face) -> FloatArray:
    """Return the places (N, 2) of the landmarks that have one."""
    places = np.array([place_of(landmark) for landmark in face])
    seen: FloatArray = places[np.isfinite(places).all(axis=1)].clip(-_FARTHEST, _FARTHEST)
    return seen


def _size(places: FloatArray) -> float:
    """Return the longer side of the box around places; that of the image of one place."""
    return float(np.ptp(places, axis=0).max()) or 1.0


def _name(person: int, place: FloatArray, frame: int) -> str:
    """Name a person by number and the place at which it is first seen, in parts of the image."""
    return f"face {person} (first at {place[0]:.2f}, {place[1]:.2f} of frame {frame})"
