"""A setup fitted to a mesh and a take: checked, with the mesh and the nose tip named."""

from dataclasses import replace

import numpy as np

from usdface.errors import InputError, did_you_mean
from usdface.face.landmark_sets import nose_tip_landmark
from usdface.face.marker_name_places import names_nose_tip
from usdface.findings import Finding, finding
from usdface.plain_text import listed
from usdface.rigs import Mesh
from usdface.setup.binding import Binding
from usdface.setup.binding_origin import check_mesh
from usdface.setup.retarget_setup import RetargetSetup, check_neutral_frames, check_neutral_weights
from usdface.takes import MarkerTake, WeightsTake, visible

__all__ = ["check_vertices", "fit_setup"]

_NAMED = 8  # markers that a message lists


def fit_setup(
    setup: RetargetSetup, mesh: Mesh, take: MarkerTake | WeightsTake | None = None
) -> tuple[RetargetSetup, list[Finding]]:
    """Check a setup against rig and take; name the mesh, and the nose tip if it is not named.

    Without a take only the rig is compared.

    Raises
    ------
    InputError
        If the binding was made for another mesh or a marker sits outside the mesh, none is in the
        take, a named head marker or nose tip is not there, or a neutral weight is of no blend shape
        of the mesh.
    """
    if setup.origin is not None:
        check_mesh(setup.origin, mesh)
    setup = replace(setup, binding=replace(setup.binding, mesh=mesh.path or mesh.name))
    binding = setup.binding
    setup, findings = _with_assumed_neutral(setup, take)
    findings += _uncalibrated(setup, mesh)
    if not binding.markers:
        return setup, findings
    check_vertices(binding, mesh)
    if isinstance(take, MarkerTake):
        _check_take(setup, take)
        check_neutral_weights(setup.neutral_weights, mesh.shape_names)
    if setup.nose_tip:
        _check_nose_tip(setup, take)
        return setup, findings
    tip = nose_tip_landmark(binding.markers)
    named = [tip] if tip else [name for name in binding.markers if names_nose_tip(name)]
    if len(named) == 1:
        return replace(setup, nose_tip=named[0]), findings
    foremost = binding.markers[int(np.argmax(mesh.points[binding.points, 2]))]
    message = "no nose tip is named; the foremost marker is taken"
    findings.append(finding("NOSE_TIP_ASSUMED", foremost, message))
    return replace(setup, nose_tip=foremost), findings


def check_vertices(binding: Binding, mesh: Mesh) -> None:
    """Refuse a binding to vertices that the mesh does not have.

    Raises
    ------
    InputError
        Naming the first marker.
    """
    outside = (binding.points < 0) | (binding.points >= len(mesh.points))
    if outside.any():
        first = int(outside.argmax())
        raise InputError(
            f"marker {binding.markers[first]!r} is bound to vertex {binding.points[first]} of "
            f"{mesh.path or mesh.name}, which has vertices 0 to {len(mesh.points) - 1}",
            "VERTEX_OUTSIDE",
        )


def _check_take(setup: RetargetSetup, take: MarkerTake) -> None:
    binding = setup.binding
    take.select(setup.head_markers)
    if setup.neutral:
        check_neutral_frames(setup.neutral, len(take.times), take.source)
    if not set(binding.markers) & set(take.names):
        raise InputError(
            f"no bound marker is in the take {take.source}; bound: "
            f"{listed(binding.markers, _NAMED)}; in the take: {listed(take.names, _NAMED)}",
            "MARKER_UNKNOWN",
        )


def _check_nose_tip(setup: RetargetSetup, take: MarkerTake | WeightsTake | None) -> None:
    markers = setup.binding.markers
    if setup.nose_tip not in markers:
        raise InputError(
            f"the nose tip {setup.nose_tip!r} is not among the bound markers: "
            f"{listed(markers, _NAMED)}{did_you_mean(setup.nose_tip, markers)}",
            "MARKER_UNKNOWN",
        )
    if isinstance(take, MarkerTake):
        take.select((setup.nose_tip,))


def _with_assumed_neutral(
    setup: RetargetSetup, take: MarkerTake | WeightsTake | None
) -> tuple[RetargetSetup, list[Finding]]:
    """Return the setup with the neutral frame that is assumed where none is named.

    The first frame, unless it shows fewer than half the markers of a typical one: labels often
    begin late. One marker that comes later is left out rather than a later frame taken, in which
    the face may move.
    """
    if not setup.neutral_assumed or take is None:  # a rig alone has no frames
        return setup, []
    frame, message = 0, "no neutral frames are named; the first frame is taken"
    if isinstance(take, MarkerTake):
        bound = np.isin(take.names, setup.binding.markers)
        count = visible(take.positions[:, bound]).sum(axis=1)
        shown = count[count > 0]
        if len(shown):
            frame = int(np.argmax(2 * count >= np.median(shown)))
    if not frame:
        return setup, [finding("NEUTRAL_ASSUMED", take.source, message)]
    message = (
        "no neutral frames are named; frame {frame} is taken, the first that shows at least half "
        "the markers"
    )
    setup = replace(setup, neutral=(frame, frame))
    return setup, [finding("NEUTRAL_ASSUMED", take.source, message, frame)]


def _uncalibrated(setup: RetargetSetup, mesh: Mesh) -> list[Finding]:
    known = set(mesh.shape_names)
    return [
        finding("SHAPE_UNKNOWN", name, "it is named in the calibration")
        for name in (setup.calibration.shapes if setup.calibration else ())
        if name not in known
    ]
