"""Proposed bindings: a vertex for each marker of a take, with its confidence."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.binding.distinct_markers import distinct_markers
from usdface.binding.face_surface import face_surface
from usdface.binding.lifted_take import lifted_take
from usdface.binding.placed_markers import place_markers
from usdface.binding.proposal import ContradictedName, Proposal
from usdface.errors import InputError
from usdface.face.bound_face import BoundFace
from usdface.face.marker_name_places import named_places
from usdface.face.place_descriptions import place_descriptions
from usdface.rigs import Mesh
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake

__all__ = ["propose"]


def propose(
    take: MarkerTake, mesh: Mesh, setup: RetargetSetup, *, find_neutral: bool = False
) -> Proposal:
    """Propose the vertex of each marker that has none.

    Parameters
    ----------
    take : MarkerTake
        In space, or of an image with names that tell places.
    mesh : Mesh
    setup : RetargetSetup
        Its binding is kept, and helps to place the other markers; it names neutral frames, and
        peak frames if they are not to be detected.
    find_neutral : bool
        Look for neutral frames instead: a pose that the face holds and from which the rig
        explains the peak frames.

    Raises
    ------
    InputError
        If the take is of an image without such names or shows too few markers, a neutral or peak
        frame that is named is not there, or the blend shapes of the mesh move no visible surface,
        or one of fewer vertices than there are markers.
    """
    given = {n: int(v) for n, v in zip(setup.binding.markers, setup.binding.points, strict=True)}
    surface = face_surface(mesh)
    placeless: tuple[str, ...] = ()
    if take.dimension == 2:
        whole = take
        take = lifted_take(whole, surface, _given_places(whole.names, given, mesh))
        placeless = tuple(name for name in whole.names if name not in take.names)
    used, duplicates = distinct_markers(take, given)
    if len(surface.vertices) < len(used):
        raise InputError(
            f"the blend shapes of mesh {mesh.name!r} move a visible surface of only "
            f"{len(surface.vertices)} vertices for {len(used)} markers; name the mesh of the face "
            'as "mesh" in --bind bind.json',
            "SKIN_MISSING",
        )
    placed, strays = place_markers(take, used, surface, setup, given, find_neutral=find_neutral)
    names = tuple(take.names[i] for i in placed.used)
    found, confidence, off = placed.found, placed.confidence, placed.off
    check = found.check
    new = np.array([i for i, n in enumerate(names) if n not in given and not off[i]], dtype=int)
    bound, unsure = new[~placed.unsure[new]], new[placed.unsure[new]]
    wrong = [(name, anchor) for name, anchor in strays.items() if anchor is not None]
    wrong += [(names[anchor.marker], anchor) for anchor in found.doubted]
    doubted = {name for name, _ in wrong}
    off_face = (*strays, *(names[i] for i in np.flatnonzero(off)))
    vertices = surface.vertices[placed.chosen]
    binding = Binding(
        (*given, *(names[i] for i in bound)),
        np.array([*given.values(), *vertices[bound]], dtype=np.int64),
        setup.binding.mesh,
        np.array([*(0.0 if name in doubted else 1.0 for name in given), *confidence[bound]]),
    )
    left_out = Binding(
        tuple(names[i] for i in unsure), vertices[unsure], setup.binding.mesh, confidence[unsure]
    )
    neutral = found.neutral if find_neutral else setup.neutral
    peaks = tuple(found.peaks.tolist())
    return Proposal(
        setup=replace(setup, binding=binding, unsure=left_out, neutral=neutral, peaks=peaks),
        placed=tuple(names[i] for i in new),
        never_seen=tuple(take.names[i] for i in np.flatnonzero(~take.visible.any(axis=0))),
        duplicates=duplicates,
        doubted=tuple(wrong),
        off_face=tuple(name for name in off_face if name not in given),
        contradicted=_contradicted_names(mesh, names, vertices, check.contradicted),
        exchanged=tuple(names[i] for i in np.flatnonzero(check.exchanged)),
        names_unused=found.named and not check.used,
        placeless=placeless,
        failed=placed.failed,
    )


def _given_places(names: Sequence[str], given: dict[str, int], mesh: Mesh) -> FloatArray:
    """Return the places of given vertices: (M, 3) [m], NaN for markers without one."""
    nowhere = np.full(3, np.nan)
    return np.array([mesh.points[given[name]] if name in given else nowhere for name in names])


def _contradicted_names(
    mesh: Mesh, names: Sequence[str], vertices: IntArray, contradicted: BoolArray
) -> tuple[ContradictedName, ...]:
    """Describe the places of some markers by name, and by registration."""
    some = np.flatnonzero(contradicted)
    unmarked = BoundFace(mesh, (), np.zeros(0, dtype=np.int64))
    named = named_places(names)
    return tuple(
        ContradictedName(names[i], place.description if (place := named[i]) else "", found)
        for i, found in zip(
            some.tolist(), place_descriptions(unmarked, vertices[some]), strict=True
        )
    )
