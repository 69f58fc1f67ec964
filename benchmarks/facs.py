"""Verdicts of `usdface check --facs` on rigs with faults of known kinds.

On ICT, MakeHuman and the example: two names exchanged, one shape mirrored and one silenced, drawn
at random; a shape with another one added; and without a fault ICT's shapes on other people's
faces, and MakeHuman's unit poses by joints. `python benchmarks/facs.py`.
"""

import argparse
import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "tests")]

from ict_face import ict_mesh  # noqa: E402
from makehuman_face import posable_face  # noqa: E402
from scipy.spatial import cKDTree  # noqa: E402

from usdface.blend_shapes.blend_shape import BlendShape  # noqa: E402
from usdface.facs.judge import ShapeVerdict, judge_shapes  # noqa: E402
from usdface.facs.movements import SIDED  # noqa: E402
from usdface.facs.report import judge_rig  # noqa: E402
from usdface.facs.shape_claims import claims_of  # noqa: E402
from usdface.io.rigs.files import read_rig_file  # noqa: E402
from usdface.rigs import Rig  # noqa: E402

SHARED = ROOT.parent / "shared" / "data"
NOISE = 0.3  # [mm]
COUNT, SEED = 400, 8
# MakeHuman's unit poses, and names of ARKit or FACS for the same.
JOINT_POSES = {
    **{"NoseWrinkler": "noseSneer", "CheeksPump": "cheekPuff", "ChinLeft": "jawLeft"},
    **{"ChinRight": "jawRight", "ChinForward": "jawForward", "JawDrop": "jawOpen"},
    **{"LipsKiss": "mouthPucker", "lowerLipBackward": "mouthRollLower", "lowerLipDown": "AU16"},
    **{"UpperLipBackward": "mouthRollUpper", "UpperLipUp": "AU10"},
    **{"MouthMoveLeft": "mouthLeft", "MouthMoveRight": "mouthRight"},
} | {
    pose.format(side): name.format(side[0])
    for side in ("Left", "Right")
    for pose, name in {
        **{"{}BrowDown": "AU4_{}", "{}OuterBrowUp": "AU2_{}", "{}InnerBrowUp": "AU1_{}"},
        **{"{}UpperLidOpen": "AU5_{}", "{}UpperLidClosed": "AU43_{}", "{}LowerLidUp": "AU7_{}"},
        **{"{}CheekUp": "AU6_{}", "Mouth{}PullUp": "AU12_{}", "Mouth{}PullSide": "AU14_{}"},
        **{"Mouth{}PullDown": "AU15_{}", "Mouth{}Platysma": "AU20_{}"},
        **{"{}EyeturnLeft": "AU61_{}", "{}EyeturnRight": "AU62_{}"},
        **{"{}EyeUp": "AU63_{}", "{}EyeDown": "AU64_{}"},
    }.items()
}
DIRECTIONS = {"30L", "30R", "mouth left", "mouth right"}


class Face:
    """Displacements of a rig's feature points, and its shapes with a unit."""

    def __init__(self, rig: Rig) -> None:
        self.rig, self.report = rig, judge_rig(rig, ())
        self.names = rig.shape_names
        self.moved = np.array(self.report.points.moved(rig, self.names))
        self.claims = claims_of(self.names)
        self.named = [i for i, name in enumerate(self.names) if name in self.claims]
        sided = [i for i in self.named if self.claims[self.names[i]][0].side]
        directed = [i for i in self.named if self.claims[self.names[i]][0].movement in DIRECTIONS]
        self.sided = sided + directed
        self.largest = np.array([v.largest_mm for v in self.report.shapes.verdicts])

    def wrong(self, moved: np.ndarray, largest: np.ndarray) -> dict[str, ShapeVerdict]:
        found = judge_shapes(self.names, moved, largest, NOISE).verdicts
        return {v.name: v for v in found if v.verdict not in ("done", "unnamed")}


def faces() -> dict[str, Face]:
    found = {"example": Face(read_rig_file(ROOT / "examples" / "head.usdc")[0])}
    if SHARED.is_dir():
        found["ICT"] = Face(Rig("ict", (ict_mesh(SHARED),)))
        found["MakeHuman"] = Face(read_rig_file(SHARED / "makehuman_cc0" / "targets")[0])
    return found


def faults(face: Face, count: int) -> dict[str, float]:
    """Shares of worlds whose faults are named, and nothing else; with their kinds."""
    random, named, exact = np.random.default_rng(SEED), 0, 0
    for _ in range(count):
        one, other, dead = draw(face, random)
        turned = random.choice([i for i in face.sided if i not in (one, other, dead)])
        moved, largest = face.moved.copy(), face.largest.copy()
        moved[[one, other]] = moved[[other, one]]
        moved[turned] = mirror(moved[turned])
        moved[dead], largest[dead] = 0.0, 0.0
        expected = {face.names[one]: "swapped", face.names[other]: "swapped"}
        expected |= {face.names[turned]: "other_side", face.names[dead]: "dead"}
        found = {name: v.verdict for name, v in face.wrong(moved, largest).items()}
        named += found.keys() == expected.keys()
        exact += found == expected
    return {"named %": 100 * named / count, "with their kind %": 100 * exact / count}


def draw(face: Face, random: np.random.Generator) -> tuple[int, int, int]:
    """Draw two shapes whose names claim different movements, and a third."""
    while True:
        one, other, dead = random.choice(face.named, 3, replace=False).tolist()
        if not set(face.claims[face.names[one]]) & set(face.claims[face.names[other]]):
            return one, other, dead


def mirror(moved: np.ndarray) -> np.ndarray:
    half = len(SIDED)
    swapped = np.concatenate([moved[half : 2 * half], moved[:half], moved[2 * half :]])
    return swapped * (-1, 1, 1)


def mixtures(face: Face, count: int) -> dict[str, float]:
    """Shares of shapes with another added that are named; and of others that are named wrongly.

    Pairs count where the added one goes at least half as far as the other.
    """
    random, found, wrong, tried = np.random.default_rng(SEED), 0, 0, 0
    while tried < count:
        one, other, _ = draw(face, random)
        sizes = np.linalg.norm(face.moved[[one, other]], axis=2).max(axis=1)
        if sizes[1] < 0.5 * sizes[0]:
            continue
        tried += 1
        moved = face.moved.copy()
        moved[one] += moved[other]
        names = face.wrong(moved, face.largest + NOISE)
        found += face.names[one] in names
        wrong += bool(names.keys() - {face.names[one]})
    return {"mixed named %": 100 * found / count, "others named %": 100 * wrong / count}


def other_people(face: Face, count: int) -> dict[str, float]:
    """Shapes named on other people's neutrals, of which none has a fault."""
    modes = np.load(SHARED / "ict_identities" / "identity_offsets.npz")
    random, named = np.random.default_rng(SEED), Counter[str]()
    mesh = face.rig.meshes[0]
    for _ in range(count):
        weights = random.normal(0.0, 1.5, len(modes.files))
        offsets = sum(w * 0.01 * modes[k] for w, k in zip(weights, modes.files, strict=True))
        rig = Rig("person", (replace(mesh, points=mesh.points + offsets),))
        for v in judge_rig(rig, ()).shapes.verdicts:
            named[v.name] += v.verdict not in ("done", "unnamed")
    total = count * len(face.named)
    return {"people": float(count), "named wrongly %": 100 * sum(named.values()) / total}


def joint_poses(face: Face) -> dict[str, float]:
    """MakeHuman's unit poses by joints as blend shapes: those that do the unit of their name.

    Nothing was set on them.
    """
    posable, mesh = posable_face(SHARED), face.rig.face()
    rest = posable.posed({})
    at = cKDTree(rest).query(mesh.points)[1]
    shapes = tuple(
        BlendShape.from_dense(name, (posable.posed({pose: 1.0}) - rest)[at], 1e-6)
        for pose, name in JOINT_POSES.items()
    )
    found = judge_rig(Rig("poses", (replace(mesh, shapes=shapes),)), ()).shapes.verdicts
    done = sum(v.verdict == "done" for v in found)
    return {"poses": float(len(found)), "done": float(done)}


def figures(count: int = 40) -> dict[str, float]:
    """Mean over the three rigs, for benchmarks/sensitivity.py."""
    known = faces().values()
    every = [faults(face, count) | mixtures(face, count) for face in known]
    means = {name: float(np.mean([one[name] for one in every])) for name in every[0]}
    alarms = [len(face.wrong(face.moved, face.largest)) for face in known]
    return means | {"false alarms": float(sum(alarms))}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=COUNT)
    parser.add_argument("--people", type=int, default=12)
    parsed = parser.parse_args()
    table, known, rows = Table(), faces(), {}
    for name, face in known.items():
        alarms = {"false alarms": float(len(face.wrong(face.moved, face.largest)))}
        rows[name] = alarms | faults(face, parsed.count) | mixtures(face, parsed.count)
    table.add_column("rig")
    for column in rows["example"]:
        table.add_column(column, justify="right")
    for name, row in rows.items():
        table.add_row(name, *(f"{value:.4g}" for value in row.values()))
    console = Console()
    console.print(table)
    if "ICT" in known:
        console.print("other people:", other_people(known["ICT"], parsed.people))
        console.print("unit poses by joints:", joint_poses(known["MakeHuman"]))


if __name__ == "__main__":
    main()
