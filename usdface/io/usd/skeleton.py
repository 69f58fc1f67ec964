"""Skeletons and skin bindings of a USD stage, in metres."""

import numpy as np
from pxr import Usd, UsdSkel

from usdface.arrays import FloatArray
from usdface.findings import Finding, finding
from usdface.findings.values import Prose
from usdface.geometry.rigid_fit import mean_scale
from usdface.io.usd.conversion_metadata import SKIN_NAME, read_metadata
from usdface.rigs import Skeleton, Skin

__all__ = ["parent_frames", "read_skeleton", "read_skin"]

_START = Usd.TimeCode.EarliestTime()


def read_skeleton(
    prim: UsdSkel.Skeleton, to_rig: FloatArray, moved: bool
) -> tuple[Skeleton | None, list[Finding]]:
    """Return the skeleton with its joints in rig space; None where it moves nothing.

    `to_rig` (4, 4) leads from skeleton space to rig space. A unit of a joint's own frame is
    a metre afterwards, so that joints carry no scale that only came from the stage's units.
    A skeleton without joints, or with one joint that stays at the identity (as writers add for
    programs that need a joint) and is not `moved` by an animation, is None.
    """
    where = str(prim.GetPath())
    joints = tuple(str(joint) for joint in prim.GetJointsAttr().Get() or ())
    count = len(joints)
    if not count:
        return None, []
    bind = _matrices(prim.GetBindTransformsAttr().Get())
    rest = _matrices(prim.GetRestTransformsAttr().Get())
    topology = UsdSkel.Topology(joints)
    sound, why = topology.Validate()
    if len(bind) != count or len(rest) not in (0, count) or not sound:
        why = why or f"{count} joints, {len(bind)} bind and {len(rest)} rest transforms"
        return None, [
            finding(
                "FEATURE_DROPPED", where, f"the skeleton is left out: {why}", feature="skeleton"
            )
        ]
    parents = np.array([topology.GetParent(joint) for joint in range(count)])
    if not len(rest):
        above = np.where((parents >= 0)[:, None, None], bind[parents], np.eye(4))
        rest = bind @ np.linalg.pinv(above)
    if not (np.isfinite(bind).all() and np.isfinite(rest).all()):
        message = "the skeleton is left out: its transforms are not finite numbers"
        return None, [finding("FEATURE_DROPPED", where, message, feature="skeleton")]
    if not np.linalg.det(bind).all():
        message = "the skeleton is left out: a bind transform is singular"
        return None, [finding("FEATURE_DROPPED", where, message, feature="skeleton")]
    if count == 1 and not moved and np.allclose(bind, np.eye(4)) and np.allclose(rest, np.eye(4)):
        return None, []
    scale, below = parent_frames(joints, to_rig)
    shrink = np.diag([1 / scale] * 3 + [1.0])
    names = tuple(str(name) for name in prim.GetJointNamesAttr().Get() or ())
    if len(names) != count:
        names = tuple(joint.rpartition("/")[2] for joint in joints)
    skin = str(read_metadata(prim).get(SKIN_NAME, ""))
    return Skeleton(joints, names, shrink @ bind @ to_rig, shrink @ rest @ below, skin), []


def parent_frames(joints: tuple[str, ...], to_rig: FloatArray) -> tuple[float, FloatArray]:
    """Return a unit of skeleton space in metres, and transforms to parents' frames: (J, 4, 4).

    A joint's transform in the rig is its transform on the stage, followed by that, and divided
    by the unit, so that a unit of each joint's own frame is a metre.
    """
    scale = mean_scale(to_rig[:3, :3]) or 1.0
    topology = UsdSkel.Topology(joints)
    below = np.array([topology.GetParent(joint) >= 0 for joint in range(len(joints))])
    return scale, np.where(below[:, None, None], np.diag([scale] * 3 + [1.0]), to_rig)


def _matrices(values: object) -> FloatArray:
    return np.zeros((0, 4, 4)) if values is None else np.array(values, np.float64)


def read_skin(
    query: UsdSkel.SkinningQuery, count: int, joints: tuple[str, ...]
) -> tuple[Skin | None, list[Finding]]:
    """Return the influences of a mesh with `count` points on the skeleton's `joints`."""
    prim: Usd.Prim = query.GetPrim()
    where = str(prim.GetPath())
    width = query.GetNumInfluencesPerComponent()
    influences = query.ComputeVaryingJointInfluences(count, _START)
    if not influences or any(len(part) != count * width for part in influences):
        message = "skin influences do not fit {point_count} points; the mesh is left unskinned"
        return None, [finding("FEATURE_DROPPED", where, message, count, feature="skin")]
    indices = np.asarray(influences[0], np.int64).reshape(count, width)
    weights = np.asarray(influences[1], np.float64).reshape(count, width)
    own = query.GetJointOrder()
    order = [str(joint) for joint in own] if own else list(joints)
    unknown = [joint for joint in order if joint not in joints]
    outside = indices.size and not 0 <= indices.min() <= indices.max() < len(order)
    if unknown or outside or not np.isfinite(weights).all():
        why = (
            f"joint {unknown[0]!r} is unknown" if unknown else "joint indices or weights are wrong"
        )
        message = "{why}; the mesh is left unskinned"
        return None, [finding("FEATURE_DROPPED", where, message, Prose(why), feature="skin")]
    places = np.array([joints.index(joint) for joint in order], np.int64)
    skin = Skin(places[indices], weights)
    if not count:
        return skin, []
    holding = dict.fromkeys(indices[0][weights[0] != 0].tolist())  # of all points, where rigid
    return skin, _mixed_normals(query, [order[joint] for joint in holding])


def _mixed_normals(query: UsdSkel.SkinningQuery, holding: list[str]) -> list[Finding]:
    """Report where one transform, mixed of several joints, moves a whole mesh and its normals.

    UsdSkel turns the normals by that transform. glTF has influences of points alone, and does not
    say how they turn normals: its players mix the joints' own turns, as UsdSkel does where
    influences are of points.
    """
    prim: Usd.Prim = query.GetPrim()
    if not query.IsRigidlyDeformed() or len(holding) < 2 or not prim.GetAttribute("normals").Get():
        return []
    message = (
        "the mesh moves as a whole by several joints, {names}: as glTF its points do, and its "
        "normals are those of each joint, mixed"
    )
    where = str(prim.GetPath())
    return [finding("FEATURE_APPROXIMATED", where, message, holding, feature="rigid_skin")]
