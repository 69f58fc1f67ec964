"""Small worlds with a known answer: a face, markers on it, and a performance of known weights.

The performer is the character, so that a map between the two is the identity; the head moves,
the first `NEUTRAL` frames are neutral, markers carry no noise. Everything in metres, Y up.
"""

import json
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from pxr import Gf, Usd, UsdGeom, UsdSkel, Vt

from usdface.arrays import FloatArray, frozen
from usdface.io.usd.rig_write import write_rig
from usdface.io.usd.take_write import write_take
from usdface.rigs import BlendShape, Mesh, Rig
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake, WeightsTake

__all__ = [
    "NEUTRAL",
    "World",
    "animation_of",
    "camera_pixels",
    "make_world",
    "restaged",
    "world_weights",
    "write_live_link",
]

NEUTRAL = 4
FRAMES = 40
_COLUMNS, _ROWS = 13, 15

# Where a shape is centred on the face (u to the face's left, v up, both -1 to 1), how wide it
# is, and where it moves its centre [m].
_SHAPES = {
    "jawOpen": ((0.0, -0.75), 0.4, (0.0, -0.02, -0.004)),
    "mouthSmileLeft": ((0.35, -0.45), 0.25, (0.006, 0.010, -0.003)),
    "mouthSmileRight": ((-0.35, -0.45), 0.25, (-0.006, 0.010, -0.003)),
    "mouthFrownLeft": ((0.35, -0.45), 0.2, (0.001, -0.009, -0.001)),
    "mouthFrownRight": ((-0.35, -0.45), 0.2, (-0.001, -0.009, -0.001)),
    "browDownLeft": ((0.3, 0.45), 0.25, (-0.003, -0.008, 0.001)),
    "browDownRight": ((-0.3, 0.45), 0.25, (0.003, -0.008, 0.001)),
    "browInnerUp": ((0.0, 0.45), 0.25, (0.0, 0.009, 0.001)),
    "browOuterUpLeft": ((0.6, 0.45), 0.25, (0.001, 0.008, 0.0)),
    "browOuterUpRight": ((-0.6, 0.45), 0.25, (-0.001, 0.008, 0.0)),
    "eyeBlinkLeft": ((0.4, 0.2), 0.15, (0.0, -0.007, 0.001)),
    "eyeBlinkRight": ((-0.4, 0.2), 0.15, (0.0, -0.007, 0.001)),
}
_MARKERS = {
    "nose": (0.0, -0.1),
    "bridge": (0.0, 0.25),
    "forehead": (0.0, 0.85),
    "brow": (0.0, 0.45),
    "lip_upper": (0.0, -0.35),
    "lip_lower": (0.0, -0.55),
    "chin": (0.0, -0.8),
} | {
    f"{name}_{side}": (sign * u, v)
    for side, sign in (("l", 1), ("r", -1))
    for name, (u, v) in {
        "temple": (0.85, 0.3),
        "brow_in": (0.2, 0.45),
        "brow_mid": (0.4, 0.45),
        "brow_out": (0.65, 0.45),
        "lid": (0.4, 0.15),
        "cheek": (0.5, -0.2),
        "corner": (0.35, -0.45),
        "jaw": (0.5, -0.75),
    }.items()
}


@dataclass(frozen=True, eq=False)
class World:
    """A rig, markers on it, the true weights (F, S), and the take they give."""

    rig: Rig
    points: dict[str, int]
    weights: FloatArray
    take: MarkerTake

    @property
    def bind(self) -> dict[str, object]:
        """The binding, as the JSON file holds it."""
        return {
            "markers": {name: {"point": point} for name, point in self.points.items()},
            "nose_tip": "nose",
            "neutral": {"start": 0, "end": NEUTRAL - 1},
        }

    def setup(self, **changes: object) -> RetargetSetup:
        """Return a setup that binds all markers."""
        points = np.array(list(self.points.values()))
        return RetargetSetup(Binding(tuple(self.points), points), **changes)  # type: ignore[arg-type]

    def write(self, folder: Path, **bind: object) -> Path:
        """Write rig.usda, take.usda and bind.json; return the folder."""
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "rig.usda").write_bytes(_rig_file(self.rig))
        write_take(self.take, folder / "take.usda")
        (folder / "bind.json").write_text(json.dumps(self.bind | bind))
        return folder


def _grid() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return u, v (V, 2), the points (V, 3) and the quads (P, 4) of a face."""
    v, u = np.meshgrid(np.linspace(-1, 1, _ROWS), np.linspace(-1, 1, _COLUMNS), indexing="ij")
    nose = np.exp(-((u / 0.15) ** 2 + ((v + 0.1) / 0.2) ** 2))
    depth = 0.09 * (1 - 0.6 * u**2 - 0.3 * v**2) + 0.025 * nose
    points = np.stack([0.075 * u * np.sqrt(1 - 0.35 * v**2), 0.11 * v, depth], -1)
    first = (np.arange(_ROWS - 1)[:, None] * _COLUMNS + np.arange(_COLUMNS - 1)).ravel()
    quads = np.stack([first, first + 1, first + _COLUMNS + 1, first + _COLUMNS], 1)
    return np.stack([u, v], -1).reshape(-1, 2), points.reshape(-1, 3), quads


def _face() -> tuple[Mesh, FloatArray]:
    places, points, quads = _grid()
    shapes = []
    for name, (centre, width, move) in _SHAPES.items():
        near = np.exp(-(((places - centre) / width) ** 2).sum(axis=1))
        offsets = near[:, None] * np.array(move)
        shapes.append(BlendShape.from_dense(name, offsets, tolerance=1e-5))
    mesh = Mesh("head", points, np.full(len(quads), 4), quads.ravel(), shapes=tuple(shapes))
    return mesh, places


def world_weights(frames: int = FRAMES) -> FloatArray:
    """Return weights (F, 12): neutral, a smile, surprise, then each shape on its own beat."""
    time = np.linspace(0, 1, frames - NEUTRAL)

    def bump(centre: float, width: float) -> FloatArray:
        return np.exp(-(((time - centre) / width) ** 2)) * np.minimum(1, 20 * time)

    names = list(_SHAPES)
    weights = np.zeros((frames, len(names)))
    for k, name in enumerate(names):
        curve = 0.5 * bump(0.6 + 0.4 * k / len(names), 0.08)
        if name.startswith("mouthSmile"):
            curve += 0.8 * bump(0.2, 0.1)
        if name.startswith(("browInner", "browOuter", "jaw")):
            curve += 0.7 * bump(0.45, 0.1)
        weights[NEUTRAL:, k] = np.clip(curve, 0, 1)
    return weights


def _moved(positions: FloatArray) -> FloatArray:
    """Nod and turn by a few degrees, sway by a centimetre; still while neutral."""
    phase = np.linspace(0, 2 * np.pi, len(positions) - NEUTRAL)
    angle = np.concatenate([np.zeros(NEUTRAL), np.radians(4) * np.sin(phase)])
    sway = np.concatenate([np.zeros(NEUTRAL), 0.01 * np.sin(phase)])
    turn = np.zeros((len(positions), 3, 3))
    turn[:, 0, 0] = turn[:, 2, 2] = np.cos(angle)
    turn[:, 0, 2], turn[:, 2, 0] = np.sin(angle), -np.sin(angle)
    turn[:, 1, 1] = 1.0
    return np.einsum("fij,fmj->fmi", turn, positions) + sway[:, None, None] * [1.0, 0.5, -0.3]


@lru_cache(maxsize=8)
def _rig_file(rig: Rig) -> bytes:
    """The bytes of a rig's file: the same for each test of a world."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "rig.usda"
        write_rig(rig, path)
        return path.read_bytes()


@cache
def make_world(*, rate: float = 30.0, teeth: bool = False, head_moves: bool = True) -> World:
    """Make the world; `teeth` adds a second mesh that shares jawOpen and has a shape of its own."""
    mesh, places = _face()
    points = {
        name: int(np.argmin(((places - place) ** 2).sum(axis=1)))
        for name, place in _MARKERS.items()
    }
    weights = frozen(world_weights())
    at = np.array(list(points.values()))
    moves = mesh.offsets_at(at)
    positions = mesh.points[at] + np.einsum("fs,smd->fmd", weights, moves)
    take = MarkerTake(
        tuple(points),
        np.arange(len(weights)) / rate,
        _moved(positions) if head_moves else positions,
        rate,
        source="take.trc",
    )
    return World(Rig("face", (mesh, _teeth()) if teeth else (mesh,)), points, weights, take)


def _teeth() -> Mesh:
    points = np.array([[-0.02, -0.06, 0.05], [0.02, -0.06, 0.05], [0.0, -0.07, 0.05]])
    jaw = BlendShape("jawOpen", np.arange(3), np.tile([0.0, -0.02, 0.0], (3, 1)))
    own = BlendShape("teethShow", np.array([2]), np.array([[0.0, 0.0, 0.01]]))
    return Mesh("teeth", points, np.array([3]), np.array([0, 1, 2]), shapes=(jaw, own))


def restaged(path: Path, meters_per_unit: float, up_axis: str) -> None:
    """Write a rig of metres, Y up, anew as the same face in other units and another up axis."""
    stage = Usd.Stage.Open(str(path))
    turn = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]]) if up_axis == "Z" else np.eye(3)
    space = np.eye(4)
    space[:3, :3] = turn / meters_per_unit
    for prim in stage.Traverse():
        for attribute in prim.GetAuthoredAttributes():
            name, value = attribute.GetName(), attribute.Get()
            if name in ("points", "offsets", "normals", "normalOffsets"):
                unit = 1.0 if name.startswith("normal") else 1.0 / meters_per_unit
                moved = (np.array(value) @ turn * unit).astype(np.float32)
                attribute.Set(Vt.Vec3fArray.FromNumpy(moved))
            elif name in ("bindTransforms", "restTransforms"):
                own = np.linalg.inv(space) @ np.array(value) @ space
                attribute.Set(Vt.Matrix4dArray.FromNumpy(own))
            elif name == "translations":
                attribute.Set(Vt.Vec3fArray.FromNumpy((value @ space[:3, :3]).astype(np.float32)))
            elif name == "rotations":  # of another axis by the same angle
                turned = [Gf.Vec3d(*(np.array(q.imaginary) @ turn)) for q in value]
                pairs = zip(value, turned, strict=True)
                attribute.Set(Vt.QuatfArray([Gf.Quatf(q.real, Gf.Vec3f(v)) for q, v in pairs]))
            elif name == "extent":
                attribute.Clear()
    UsdGeom.SetStageMetersPerUnit(stage, meters_per_unit)
    UsdGeom.SetStageUpAxis(stage, up_axis)
    stage.Save()


def camera_pixels(take: MarkerTake) -> MarkerTake:
    """Return a take as a camera far in front of the face sees it: pixels, x right, y up."""
    pixels = 4000 * take.positions[..., :2] + [640, -480]
    return MarkerTake(take.names, take.times, pixels, take.rate, image_size=(1280, 960))


def filmed(take: MarkerTake, *, focal_length: float = 1300.0) -> MarkerTake:
    """Return a take as a camera half a metre before the face sees it."""
    deep = 0.5 - take.positions[..., 2:]
    pixels = focal_length * take.positions[..., :2] / deep + [640, -480]
    return MarkerTake(take.names, take.times, pixels, take.rate, image_size=(1280, 960))


def write_live_link(world: World, path: Path) -> None:
    """Write the true weights as a phone records them: 60 frames to the timecode's second."""
    names = [name[0].upper() + name[1:] for name in world.rig.shape_names]
    lines = [",".join(["Timecode", "BlendShapeCount", *names, "HeadYaw"])]
    for time, row in zip(world.take.times, world.weights, strict=True):
        second, frame = divmod(time * 60, 60)
        stamp = f"10:20:{int(second):02d}:{frame:06.3f}"
        lines.append(",".join([stamp, str(len(row)), *(f"{w:.9f}" for w in row), "0.1"]))
    path.write_text("\n".join(lines) + "\n")


def animation_of(source: Path | Usd.Stage, *, muted: str = "") -> WeightsTake:
    """Return what UsdSkel plays on the first skeleton; the times are time codes.

    `muted` is the name of a layer file to mute first, with those of the result that lie over it.
    """
    stage = Usd.Stage.Open(str(source)) if isinstance(source, Path) else source
    ours = ("solve.usdc", "express.usdc", "closure.usdc")
    over = ours[ours.index(muted) :] if muted in ours else (muted,)
    for layer in stage.GetUsedLayers():
        if muted and layer.realPath.endswith(over):
            stage.MuteLayer(layer.identifier)
    skeleton = next(p for p in stage.Traverse() if p.IsA(UsdSkel.Skeleton))
    query = UsdSkel.Cache().GetSkelQuery(UsdSkel.Skeleton(skeleton)).GetAnimQuery()
    codes = query.GetBlendShapeWeightTimeSamples()
    rows = [query.ComputeBlendShapeWeights(code) for code in codes]
    return WeightsTake(tuple(query.GetBlendShapeOrder()), np.array(codes), np.array(rows))
