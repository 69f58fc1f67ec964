"""Input of the solver: take as observed, setup fitted to the mesh, skin around the markers."""

from dataclasses import replace

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.blas_threads import one_blas_thread
from usdface.blend_shapes.combined_weights import combined_shapes
from usdface.cleanup.clean import Cleaned
from usdface.errors import InputError
from usdface.face.bound_face import BoundFace
from usdface.face.fitted_setup import fit_setup
from usdface.face.marker_surface import MarkerSurface
from usdface.findings import Finding
from usdface.geometry.marker_spread import rms_radius
from usdface.geometry.rigid_fit import POSE_MARKERS
from usdface.progress import Progress
from usdface.retarget.film.dot_radii import dot_radii
from usdface.retarget.pins import pins_of_combinations
from usdface.retarget.solver.backend import compile_kernels
from usdface.retarget.usable_markers import check_bound_markers
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake

__all__ = ["solver_input"]


@one_blas_thread()
def solver_input(
    take: MarkerTake,
    face: BoundFace,
    setup: RetargetSetup,
    cleaned: Cleaned | None,
    progress: Progress | None,
) -> tuple[MarkerTake, RetargetSetup, MarkerSurface, list[Finding]]:
    """Return the take as observed, the setup fitted to the mesh, the skin around its markers."""
    check_bound_markers(setup, take)
    setup, findings = fit_setup(setup, face.mesh, take)
    if cleaned is not None:
        take = _observed(take, cleaned.measured, setup.head_markers)
    radii = dot_radii(take, face.markers, face.neutral)
    _check_dots(radii, face)
    known = setup.solve.limits == "known"
    surface = MarkerSurface(face.mesh, face.vertices, radii, known)
    findings += face.findings
    findings += pins_of_combinations(setup.pins, combined_shapes(face.mesh.shapes))
    findings += compile_kernels(len(take.times), len(face.mesh.shapes), progress or Progress())
    return take, setup, surface, findings


def _observed(take: MarkerTake, measured: BoolArray, head_markers: tuple[str, ...]) -> MarkerTake:
    """Return a take without its filled gaps: the rig predicts occluded markers better.

    Not those of the head markers where fewer than three were measured (F, M): no blend shape moves
    them, and without them the head's pose is unknown.
    """
    on_head = np.isin(take.names, head_markers)
    few = measured[:, on_head].sum(axis=1) < POSE_MARKERS
    used = measured | (few[:, None] & on_head)
    return replace(take, positions=np.where(used[..., None], take.positions, np.nan))


def _check_dots(radii: FloatArray, face: BoundFace) -> None:
    """Raise InputError where a dot (B,) [m] is as large as the face."""
    face_radius = rms_radius(face.neutral)
    large = np.flatnonzero(radii >= face_radius)
    if len(large):
        raise InputError(
            f"the dot of marker {face.markers[large[0]]!r} has a diameter of "
            f"{2.0 * radii[large[0]]:.3g} m on the character, whose markers are spread over "
            f"{2.0 * face_radius:.3g} m; expected that of a painted dot",
            "VALUES_WRONG",
        )
