"""Make the table of face motion: `python benchmarks/face_motion.py`.

Measures what four rigs do for each action unit, at the places of the two layouts of markers of
`tests/faces.py`, and writes `usdface/face/face_motion.json`; `--compare` prints how like the rigs
move instead. Reads `../shared/data`.
"""

import argparse
import json
import sys
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
SHARED = ROOT.parent / "shared" / "data"
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]
from faces import Face, make_face  # noqa: E402
from makehuman_face import posable_face  # noqa: E402

from usdface.arrays import FloatArray  # noqa: E402
from usdface.face.expression_poses import composed_pose  # noqa: E402
from usdface.face.face_coordinates import coordinates_on  # noqa: E402
from usdface.face.face_motion import face_motion  # noqa: E402
from usdface.face.facs_names import UNITS  # noqa: E402

OUTPUT = ROOT / "usdface" / "face" / "face_motion.json"
LAYOUTS = ("68", "41")
RIGS = {"ICT": "ict", "MakeHuman targets": "makehuman", "example": "example"}
JOINTS = "MakeHuman joints"
# Gaze, but for eyes that look down: upper lids follow them.
LEFT_OUT = (61, 62, 63)
# MakeHuman's unit poses of each action unit.
POSES = {
    1: ("LeftInnerBrowUp", "RightInnerBrowUp"),
    2: ("LeftOuterBrowUp", "RightOuterBrowUp"),
    4: ("LeftBrowDown", "RightBrowDown"),
    5: ("LeftUpperLidOpen", "RightUpperLidOpen"),
    6: ("LeftCheekUp", "RightCheekUp"),
    7: ("LeftLowerLidUp", "RightLowerLidUp"),
    9: ("NoseWrinkler",),
    10: ("UpperLipUp",),
    11: ("NasolabialDeepener",),
    12: ("MouthLeftPullUp", "MouthRightPullUp"),
    14: ("MouthLeftPullSide", "MouthRightPullSide"),
    15: ("MouthLeftPullDown", "MouthRightPullDown"),
    16: ("lowerLipDown",),
    17: ("lowerLipUp",),
    18: ("LipsKiss",),
    20: ("MouthLeftPlatysma", "MouthRightPlatysma"),
    26: ("JawDrop",),
    27: ("JawDropStretched",),
    28: ("UpperLipBackward", "lowerLipBackward"),
    43: ("LeftUpperLidClosed", "RightUpperLidClosed"),
}
Measured = dict[str, FloatArray]


def shapes_of(face: Face) -> dict[int, Measured]:
    """Return the displacement of each marker by each action unit, by the face's unit."""
    names, found = face.mesh.shape_names, {}
    for unit in UNITS:
        pose = composed_pose({unit: 1.0}, names)
        if pose is not None and unit not in LEFT_OUT:
            found[unit] = _by_unit(face, face.bound.displacements(pose.pose(names)[None])[0])
    return found


def joints_of(face: Face) -> dict[int, Measured]:
    """Return the same of MakeHuman's joints."""
    body = posable_face(SHARED)
    at = face.setup.binding.points
    marked = replace(body, points=body.points[at], weights=body.weights[at])
    return {
        unit: _by_unit(face, marked.posed(dict.fromkeys(poses, 1.0)) - marked.points)
        for unit, poses in POSES.items()
    }


def _by_unit(face: Face, moved: FloatArray) -> Measured:
    places = coordinates_on(face.bound, face.bound.neutral)
    assert places is not None
    against = (moved - moved[face.bound.nose]) / places.unit
    return dict(zip(face.bound.markers, against, strict=True))


def table() -> dict[str, object]:
    """Measure all rigs at the places of ICT's markers, both halves averaged."""
    places: list[list[int]] = []
    slits: list[list[int]] = []
    rigs: dict[str, dict[int, list[list[int]]]] = {}
    for layout in LAYOUTS:
        faces = {name: make_face(kind + layout, SHARED) for name, kind in RIGS.items()}
        ict = faces["ICT"].bound
        on = coordinates_on(ict, ict.neutral)
        assert on is not None
        moved = {name: shapes_of(face) for name, face in faces.items()}
        moved[JOINTS] = joints_of(faces["MakeHuman targets"])
        shared = set(ict.markers).intersection(*(f.bound.markers for f in faces.values()))
        for i, marker in enumerate(ict.markers):
            x, y = on.places[i]
            mirrored = np.linalg.norm(on.places - [-x, y], axis=1)
            mirrored[(on.slits != on.slits[i]).any(axis=1)] = np.inf
            other = ict.markers[int(mirrored.argmin())]
            if x < -0.02 or mirrored.min() > 0.08 or not {marker, other} <= shared:
                continue
            places.append(_whole([max(x, 0.0), y]))
            slits.append(on.slits[i].tolist())
            for name, units in moved.items():
                for unit, at in units.items():
                    mean = 0.5 * (at[marker] + at[other] * [-1, 1, 1])
                    rigs.setdefault(name, {}).setdefault(unit, []).append(_whole(mean))
    return {"places": places, "slits": slits, "rigs": rigs}


def _whole(numbers: FloatArray | list[float]) -> list[int]:
    return [round(1000 * float(n)) for n in numbers]


def compare() -> None:
    """Print how like the motion of each two rigs is: cosines, the median of their units."""
    rigs = face_motion().rigs
    for one, other in combinations(rigs, 2):
        units = [u for u in rigs[one] if u in rigs[other]]
        cosines = {u: _cosine(rigs[one][u], rigs[other][u]) for u in units}
        listed = ", ".join(f"{u} {c:.2f}" for u, c in cosines.items())
        print(f"{one}, {other}: {np.median(list(cosines.values())):.2f} ({listed})")


def _cosine(a: FloatArray, b: FloatArray) -> float:
    return float((a * b).sum() / max(np.linalg.norm(a) * np.linalg.norm(b), 1e-12))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--compare", action="store_true")
    if parser.parse_args().compare:
        compare()
        return
    OUTPUT.write_text(json.dumps(table(), separators=(",", ":")) + "\n", encoding="utf-8")
    print(f"{OUTPUT}: {OUTPUT.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
