"""A performer with markers beside eyes and mouth of the face of slits, who blinks and speaks."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from slits import slit_face

from usdface.arrays import FloatArray
from usdface.closure.closing_displacements import closing_displacements
from usdface.closure.lid_apertures import lid_apertures_of
from usdface.face.bound_face import BoundFace
from usdface.options import ProcessOptions
from usdface.rigs import BlendShape, Mesh, Rig
from usdface.setup.binding import Binding
from usdface.setup.pin import Pin
from usdface.setup.retarget_setup import RetargetSetup
from usdface.shot.retarget import retarget
from usdface.shot.shot import Shot, ShotResult
from usdface.takes import MarkerTake

__all__ = [
    "BLINKS",
    "TIMES",
    "markers",
    "performance",
    "result",
    "slit_bound",
    "slit_markers",
    "with_human_lids",
]

BLINKS = (1.0, 2.5)
TIMES = np.arange(0, 4, 1 / 60)
_NEUTRAL = 20


def slit_markers(mesh: Mesh) -> dict[str, int]:
    """Return the vertices of the markers: above and below each slit, and at the brows."""
    places = {
        "mouth_up": (0.0, 0.010, 0.010),
        "mouth_down": (0.0, -0.010, 0.010),
        "mouth_left": (0.025, 0.0, 0.004),
        "mouth_right": (-0.025, 0.0, 0.004),
        "brow_left": (0.035, 0.1, 0.01),
        "brow_right": (-0.035, 0.1, 0.01),
    }
    for side, x in (("left", 0.035), ("right", -0.035)):
        places[f"eye_{side}_up"] = (x, 0.078, 0.012)
        places[f"eye_{side}_down"] = (x, 0.062, 0.012)
        places[f"eye_{side}_in"] = (0.6 * x, 0.085, 0.01)
    found = {}
    for name, place in places.items():
        away = np.linalg.norm(mesh.points - np.array(place), axis=1)
        away[list(found.values())] = np.inf
        found[name] = int(away.argmin())
    return found


def slit_bound(mesh: Mesh) -> BoundFace:
    """Return the face of slits with its markers."""
    places = slit_markers(mesh)
    points = np.array(list(places.values()))
    return BoundFace(mesh, tuple(places), points, nose_tip="mouth_up").with_layout(())


def with_human_lids(mesh: Mesh, share: float = 1.0, looks: bool = False) -> Mesh:
    """Return the mesh whose blinks move its markers so many times as far as people's do.

    `looks`: eyes look down, by half as much.
    """
    face, shapes = slit_bound(mesh), list(mesh.shapes)
    for eye in lid_apertures_of(face, mesh.shape_names).values():
        shape = shapes[eye.closer]
        dense = np.zeros_like(mesh.points)
        dense[shape.indices] = shape.offsets
        closing = closing_displacements(face, eye, mesh.shape_names, face.markers)
        dense[face.vertices] = share * closing
        shapes[eye.closer] = BlendShape.from_dense(shape.name, dense)
        if looks:
            down = shape.name.replace("Blink", "LookDown")
            shapes.append(BlendShape.from_dense(down, 0.5 * dense))
    return replace(mesh, shapes=tuple(shapes))


def with_one_blink(mesh: Mesh) -> Mesh:
    """Return the mesh with one shape, eyeBlink, that closes both eyes."""
    shapes = {shape.name: shape for shape in mesh.shapes}
    dense = np.zeros_like(mesh.points)
    for side in ("Left", "Right"):
        one = shapes.pop(f"eyeBlink{side}")
        dense[one.indices] += one.offsets
    both = BlendShape.from_dense("eyeBlink", dense)
    return replace(mesh, shapes=(*shapes.values(), both))


def performance(names: Sequence[str], **curves: FloatArray) -> FloatArray:
    """Return the weights (F, S) of a performer who blinks; other curves by name."""
    weights = np.zeros((len(TIMES), len(names)))
    for start in BLINKS:
        rise = np.clip(np.minimum((TIMES - start) / 0.08, (start + 0.26 - TIMES) / 0.16), 0, 1)
        for side in ("Left", "Right"):
            column = names.index(f"eyeBlink{side}")
            weights[:, column] = np.maximum(weights[:, column], 0.5 - 0.5 * np.cos(np.pi * rise))
    for name, curve in curves.items():
        weights[:, names.index(name)] = curve
    return weights


def markers(
    mesh: Mesh,
    weights: FloatArray,
    without: Sequence[str] = (),
    share: float = 1.0,
    *,
    as_people: bool = False,
    at: Mapping[str, int] | None = None,
) -> MarkerTake:
    """Return the take (without some markers) of lids that move by a share of the mesh's.

    `as_people`: by a share of how people close them. `at`: the vertices of the markers.
    """
    every = slit_markers(mesh) if at is None else at
    own = {n: v for n, v in every.items() if not n.startswith(tuple(without) or "-")}
    offsets = mesh.offsets_at(np.array(list(own.values())))
    if as_people:
        face, names = slit_bound(mesh), mesh.shape_names
        offsets = offsets.copy()
        for eye in lid_apertures_of(face, names).values():
            offsets[eye.closer] = closing_displacements(face, eye, names, tuple(own))
    lids = np.array([name.startswith("eyeBlink") for name in mesh.shape_names])
    scaled = weights * np.where(lids, share, 1.0)
    scaled[:_NEUTRAL] = 0.0
    moved = mesh.points[list(own.values())] + np.einsum("fs,smd->fmd", scaled, offsets)
    moved += 5e-5 * np.random.default_rng(0).standard_normal(moved.shape)
    return MarkerTake(tuple(own), TIMES, moved, 60.0)


def shot_of(
    take: MarkerTake,
    mesh: Mesh | None = None,
    pins: Sequence[Pin] = (),
    at: Mapping[str, int] | None = None,
    **settings: object,
) -> Shot:
    """Return a shot of a take on the face of slits; `at`: the vertices that it is bound to."""
    mesh = mesh or slit_face()
    places = slit_markers(mesh) if at is None else at
    binding = Binding(take.names, np.array([places[name] for name in take.names]), "Face")
    setup = RetargetSetup(
        binding,
        head="stabilised",
        neutral=(0, _NEUTRAL - 1),
        nose_tip=take.names[0],
        pins=tuple(pins),
    )
    setup = replace(setup, **settings)
    face = BoundFace(mesh, (), np.zeros(0, int)).with_layout(())
    return Shot(Rig("Face", (mesh,)), take, setup, layout=face.layout)


def result(
    take: MarkerTake,
    *,
    mesh: Mesh | None = None,
    pins: Sequence[Pin] = (),
    options: ProcessOptions = ProcessOptions(express=False),
    at: Mapping[str, int] | None = None,
    **settings: object,
) -> ShotResult:
    """Retarget a take to the face of slits, without an expression layer."""
    return retarget(shot_of(take, mesh, pins, at, **settings), options=options)
