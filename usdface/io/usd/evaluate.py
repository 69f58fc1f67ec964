"""Deformed meshes of a stage, computed by UsdSkel itself."""

from collections.abc import Collection, Iterable
from dataclasses import dataclass, replace

import numpy as np
from pxr import Usd, UsdGeom, UsdSkel, Vt

from usdface.arrays import FloatArray, IntArray
from usdface.certificate.linear_morph import LinearMorph
from usdface.certificate.vertex_offsets import VertexOffsets, moved_part
from usdface.certificate.vertex_transforms import VertexTransforms
from usdface.geometry.vertex_normals import unit_or_zero
from usdface.io.usd.errors import usd_errors
from usdface.io.usd.evaluated_shapes import UsdBlendShapes
from usdface.io.usd.evaluated_skin import UsdSkin, normal_matrix
from usdface.io.usd.metrics import metrics_of, to_si
from usdface.io.usd.prim_walks import lineage
from usdface.io.usd.rendered_meshes import (
    outside_meshes,
    placed_meshes,
    placed_roots,
    rendered_meshes,
)
from usdface.io.usd.vertex_cache import points_move
from usdface.io.usd.world_transforms import transform_codes, world_transform

__all__ = ["UsdMesh", "evaluate_usd", "has_keys", "stage_keys"]

_ALIKE = 1e-9  # of transforms, in stage units
_ALL = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)


@dataclass(frozen=True, eq=False, slots=True)
class UsdMesh:
    """One mesh under a SkelRoot.

    Attributes
    ----------
    name : str
    shapes : tuple of str, length S
    used : (N,) int64
        Points that a face uses; only these are shown.
    """

    name: str
    shapes: tuple[str, ...]
    used: IntArray
    _mesh: UsdGeom.Mesh
    _bound: UsdSkin | None
    _deformer: UsdBlendShapes
    _si: FloatArray

    @property
    def points_move(self) -> bool:
        """Whether its points change over time."""
        return points_move(self._mesh)

    def with_influences(self, most: int) -> "UsdMesh | None":
        """Return it with the `most` strongest joints at each point; None if none has more."""
        bound = self._bound
        if bound is None or not 0 < most < bound.skinning.GetNumInfluencesPerComponent():
            return None
        return replace(self, _bound=replace(bound, most=most))

    def weights_at(self, codes: FloatArray) -> FloatArray:
        """Return the weights (F, S) of the shapes at time codes (F,)."""
        return np.array([self._weights(c) for c in codes], float).reshape(len(codes), -1)

    def points_at(self, codes: FloatArray) -> FloatArray:
        """Return the points (F, N, 3) [m], Y up, in the world at time codes (F,)."""
        return np.stack([self._points(float(code)) for code in codes])

    def normals_at(self, codes: FloatArray) -> FloatArray | None:
        """Return unit normals (F, N, 3), Y up; None where USD does not deform vertex normals."""
        if not self._deformer.turns_normals:
            return None
        return np.stack([self._normals(float(code)) for code in codes])

    def linear_morph_at(self, codes: FloatArray) -> LinearMorph | None:
        """Return the mesh at `codes` (F,) as a linear morph of sub-shapes that UsdSkel computes.

        None where its points change, or the transforms of joints are not all that skins it.
        """
        held = self._mesh.GetPointsAttr(), self._mesh.GetNormalsAttr()
        if any(attribute.ValueMightBeTimeVarying() for attribute in held):
            return None
        space, moves = self._space(float(codes[0]))
        turning = self._turned_by(moves, float(codes[0])) @ normal_matrix(space)
        motion = None
        if self._moves() or not np.isfinite(turning).all():
            motion = self._motion(codes)
            if motion is None:
                return None
            space, moves, turning = np.eye(4), None, np.eye(3)
        still = np.zeros((len(self._mesh.GetPointsAttr().Get(_START)), 3), np.float32)

        def shown(points: Vt.Vec3fArray) -> FloatArray:
            if self._bound is not None and moves is not None:
                self._bound.skin_points(points, moves, float(codes[0]))
            return np.array(points, np.float64)[self.used] @ space[:3, :3]

        nowhere = shown(Vt.Vec3fArray.FromNumpy(still))
        count = self._deformer.count
        parts = self._offsets(shown(self._deformer.part(k, still)) - nowhere for k in range(count))
        weights = self._deformer.weights(self.weights_at(codes))
        points = self._points(float(codes[0]), posed=False, placed=motion is None)
        if not self._deformer.turns_normals:
            return LinearMorph(weights, points, parts, motion=motion)
        turns = self._offsets(
            np.array(self._deformer.part(k, still, turning=True))[self.used] @ turning
            for k in range(count)
        )
        normals = np.array(self._mesh.GetNormalsAttr().Get(_START), np.float64)[self.used]
        return LinearMorph(weights, points, parts, normals @ turning, turns, motion)

    def _offsets(self, shapes: Iterable[FloatArray]) -> VertexOffsets:
        """Keep the rows of offsets (N, 3) of each shape that are not zero."""
        return VertexOffsets.of(len(self.used), map(moved_part, shapes))

    def _motion(self, codes: FloatArray) -> VertexTransforms | None:
        """Return the motion of the used points by joints, or by one transform."""
        bound = self._bound
        if bound is not None and not bound.rigid and bound.moves(float(codes[0])) is not None:
            count = len(self._mesh.GetPointsAttr().Get(_START))
            return bound.vertex_transforms(codes, self._si, count, self.used)
        spaces = np.stack([self._space(float(code))[0] for code in codes])
        return VertexTransforms.rigid(
            spaces.swapaxes(1, 2)[:, :3], normal_matrix(spaces).swapaxes(1, 2), len(self.used)
        )

    def _turned_by(self, moves: Vt.Matrix4dArray | None, code: float) -> FloatArray:
        """Return the matrix (3, 3) by which a skin turns all normals; NaN where there is none."""
        if self._bound is None or moves is None or not self._deformer.turns_normals:
            return np.eye(3)
        joints = np.array(moves, np.float64)
        if np.ptp(joints, axis=0).max() > _ALIKE:
            return np.full((3, 3), np.nan)
        bound = np.array(self._bound.skinning.GetGeomBindTransform(code))
        return normal_matrix(bound) @ normal_matrix(joints[0])

    def _moves(self) -> bool:
        """Whether anything but blend shapes may move the mesh."""
        mesh, bound = self._mesh, self._bound
        prims = [*lineage(mesh.GetPrim())]
        joints = False
        if bound is not None:
            prims += lineage(bound.prim)
            animation = bound.skeleton.GetAnimQuery()
            joints = (
                bool(animation)
                and bound.skinning.HasJointInfluences()
                and animation.JointTransformsMightBeTimeVarying()
            )
        placed = (UsdGeom.Xformable(prim) for prim in prims)
        return joints or any(xform and xform.TransformMightBeTimeVarying() for xform in placed)

    def _weights(self, code: float) -> Vt.FloatArray:
        weights = self._bound.weights(code) if self._bound else None
        return Vt.FloatArray(len(self.shapes)) if weights is None else weights

    def _space(self, code: float) -> tuple[FloatArray, Vt.Matrix4dArray | None]:
        """Return the space (4, 4) of the points, and the transforms of joints that skin them."""
        moves = self._bound.moves(code) if self._bound else None
        stands = self._mesh.GetPrim()
        if self._bound is not None and moves is not None:
            stands = self._bound.prim
        space = world_transform(stands, code) @ self._si
        if self._bound is not None and moves is not None and self._bound.rigid:
            return np.array(self._bound.skinning.ComputeSkinnedTransform(moves, code)) @ space, None
        return space, moves

    def _points(self, code: float, posed: bool = True, placed: bool = True) -> FloatArray:
        points = self._mesh.GetPointsAttr().Get(code)
        if not placed:
            return np.array(points, np.float64)[self.used]
        if posed:
            self._deformer.move(points, self._weights(code))
        space, moves = self._space(code)
        if self._bound is not None and moves is not None:
            self._bound.skin_points(points, moves, code)
        return np.asarray(np.array(points)[self.used] @ space[:3, :3] + space[3, :3], np.float64)

    def _normals(self, code: float) -> FloatArray:
        normals = self._mesh.GetNormalsAttr().Get(code)
        self._deformer.turn(normals, self._weights(code))
        space, moves = self._space(code)
        if self._bound is not None and moves is not None:
            self._bound.skin_normals(normals, moves, code)
        turned = np.array(normals, np.float64)[self.used] @ normal_matrix(space)
        return unit_or_zero(turned)


_START = Usd.TimeCode.EarliestTime()


def evaluate_usd(stage: Usd.Stage, purposes: Collection[str] = ()) -> tuple[UsdMesh, ...]:
    """Return the meshes with faces, those under SkelRoots first, for evaluation by UsdSkel.

    Those that a render shows, and those of `purposes`.

    Raises
    ------
    InputError
        If USD reports an error.
    """
    with usd_errors(stage.GetRootLayer().realPath or "the stage"):
        cache = UsdSkel.Cache()
        bound: dict[Usd.Prim, UsdSkin] = {}
        prims: dict[Usd.Prim, None] = {}
        for root in placed_roots(stage.GetPseudoRoot()):
            cache.Populate(UsdSkel.Root(root), _ALL)
            prims |= dict.fromkeys(placed_meshes(root))
            for binding in cache.ComputeSkelBindings(UsdSkel.Root(root), _ALL):
                query = cache.GetSkelQuery(binding.GetSkeleton())
                prim = binding.GetSkeleton().GetPrim()
                for target in binding.GetSkinningTargets():
                    bound[target.GetPrim()] = UsdSkin(target, query, prim)
        prims |= dict.fromkeys(outside_meshes(stage))
        si = to_si(metrics_of(stage))
        meshes = []
        for prim in rendered_meshes(prims, purposes)[0]:
            used = np.unique(UsdGeom.Mesh(prim).GetFaceVertexIndicesAttr().Get(_START) or [])
            if len(used):
                inside = UsdSkel.Root.Find(prim)
                tokens = (inside and UsdSkel.BindingAPI(prim).GetBlendShapesAttr().Get()) or ()
                meshes.append(
                    UsdMesh(
                        prim.GetDisplayName() or prim.GetName(),
                        tuple(map(str, tokens)),
                        used.astype(np.int64),
                        UsdGeom.Mesh(prim),
                        bound.get(prim),
                        UsdBlendShapes(prim),
                        si,
                    )
                )
    return tuple(meshes)


def stage_keys(stage: Usd.Stage) -> tuple[str, FloatArray, FloatArray]:
    """Return the name of the SkelAnimation that plays, its time codes (F,), and times (F,) [s].

    Time 0 is the stage's start time code where it has one before the first sample, else that
    sample. Without animation there is one code, the start.
    """
    metrics = metrics_of(stage)
    name, keys = _keys(stage)
    if not keys:
        return name, np.array([metrics.start]), np.zeros(1)
    codes = np.array(sorted(keys), np.float64)
    start = min(metrics.start, codes[0]) if stage.HasAuthoredTimeCodeRange() else codes[0]
    return name, codes, (codes - start) / metrics.time_codes_per_second


def has_keys(stage: Usd.Stage) -> bool:
    """Whether anything on a stage has samples over time."""
    return bool(_keys(stage)[1])


def _keys(stage: Usd.Stage) -> tuple[str, set[float]]:
    cache = UsdSkel.Cache()
    name, keys = "", set[float]()
    for root in placed_roots(stage.GetPseudoRoot()):
        cache.Populate(UsdSkel.Root(root), _ALL)
        for prim in (*lineage(root.GetParent()), *Usd.PrimRange(root, _ALL)):
            keys |= _own_keys(prim)
        for binding in cache.ComputeSkelBindings(UsdSkel.Root(root), _ALL):
            query = cache.GetSkelQuery(binding.GetSkeleton()).GetAnimQuery()
            if query:
                prim = query.GetPrim()
                name = name or prim.GetDisplayName() or prim.GetName()
                keys |= {*query.GetBlendShapeWeightTimeSamples()}
                keys |= {*query.GetJointTransformTimeSamples()}
    for prim in outside_meshes(stage):
        for part in lineage(prim):
            keys |= _own_keys(part)
    return name, keys


def _own_keys(prim: Usd.Prim) -> set[float]:
    """Return the time codes of the keys of the transform and the points of a prim."""
    keys = set[float]()
    xform, mesh = UsdGeom.Xformable(prim), UsdGeom.Mesh(prim)
    if xform and xform.TransformMightBeTimeVarying():
        keys |= {*transform_codes(xform)}
    if mesh and points_move(mesh):
        keys |= {*mesh.GetPointsAttr().GetTimeSamples()}
    return keys
