"""The head's motion on a stage: on the joint that moves the face, else on the SkelRoot."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdSkel, Vt

from usdface.arrays import FloatArray
from usdface.geometry.rigid_fit import Pose, mean_scale
from usdface.io.usd.layer_samples import write_samples, write_value
from usdface.io.usd.value_arrays import matrices
from usdface.retarget.head_joint import face_joint
from usdface.retarget.joint_motion import JointMotion, joint_track, matrices_of
from usdface.rigs import Mesh, Skeleton
from usdface.setup.retarget_setup import RetargetSetup

__all__ = [
    "HEAD_OP",
    "HeadCarrier",
    "JointCarrier",
    "RootCarrier",
    "author_head",
    "find_carrier",
    "inverse_head_motion",
]

HEAD_OP = "xformOp:transform:usdfaceHead"
# Joint attributes of a SkelAnimation.
_COMPONENTS = (
    ("translations", Sdf.ValueTypeNames.Float3Array, Vt.Vec3fArray),
    ("rotations", Sdf.ValueTypeNames.QuatfArray, Vt.QuatfArray),
    ("scales", Sdf.ValueTypeNames.Half3Array, Vt.Vec3hArray),
)


@dataclass(frozen=True, eq=False, slots=True)
class JointCarrier:
    """The joint that moves the face, which the head motion is authored on.

    Attributes
    ----------
    joint : int
    skeleton : Skeleton
        In metres, Y up.
    to_rig : (4, 4) float64
        From skeleton space to metres, Y up.
    """

    joint: int
    skeleton: Skeleton
    to_rig: FloatArray = field(repr=False)

    @property
    def name(self) -> str:
        """The joint's path."""
        return self.skeleton.joints[self.joint]


@dataclass(frozen=True, eq=False, slots=True)
class RootCarrier:
    """The SkelRoot of a face that no joint moves, which the head motion is authored on.

    Attributes
    ----------
    to_rig : (4, 4) float64
        From the SkelRoot's local space to metres, Y up.
    ops : tuple of str
        Its own transform ops.
    """

    to_rig: FloatArray = field(repr=False)
    ops: tuple[str, ...]
    joint: ClassVar[None] = None
    name: ClassVar[str] = "SkelRoot"


HeadCarrier = JointCarrier | RootCarrier


def find_carrier(
    mesh: Mesh,
    skeleton: Skeleton | None,
    setup: RetargetSetup,
    prim: Usd.Prim,
    root: Usd.Prim,
    si: FloatArray,
) -> HeadCarrier | None:
    """Return the joint or SkelRoot that moves the face; None without a SkelRoot.

    Parameters
    ----------
    mesh : Mesh
    skeleton : Skeleton or None
        The rig's.
    setup : RetargetSetup
        May name the joint.
    prim, root : Usd.Prim
        The skeleton that the mesh is bound to, and the SkelRoot (may be invalid).
    si : (4, 4) float64
        From stage space to metres, Y up.

    Raises
    ------
    InputError
        If the named joint does not exist.
    """
    xforms = UsdGeom.XformCache(Usd.TimeCode.EarliestTime())
    joint = face_joint(skeleton, mesh, setup)
    if skeleton is not None and joint is not None:
        to_world = np.array(xforms.GetLocalToWorldTransform(prim)) @ inverse_head_motion(root)
        return JointCarrier(joint, skeleton, to_world @ si)
    if not root:
        return None
    to_world = np.array(xforms.GetLocalToWorldTransform(root)) @ inverse_head_motion(root)
    order = UsdGeom.Xformable(root).GetXformOpOrderAttr().Get() or ()
    ops = tuple(str(op) for op in order if op != HEAD_OP)
    return RootCarrier(to_world @ si, ops)


def inverse_head_motion(root: Usd.Prim) -> FloatArray:
    """Return the inverse (4, 4) of an authored head motion, for world transforms below a SkelRoot.

    Multiply a prim's local-to-world transform at the earliest time with it.
    """
    start = Usd.TimeCode.EarliestTime()
    xform = UsdGeom.Xformable(root) if root else None
    order = xform.GetXformOpOrderAttr().Get() if xform else None
    if not order or order[-1] != HEAD_OP:
        return np.eye(4)
    head = np.array(root.GetAttribute(HEAD_OP).Get(start) or Gf.Matrix4d(1.0))
    world = np.array(UsdGeom.XformCache(start).GetLocalToWorldTransform(root))
    rest = np.linalg.inv(head) @ world
    return np.asarray(np.linalg.inv(world) @ rest, np.float64)


def author_head(
    layer: Sdf.Layer,
    stage: Usd.Stage,
    paths: tuple[str, str],
    carrier: HeadCarrier,
    motion: Pose | None,
    eyes: Sequence[JointMotion],
    codes: list[float],
    stage_codes: list[float],
) -> None:
    """Author the motion of the head, and of joints of the eyes, on a layer.

    `paths` are SkelRoot and SkelAnimation; `codes` are time codes of the layer, `stage_codes` the
    same on the stage.
    """
    root, animation = paths
    if isinstance(carrier, JointCarrier):
        head = () if motion is None else (JointMotion(carrier.joint, motion),)
        moved = (*head, *eyes)
        if moved:
            _author_joints(layer, stage, animation, carrier, moved, codes, stage_codes)
    elif motion is not None:
        _author_root(layer, root, carrier, motion, codes)


def _author_root(
    layer: Sdf.Layer, path: str, carrier: RootCarrier, motion: Pose, codes: list[float]
) -> None:
    """Author the motion after the SkelRoot's own transform ops, which place the character."""
    root = Sdf.CreatePrimInLayer(layer, path)
    local = carrier.to_rig @ matrices_of(motion) @ np.linalg.inv(carrier.to_rig)
    write_samples(root, HEAD_OP, Sdf.ValueTypeNames.Matrix4d, codes, matrices(local))
    order = Vt.TokenArray([*carrier.ops, HEAD_OP])
    write_value(root, "xformOpOrder", Sdf.ValueTypeNames.TokenArray, order)


def _author_joints(
    layer: Sdf.Layer,
    stage: Usd.Stage,
    path: str,
    carrier: JointCarrier,
    moved: Sequence[JointMotion],
    codes: list[float],
    stage_codes: list[float],
) -> None:
    """Author complete joint arrays: those of head and eyes move, others keep their motion.

    Beyond the take, too, where head and eyes stay as in its first or last frame: the arrays hide
    all samples of the character's own.
    """
    driven = [carrier.skeleton.joints[each.joint] for each in moved]
    tracks = [UsdSkel.DecomposeTransforms(matrices(_local(carrier, each))) for each in moved]
    before, after = _codes_beyond(stage, path, stage_codes)
    names, others = _authored_joints(stage, path, [*before, *stage_codes, *after])
    written = _on_layer([*before, *stage_codes, *after], stage_codes, codes)
    shown = np.arange(-len(before), len(codes) + len(after)).clip(0, len(codes) - 1)
    names = tuple(dict.fromkeys((*names, *driven)))
    columns = [names.index(name) for name in driven]
    anim = Sdf.CreatePrimInLayer(layer, path)
    write_value(anim, "joints", Sdf.ValueTypeNames.TokenArray, Vt.TokenArray(names))
    for (name, kind, array), authored, parts in zip(
        _COMPONENTS, zip(*others, strict=True), zip(*tracks, strict=True), strict=True
    ):
        values = np.stack([np.array(part) for part in parts], axis=1)[shown]
        rows = np.empty((len(written), len(names), values.shape[2]), values.dtype)
        own = np.array([np.array(part) for part in authored])
        rows[:, : own.shape[1]] = own
        rows[:, columns] = values
        write_samples(anim, name, kind, written, map(array.FromNumpy, rows))


def _codes_beyond(
    stage: Usd.Stage, path: str, codes: list[float]
) -> tuple[list[float], list[float]]:
    """Return the time codes of an animation's joints before the first of a take's and after."""
    animation = UsdSkel.Animation.Get(stage, path)
    query = UsdSkel.Cache().GetAnimQuery(animation) if animation else None
    keys = query.GetJointTransformTimeSamples() if query else []
    return [key for key in keys if key < codes[0]], [key for key in keys if key > codes[-1]]


def _on_layer(moments: list[float], stage_codes: list[float], codes: list[float]) -> list[float]:
    """Return time codes of the stage as those of the layer, which is linear in them."""
    if stage_codes == codes:
        return moments
    span = stage_codes[-1] - stage_codes[0]
    scale = (codes[-1] - codes[0]) / span if span else 1.0
    return [codes[0] + scale * (moment - stage_codes[0]) for moment in moments]


def _local(carrier: JointCarrier, moved: JointMotion) -> FloatArray:
    """Return a joint's transforms to its parent in the skeleton's units: (F, 4, 4)."""
    track = joint_track(carrier.skeleton, moved)
    scale = mean_scale(carrier.to_rig[:3, :3]) or 1.0
    shrink, grow = np.diag([1 / scale] * 3 + [1.0]), np.diag([scale] * 3 + [1.0])
    is_root = "/" not in carrier.skeleton.joints[moved.joint]
    below = np.linalg.inv(carrier.to_rig) if is_root else shrink
    return np.asarray(grow @ track @ below)


def _authored_joints(
    stage: Usd.Stage, path: str, codes: list[float]
) -> tuple[tuple[str, ...], list[tuple[Any, Any, Any]]]:
    """Return an animation's joints, and their transform components at each time code, or once."""
    no_components = [tuple(array() for _, _, array in _COMPONENTS)]
    animation = UsdSkel.Animation.Get(stage, path)
    if not animation:
        return (), no_components
    query = UsdSkel.Cache().GetAnimQuery(animation)
    names = tuple(str(name) for name in query.GetJointOrder()) if query else ()
    if not names:
        return (), no_components
    times = codes if query.JointTransformsMightBeTimeVarying() else codes[:1]
    components = [query.ComputeJointLocalTransformComponents(time) for time in times]
    if any(part is None or len(part[0]) != len(names) for part in components):
        return (), no_components
    return names, components
