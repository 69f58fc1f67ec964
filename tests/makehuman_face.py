"""MakeHuman's face posed by its joints: unit poses (BVH) blended to expressions (.mhpose).

As MakeHuman does it: the rotations of a blend are multiplied, each slerped from rest by its
weight, and the mesh follows its joints by linear blend skinning.
"""

import json
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from ict_face import ict_mesh, landmarks
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from usdface.io.rigs.makehuman import read_makehuman
from usdface.io.rigs.obj import read_obj

__all__ = ["Posable", "landmarks_on", "posable_face", "published_expressions"]

_METERS_PER_UNIT = 0.1
# The BVH has z up, the mesh y.
_TO_Y_UP = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])


@dataclass(frozen=True, eq=False)
class Posable:
    """A mesh that joints move.

    `names` (J), `parents` (J,) and places `heads` (J, 3) [m] of the joints, parents first;
    `points` (V, 3) [m], their skin `weights` (V, J), and the rotation vectors (J, 3) of each
    unit pose.
    """

    names: tuple[str, ...]
    parents: np.ndarray
    heads: np.ndarray
    points: np.ndarray
    weights: np.ndarray
    units: dict[str, np.ndarray]

    def posed(self, blend: dict[str, float]) -> np.ndarray:
        """Return the points under weighted unit poses: (V, 3) [m]."""
        turns = Rotation.identity(len(self.names))
        for unit, weight in blend.items():
            turns = Rotation.from_rotvec(weight * self.units[unit]) * turns
        local = turns.as_matrix()
        world, heads = local.copy(), self.heads.copy()
        for joint, parent in enumerate(self.parents):
            if parent >= 0:
                world[joint] = world[parent] @ local[joint]
                heads[joint] = heads[parent] + world[parent] @ (
                    self.heads[joint] - self.heads[parent]
                )
        moved = np.flatnonzero(self.weights.any(axis=0))
        result = np.zeros_like(self.points)
        for joint in moved:
            placed = (self.points - self.heads[joint]) @ world[joint].T + heads[joint]
            result += self.weights[:, [joint]] * placed
        return result


def published_expressions(shared: Path) -> dict[str, dict[str, float]]:
    """Return each published expression as weights of unit poses, by the name of its file."""
    folder = shared / "makehuman_cc0" / "expressions"
    return {
        path.stem: json.loads(path.read_text(encoding="utf-8"))["unit_poses"]
        for path in sorted(folder.glob("*.mhpose"))
    }


def posable_face(shared: Path) -> Posable:
    """Read base mesh, skeleton, skin weights and unit poses; points are those of the rig."""
    folder = shared / "makehuman_cc0"
    points = read_obj(folder / "base.obj").points * _METERS_PER_UNIT
    skeleton = json.loads((folder / "default.mhskel").read_text(encoding="utf-8"))
    bones = skeleton["bones"]
    names: list[str] = []
    while len(names) < len(bones):
        names += [n for n, b in bones.items() if n not in names and b["parent"] in (None, *names)]
    index = {name: i for i, name in enumerate(names)}
    parents = np.array([index.get(bones[name]["parent"], -1) for name in names])
    heads = np.array(
        [points[skeleton["joints"][bones[name]["head"]]].mean(axis=0) for name in names]
    )
    skin = json.loads((folder / "default_weights.mhw").read_text(encoding="utf-8"))["weights"]
    weights = np.zeros((len(points), len(names)))
    for bone, pairs in skin.items():
        vertices, values = np.array(pairs).T
        weights[vertices.astype(int), index[bone]] = values
    total = weights.sum(axis=1, keepdims=True)
    weights[:, [index["root"]]] += total == 0
    weights /= np.where(total == 0, 1.0, total)
    body = read_makehuman(folder)[0].face().points
    kept = cKDTree(points).query(body)[1]
    return Posable(
        tuple(names),
        parents,
        heads,
        body,
        weights[kept],
        _units(folder, index),
    )


def _units(folder: Path, index: dict[str, int]) -> dict[str, np.ndarray]:
    """Return the rotation vectors (J, 3), y up, of each unit pose relative to rest."""
    text = (folder / "face-poseunits.bvh").read_text(encoding="utf-8")
    hierarchy, motion = text.split("MOTION")
    table = np.array([line.split() for line in motion.strip().splitlines()[2:]], dtype=float)
    turns = np.zeros((len(table), len(index), 3))
    column = 0
    joints = re.findall(r"(?:ROOT|JOINT)\s+(\S+)|CHANNELS\s+(\d)(.*)", hierarchy)
    name = ""
    for joint, count, channels in joints:
        name = joint or name
        if not count:
            continue
        kinds = channels.split()
        rotations = [column + i for i, kind in enumerate(kinds) if kind.endswith("rotation")]
        order = "".join(kind[0] for kind in kinds if kind.endswith("rotation"))
        column += int(count)
        if name in index:
            angles = Rotation.from_euler(order, table[:, rotations], degrees=True)
            turns[:, index[name]] = angles.as_rotvec() @ _TO_Y_UP.T
    mapping = json.loads((folder / "face-poseunits.json").read_text(encoding="utf-8"))
    return dict(zip(mapping["framemapping"], turns, strict=True))


def landmarks_on(face: Posable, shared: Path, vertices: np.ndarray) -> np.ndarray:
    """Return the vertices where markers of the ICT face sit on this one: (M,) int64.

    An affine map through eyes, nose tip, corners of the mouth and chin, then the nearest vertex
    of the skin.
    """
    ict, marks = ict_mesh(shared).points, landmarks(shared)
    eyes = [ict[marks[36:42]].mean(axis=0), ict[marks[42:48]].mean(axis=0)]
    source = np.array([*eyes, *ict[marks[[30, 48, 54, 8]]]])
    places = face.points
    head = dict(zip(face.names, face.heads, strict=True))
    middle = np.flatnonzero(np.abs(places[:, 0]) < 0.002)
    nose = face.points[middle[np.argmax(face.points[middle, 2])]]
    lids = [head[f"eye.{side}"] + [0.0, 0.0, 0.03] for side in "RL"]
    corners = [_most_moved(face, f"Mouth{side}PullUp") for side in ("Right", "Left")]
    target = np.array([*lids, nose, *corners, _most_moved(face, "JawDrop")])
    affine = np.linalg.lstsq(np.c_[source, np.ones(len(source))], target, rcond=None)[0]
    wanted = np.c_[ict[vertices], np.ones(len(vertices))] @ affine
    return np.asarray(cKDTree(places).query(wanted)[1])


def _most_moved(face: Posable, unit: str) -> np.ndarray:
    moved = np.linalg.norm(face.posed({unit: 1.0}) - face.points, axis=1)
    return face.points[moved.argmax()]
