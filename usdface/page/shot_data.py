"""The data of a shot's page: one clip with two sets of weights, and its results."""

from typing import Any

import numpy as np

from usdface.arrays import FloatArray
from usdface.closure.lid_apertures import lid_apertures_of
from usdface.closure.lip_contact import lip_apertures_of
from usdface.face.bound_face import BoundFace
from usdface.face.face_points import face_points
from usdface.face.lip_lid_contacts import LipLidContacts
from usdface.face.regions import regions_of, shape_regions
from usdface.face.residual_heat import heat_of_markers
from usdface.page.clip_data import joint_motion, sampled_weights, ticks
from usdface.page.packed_data import Quantized
from usdface.page.performer import markers_on_face, performer_data
from usdface.page.rule_data import rule_data
from usdface.retarget.head_joint import carrying_joint
from usdface.rigs import Mesh
from usdface.shot.played_shot import PlayedShot
from usdface.takes import MarkerTake, frame_step
from usdface.verdict.judge import Verdict

__all__ = ["carrier_of", "gap_curves", "shot_data"]


def shot_data(
    played: PlayedShot, shapes: tuple[str, ...], meshes: tuple[Mesh, ...]
) -> dict[str, Any]:
    """Return a processed shot as a tree for `usdface.page.packed_data.pack_data`.

    Parameters
    ----------
    played : PlayedShot
    shapes : tuple of str
        Blend shapes of the page, in its order.
    meshes : tuple of Mesh
        Meshes of the page, in its order; the bound one is among them.
    """
    take, face = played.shot.take, played.shot.face
    times = take.times
    weights = {"corrected": Quantized(sampled_weights(played.corrected, shapes, times))}
    if not np.array_equal(played.solved.weights, played.corrected.weights):
        weights["raw"] = Quantized(sampled_weights(played.solved, shapes, times))
    joints = played.clip.joints if played.clip else None
    clip = {
        "name": "take",
        "rate": take.rate or _rate(times),
        "ticks": ticks(times),
        "weights": weights,
        "joints": joint_motion(joints, played.rig.skeleton, times),
    }
    paths = [mesh.path for mesh in meshes]
    return {
        "clips": [clip],
        "start_timecode": take.start_timecode,
        "face": {
            "mesh": paths.index(face.mesh.path) if face.mesh.path in paths else 0,
            "carrier": carrier_of(played, face),
        },
        "performer": _performer(played, face),
        "features": _features(played, face),
        "residual": _residual(played, face),
        "emotions": _curves(played.emotions),
        "closures": _curves(played.closures),
        "rules": rule_data(played),
        "gaps": gap_curves(played, face),
        "deviations": [round(played.deviations.get(name, 0.0), 5) for name in shapes],
        "regions": _shape_regions(face, shapes),
        "verdict": _verdict(played.verdict),
    }


def _verdict(verdict: Verdict | None) -> dict[str, Any] | None:
    """Return a verdict with the text of its reasons."""
    if verdict is None:
        return None
    reasons = [
        {
            "message": reason.message,
            "remedy": reason.criterion.remedy,
            "frames": list(reason.measured.frames),
        }
        for reason in verdict.reasons
    ]
    return {"level": verdict.level, "reasons": reasons}


def _rate(times: FloatArray) -> float:
    return round(1.0 / frame_step(times), 6) if len(times) > 1 else 24.0


def carrier_of(played: PlayedShot, face: BoundFace) -> int:
    """Return the joint that carries the face; -1 if none does."""
    skeleton = played.rig.skeleton
    own = next((m for m in played.rig.meshes if m.path == face.mesh.path), None)
    if skeleton is None or own is None or own.skin is None:
        return -1
    joint = carrying_joint(skeleton, own.skin, face_points(own, face.vertices))
    return -1 if joint is None else joint


def _performer(played: PlayedShot, face: BoundFace) -> dict[str, Any] | None:
    take = played.shot.take
    if not isinstance(take, MarkerTake):
        return None
    head = played.head if played.shot.setup.head != "stabilised" else played.head[:0]
    positions = markers_on_face(take, played.shot.setup, face, head)
    return performer_data(take, positions, face)


def _features(played: PlayedShot, face: BoundFace) -> dict[str, Any] | None:
    """Return the solved markers on the character, and how their residuals colour its skin."""
    if not len(played.feature_points):
        return None
    vertices = face.vertices_of(played.markers)
    nearest, shares = heat_of_markers(face.mesh, vertices)
    return {
        "names": list(played.markers),
        "vertices": vertices,
        "positions": Quantized(played.feature_points),
        "residual_mm": Quantized(1000.0 * played.distances),
        "nearest": nearest,
        "shares": Quantized(shares, 8),
    }


def _residual(played: PlayedShot, face: BoundFace) -> dict[str, Any] | None:
    if not len(played.residual):
        return None
    distances = played.distances
    regions = np.array(regions_of(face.mesh, face.vertices_of(played.markers)))
    return {
        "all_mm": _seen(played.residual, distances),
        "regions_mm": {
            name: _seen(curve, distances[:, regions == name])
            for name, curve in played.regions.items()
        },
    }


def _seen(residual: FloatArray, distances: FloatArray) -> Quantized:
    """Return a residual [mm], NaN where its markers are all occluded: the layers have 0 there."""
    unseen = np.isnan(distances).all(axis=1) if distances.size else np.zeros(len(residual), bool)
    return Quantized(np.where(unseen, np.nan, 1000.0 * residual))


def _curves(curves: Any) -> dict[str, Quantized]:
    return {name: Quantized(curve) for name, curve in curves.items()}


def gap_curves(played: PlayedShot, face: BoundFace) -> list[dict[str, Any]]:
    """Return the gaps of lids and lips over the take [mm], before and after the correction.

    `least` is the least gap of all places along the slit, negative where the two sides cross;
    `widest` the gap where it is open widest.
    """
    names = played.corrected.names
    layers = {"corrected": played.corrected.weights, "raw": played.solved.weights}
    found = []
    for eye, lids in lid_apertures_of(face, names).items():
        ends = {layer: lids.ends(weights) for layer, weights in layers.items()}
        found.append(_gap(f"{eye} eye", ends))
    lips = lip_apertures_of(face, names)
    if lips is not None:
        opened = {layer: lips.neutral + lips.opened(weights) for layer, weights in layers.items()}
        ends = {layer: (gap.min(axis=1), gap.max(axis=1)) for layer, gap in opened.items()}
        found.append(_gap("lips", ends))
    return found


def _gap(name: str, ends: dict[str, tuple[FloatArray, FloatArray]]) -> dict[str, Any]:
    return {
        "name": name,
        **{
            layer: {"least_mm": Quantized(1000.0 * low), "widest_mm": Quantized(1000.0 * high)}
            for layer, (low, high) in ends.items()
        },
    }


def _shape_regions(face: BoundFace, shapes: tuple[str, ...]) -> list[str]:
    """Return the region of each blend shape: brows, eyes or mouth; "" = unknown."""
    layout = face.layout
    found = layout.regions or shape_regions(face.mesh, LipLidContacts(layout.lips, layout.lids))
    region = {name: where for where, names in found.items() for name in names}
    return [region.get(name, "") for name in shapes]
