"""A face of three slits: a mouth that rests closed and two eyes that rest open, known to the mm.

Each slit is a strip of skin that runs over the upper edge, in, and out over the lower edge. Two
strips of brow lie above. x is to the character's left, y up, z forward [m].
"""

from dataclasses import replace

import numpy as np

from usdface.arrays import FloatArray
from usdface.rigs import BlendShape, Combination, Inbetween, Mesh
from usdface.setup.expression import Expression

__all__ = ["EXPRESSIONS", "LID_GAP", "LIP_GAP", "bent_slit_face", "slit_face", "with_correctives"]

LIP_GAP, LID_GAP = 0.0008, 0.008
_COLUMNS = 9
_MM = 0.001


def _slit(centre: tuple[float, float], width: float, gap: float) -> tuple[FloatArray, FloatArray]:
    """Return points (V, 3) and quads (P, 4) of one slit, and its profile goes down in y."""
    half = gap / 2
    profile = np.array(
        [
            [0.015, 0.010],
            [half + 0.004, 0.012],
            [half, 0.010],
            [half, 0.004],
            [0.0, 0.0],
            [-half, 0.004],
            [-half, 0.010],
            [-half - 0.004, 0.012],
            [-0.015, 0.010],
        ]
    )
    x = np.linspace(-width / 2, width / 2, _COLUMNS)
    points = np.zeros((len(profile), _COLUMNS, 3))
    points[..., 0] = centre[0] + x
    points[..., 1] = centre[1] + profile[:, :1]
    points[..., 2] = profile[:, 1:]
    return points.reshape(-1, 3), _quads(len(profile))


def _quads(rows: int) -> np.ndarray:
    first = (np.arange(rows - 1)[:, None] * _COLUMNS + np.arange(_COLUMNS - 1)).ravel()
    return np.stack([first, first + _COLUMNS, first + _COLUMNS + 1, first + 1], axis=1)


def _brow(centre: float) -> tuple[FloatArray, FloatArray]:
    x, y = np.meshgrid(np.linspace(-0.02, 0.02, _COLUMNS), [0.105, 0.1, 0.095])
    return np.stack([centre + x, y, np.full(x.shape, 0.01)], axis=-1).reshape(-1, 3), _quads(3)


def slit_face() -> Mesh:
    """Return the mesh with its shapes."""
    made = [
        _slit((0.0, 0.0), 0.05, LIP_GAP),
        _slit((0.035, 0.07), 0.03, LID_GAP),
        _slit((-0.035, 0.07), 0.03, LID_GAP),
        _brow(0.035),
        _brow(-0.035),
    ]
    first = np.cumsum([0] + [len(points) for points, _ in made])
    points = np.concatenate([points for points, _ in made])
    quads = np.concatenate([quads + start for (_, quads), start in zip(made, first, strict=False)])
    slit = np.searchsorted(first, np.arange(len(points)), side="right") - 1
    x, y = points[:, 0], points[:, 1]
    mouth, below = slit == 0, y < 0
    shapes = {
        # Where, and by how much it moves [mm].
        "jawOpen": (mouth & below, (0, -20, -2)),
        "mouthPressLeft": (mouth & below & (x > -0.01), (0, 0.4, 0)),
        "mouthPressRight": (mouth & below & (x < 0.01), (0, 0.4, 0)),
        "mouthUpperUpLeft": (mouth & ~below & (x > -0.002), (0, 6, 0)),
        "mouthUpperUpRight": (mouth & ~below & (x < 0.002), (0, 6, 0)),
        "browInnerUp": (slit > 2, (0, 8, 0)),
        # Raises the corner, and the upper lip a little more.
        "mouthSmileLeft": (mouth & (x > 0.002), (5, 6, 0)),
        "mouthSmileRight": (mouth & (x < -0.002), (-5, 6, 0)),
        "mouthFrownLeft": (mouth & (x > 0.002), (0, -5, 0)),
        "mouthFrownRight": (mouth & (x < -0.002), (0, -5, 0)),
        "eyeBlinkLeft": ((slit == 1) & (y > 0.07), (0, -8, 0)),
        "eyeBlinkRight": ((slit == 2) & (y > 0.07), (0, -8, 0)),
        "eyeSquintLeft": ((slit == 1) & (y < 0.07), (0, 3, 0)),
        "eyeSquintRight": ((slit == 2) & (y < 0.07), (0, 3, 0)),
        "eyeWideLeft": ((slit == 1) & (y > 0.07), (0, 3, 0)),
        "eyeWideRight": ((slit == 2) & (y > 0.07), (0, 3, 0)),
    }
    blends = []
    for name, (where, move) in shapes.items():
        offsets = where[:, None] * np.array(move) * _MM
        if name.startswith("mouthSmile"):
            offsets[where & ~below, 1] += 0.6 * _MM
        blends.append(BlendShape.from_dense(name, offsets))
    counts = np.full(len(quads), 4)
    return Mesh("Face", points, counts, quads.ravel(), shapes=tuple(blends))


def bent_slit_face() -> Mesh:
    """Return the mesh with shapes that are not linear.

    A blink closes 90 % at weight 0.5, a jaw opens late, an upper lip first goes further than it
    stays; jaw and smile together, and both upper lips, do more than either.
    """
    mesh = slit_face()
    bends = {
        "eyeBlink": ((0.5, 0.9),),
        "jawOpen": ((0.5, 0.2),),
        "mouthUpperUp": ((0.3, 0.7), (0.6, 1.2)),
        "eyeWide": ((0.4, 0.1),),
    }
    shapes = []
    for shape in mesh.shapes:
        bend = next((b for name, b in bends.items() if shape.name.startswith(name)), ())
        between = (Inbetween(f"at{w}", w, share * shape.offsets) for w, share in bend)
        shapes.append(replace(shape, inbetweens=tuple(between)))
    named = {shape.name: shape for shape in shapes}
    for name, of, rule, share in (
        ("jawSmileLeft", ("jawOpen", "mouthSmileLeft"), "product", -0.3),
        ("jawSmileRight", ("jawOpen", "mouthSmileRight"), "product", -0.3),
        ("upperBoth", ("mouthUpperUpRight", "mouthUpperUpLeft"), "min", 0.4),
    ):
        on = named[of[0]]
        shapes.append(
            BlendShape(name, on.indices, share * on.offsets, combination=Combination(of, rule))
        )
    return replace(mesh, shapes=tuple(shapes))


def with_correctives(mesh: Mesh, count: int) -> Mesh:
    """Return the mesh with so many more shapes that hardly move anything, as large rigs have."""
    first = mesh.shapes[0]
    more = (BlendShape(f"more{k}", first.indices, 1e-5 * first.offsets) for k in range(count))
    return replace(mesh, shapes=(*mesh.shapes, *more))


def _both(*names: str) -> tuple[str, ...]:
    return tuple(f"{name}{side}" for name in names for side in ("Left", "Right"))


EXPRESSIONS = (
    Expression("joy", _both("mouthSmile"), np.ones(2)),
    Expression("surprise", ("browInnerUp", "jawOpen", *_both("eyeWide")), np.full(4, 0.8)),
    Expression("disgust", _both("mouthUpperUp", "eyeSquint"), np.ones(4)),
    Expression("sadness", _both("mouthFrown"), np.ones(2)),
)
