"""Clips as SkelAnimations, and the variant set that chooses one of them."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom, UsdSkel, Vt

from usdface.arrays import FloatArray
from usdface.clips import Clip, JointsTake
from usdface.io.prim_names import prim_names
from usdface.io.transforms import decompose
from usdface.io.usd.value_arrays import matrices, vec3f_array
from usdface.rigs import Skeleton
from usdface.takes import WeightsTake

__all__ = ["clock_of", "time_codes", "write_clips"]

_UNKNOWN = 60.0  # frames per second
_CLIPS = "animation"  # the variant set
_SAME_TIME = 5e-7  # [s]: 4 roundings of float32 at one second


def clock_of(clips: Sequence[Clip]) -> float:
    """Return the timeCodesPerSecond for some clips: the highest of their rates.

    60 where none is known: keys need not be on frames, and their distances may be anything.
    """
    if all(clip.still for clip in clips):
        return 24.0
    return max(clip.rate for clip in clips) or _UNKNOWN


def time_codes(times: FloatArray, rate: float) -> FloatArray:
    """Return the time codes of `times` (F,) [s].

    1/60 s * 60 is not quite 1; a whole frame should have a whole time code, if that is the
    same time as far as float32 can tell. Of two keys at a step the earlier keeps its own.
    """
    codes = times * rate
    whole = np.round(codes)
    same = np.maximum(_SAME_TIME, np.spacing(np.abs(times).astype(np.float32)))
    near = np.abs(codes - whole) < same * rate
    stepped = np.append(near[1:] & (whole[1:] == whole[:-1]), False)
    return np.where(near & ~stepped, whole, codes)


def write_clips(
    root: UsdSkel.Root,
    skel: UsdSkel.Skeleton,
    skeleton: Skeleton,
    shapes: tuple[str, ...],
    clips: Sequence[Clip],
    rate: float,
) -> None:
    """Author a SkelAnimation for each clip, and bind the first.

    How the face stands without animation are the defaults of all.

    One alone is `Anim`; several lie in the scope `Animations`, and a variant set of the SkelRoot
    chooses. Without any, `Anim` holds the rest.

    Parameters
    ----------
    root, skel : of UsdSkel
        Prims on the stage; `skel` has the joints of `skeleton`.
    skeleton : Skeleton
    shapes : tuple of str, length S
        Tokens of all SkelAnimations.
    clips : sequence of Clip
    rate : float
        The stage's timeCodesPerSecond.
    """
    stage = root.GetPrim().GetStage()
    for prim in (skel.GetPrim(), root.GetPrim()):
        UsdSkel.BindingAPI.Apply(prim)
    UsdSkel.BindingAPI(root).CreateSkeletonRel().SetTargets([skel.GetPath()])
    still = next((clip for clip in clips if clip.still), Clip(""))
    clips = [clip for clip in clips if not clip.still]
    if len(clips) < 2:
        clip = clips[0] if clips else Clip("")
        made = _write_clip(stage, f"{root.GetPath()}/Anim", skeleton, shapes, clip, still, rate)
        _bind(root, skel, made)
        return
    scope = UsdGeom.Scope.Define(stage, root.GetPath().AppendChild("Animations")).GetPath()
    variants = root.GetPrim().GetVariantSets().AddVariantSet(_CLIPS)
    names = prim_names(clip.name for clip in clips)
    for name, clip in zip(names, clips, strict=True):
        made = _write_clip(stage, f"{scope}/{name}", skeleton, shapes, clip, still, rate)
        variants.AddVariant(name)
        variants.SetVariantSelection(name)
        with variants.GetVariantEditContext():
            _bind(root, skel, made)
    variants.SetVariantSelection(names[0])


def _bind(root: UsdSkel.Root, skel: UsdSkel.Skeleton, anim: UsdSkel.Animation) -> None:
    # Some programs look for it on the one, some on the other (OpenUSD#2621).
    for prim in (skel, root):
        UsdSkel.BindingAPI(prim).CreateAnimationSourceRel().SetTargets([anim.GetPath()])


def _write_clip(
    stage: Usd.Stage,
    path: str,
    skeleton: Skeleton,
    shapes: tuple[str, ...],
    clip: Clip,
    still: Clip,
    rate: float,
) -> UsdSkel.Animation:
    """Author a clip as samples, and how the face stands without animation as defaults."""
    anim = UsdSkel.Animation.Define(stage, path)
    if clip.name and clip.name != anim.GetPrim().GetName():
        anim.GetPrim().SetDisplayName(clip.name)
    anim.CreateJointsAttr(skeleton.joints)
    anim.SetTransforms(matrices(skeleton.rest))
    anim.CreateBlendShapesAttr(shapes)
    values = anim.CreateBlendShapeWeightsAttr(Vt.FloatArray(len(shapes)))
    if still.weights is not None:
        values.Set(Vt.FloatArray.FromNumpy(_rows(still.weights, shapes)[0]))
    if clip.weights is not None:
        codes = time_codes(clip.weights.times, rate).tolist()
        for code, row in zip(codes, _rows(clip.weights, shapes), strict=True):
            values.Set(Vt.FloatArray.FromNumpy(row), code)
    if still.joints is not None:
        _write_joints(anim, skeleton, still.joints, [Usd.TimeCode.Default()])
    if clip.joints is not None:
        codes = time_codes(clip.joints.times, rate).tolist()
        _write_joints(anim, skeleton, clip.joints, [Usd.TimeCode(code) for code in codes])
    return anim


def _rows(take: WeightsTake, shapes: tuple[str, ...]) -> NDArray[np.float32]:
    return take.reordered(shapes).weights.astype(np.float32)


def _write_joints(
    anim: UsdSkel.Animation, skeleton: Skeleton, take: JointsTake, codes: Sequence[Usd.TimeCode]
) -> None:
    """Author all joints: programs differ in the fallback of joints that are left out."""
    place = {joint: k for k, joint in enumerate(skeleton.joints)}
    own = [place[joint] for joint in take.joints]
    moves, turns, sizes = (np.tile(p, (len(take.times), 1, 1)) for p in decompose(skeleton.rest))
    moves[:, own], turns[:, own], sizes[:, own] = take.translations, take.rotations, take.scales
    attributes = anim.GetTranslationsAttr(), anim.GetRotationsAttr(), anim.GetScalesAttr()
    for code, move, turn, size in zip(codes, moves, turns, sizes, strict=True):
        values = (
            vec3f_array(move),
            Vt.QuatfArray.FromNumpy(turn.astype(np.float32)),
            Vt.Vec3hArray.FromNumpy(size.astype(np.float16)),
        )
        for attribute, value in zip(attributes, values, strict=True):
            attribute.Set(value, code)
