"""The skin of one mesh, computed by UsdSkel itself."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Gf, Usd, UsdSkel, Vt

from usdface.arrays import FloatArray, IntArray
from usdface.certificate.vertex_transforms import VertexTransforms
from usdface.io.usd.world_transforms import world_transform

__all__ = ["UsdSkin", "normal_matrix"]


@dataclass(frozen=True, eq=False, slots=True)
class UsdSkin:
    """How UsdSkel binds one mesh; where `most` is not 0, by that many joints at each point.

    The skeleton stands at `prim`; that of the query is one that all instances share.
    """

    skinning: UsdSkel.SkinningQuery
    skeleton: UsdSkel.SkeletonQuery
    prim: Usd.Prim
    most: int = 0

    @property
    def rigid(self) -> bool:
        """Whether one transform places all of its points."""
        return not self.most and bool(self.skinning.IsRigidlyDeformed())

    def influences(self, count: int, code: float) -> tuple[Vt.IntArray, Vt.FloatArray, int]:
        """Return joints and weights of `count` points, and how many each has."""
        joints, weights = self.skinning.ComputeVaryingJointInfluences(count, code)
        width = self.skinning.GetNumInfluencesPerComponent()
        if not 0 < self.most < width:
            return joints, weights, width
        order = Vt.IntArray(range(len(self.skeleton.GetJointOrder())))
        kept = _strongest(
            np.array(joints, np.int64).reshape(count, width),
            np.array(weights, np.float64).reshape(count, width),
            np.array(self.mapped(order), np.int64),
            self.most,
        )
        return Vt.IntArray.FromNumpy(kept[0]), Vt.FloatArray.FromNumpy(kept[1]), self.most

    def weights(self, code: float) -> Vt.FloatArray | None:
        """Return the weights of the mesh's shapes; None where nothing moves them."""
        animation = self.skeleton.GetAnimQuery()
        weights = animation.ComputeBlendShapeWeights(code) if animation else None
        if weights is None or not self.skinning.HasBlendShapes():
            return None
        mapper = self.skinning.GetBlendShapeMapper()
        return weights if mapper is None else mapper.Remap(weights)

    def moves(self, code: float) -> Vt.Matrix4dArray | None:
        """Return the transforms of the skeleton's joints; None where no joint moves the mesh."""
        if not self.skinning.HasJointInfluences() or not len(self.skeleton.GetJointOrder()):
            return None
        return self.skeleton.ComputeSkinningTransforms(code)

    def mapped(self, moves: Any) -> Any:
        """Return an array of the joints in the mesh's own order; UsdSkel does so for points."""
        mapper = self.skinning.GetJointMapper()
        return moves if mapper is None else mapper.Remap(moves)

    def skin_points(self, points: Vt.Vec3fArray, moves: Vt.Matrix4dArray, code: float) -> None:
        """Move points with the joints, in place."""
        if not self.most:
            self.skinning.ComputeSkinnedPoints(moves, points, code)
            return
        UsdSkel.SkinPoints(
            self.skinning.GetSkinningMethod(),
            self.skinning.GetGeomBindTransform(code),
            self.mapped(moves),
            *self.influences(len(points), code),
            points,
        )

    def skin_normals(self, normals: Vt.Vec3fArray, moves: Vt.Matrix4dArray, code: float) -> None:
        """Turn normals with the joints, in place."""
        turns = normal_matrix(np.array(self.mapped(moves)))
        UsdSkel.SkinNormals(
            self.skinning.GetSkinningMethod(),
            _matrix3(normal_matrix(np.array(self.skinning.GetGeomBindTransform(code)))),
            Vt.Matrix3dArray.FromNumpy(turns),
            *self.influences(len(normals), code),
            normals,
        )

    def vertex_transforms(
        self, codes: FloatArray, si: FloatArray, count: int, used: IntArray
    ) -> VertexTransforms | None:
        """Return the motion of the points `used` (N,) of `count` at time codes (F,).

        `si` (4, 4) takes the stage's space to metres and Y up. None where it is not linear in the
        transforms of joints, or the influences change.
        """
        skinning = self.skinning
        primvars = skinning.GetJointIndicesPrimvar(), skinning.GetJointWeightsPrimvar()
        if skinning.GetSkinningMethod() != UsdSkel.Tokens.classicLinear or any(
            primvar.ValueMightBeTimeVarying() for primvar in primvars
        ):
            return None
        at = [float(code) for code in codes]
        # (F, 1, 4, 4), (F, J, 4, 4) and (F, 1, 4, 4), for row vectors
        binds = np.array([skinning.GetGeomBindTransform(code) for code in at], float)[:, None]
        joints = np.array([self.mapped(self.moves(code)) for code in at], float)
        space = np.stack([world_transform(self.prim, code) @ si for code in at])
        space = space[:, None]
        placed = binds @ joints
        # The space itself is a joint that holds all: weights need not add up to 1.
        transforms = np.zeros((len(at), joints.shape[1] + 1, 3, 4))
        transforms[:, :-1] = (placed[..., :3] @ space[..., :3, :3]).swapaxes(-1, -2)
        transforms[:, -1, :, 3] = space[:, 0, 3, :3]
        turns = np.zeros((*transforms.shape[:2], 3, 3))
        normals = normal_matrix(binds) @ normal_matrix(joints) @ normal_matrix(space)
        turns[:, :-1] = normals.swapaxes(-1, -2)
        held, weights, _ = self.influences(count, float(codes[0]))
        indices = np.array(held, np.int64).reshape(count, -1)[used]
        values = np.array(weights, np.float64).reshape(count, -1)[used]
        space_itself = np.full((len(used), 1), transforms.shape[1] - 1)
        return VertexTransforms.of(
            transforms,
            turns,
            np.concatenate([indices, space_itself], 1),
            np.concatenate([values, np.ones((len(used), 1))], 1),
        )


def normal_matrix(matrix: FloatArray) -> FloatArray:
    """Return the matrices (..., 3, 3) that turn normals where (..., 4, 4) move points."""
    linear = matrix[..., :3, :3]
    flat = np.abs(np.linalg.det(linear)) < 1e-30  # scaled to nothing: there is no normal to see
    turns = np.linalg.inv(np.where(flat[..., None, None], np.eye(3), linear)).swapaxes(-1, -2)
    return np.ascontiguousarray(turns, np.float64)


def _strongest(
    joints: IntArray, weights: FloatArray, order: IntArray, most: int
) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """Return the `most` strongest joints of points (V, K), and weights that sum to 1, in a row.

    A joint that a point names twice counts as one. Of equally strong ones those come first that
    the skeleton has first; `order` (J,) is the place of each joint there.
    """
    point = np.repeat(np.arange(len(joints)), joints.shape[1])
    named = np.unique(point * len(order) + joints.ravel(), return_inverse=True)
    strength = np.bincount(named[1].ravel(), weights.clip(min=0).ravel())
    point, joint = np.divmod(named[0], len(order))
    ranked = np.lexsort((order[joint], -strength, point))
    point, joint, strength = point[ranked], joint[ranked], strength[ranked]
    rank = np.arange(len(point)) - np.searchsorted(point, point)
    kept = rank < most
    held, share = np.zeros((len(joints), most), np.int32), np.zeros((len(joints), most))
    place = point[kept], rank[kept]
    held[place], share[place] = joint[kept], strength[kept]
    share[~share.any(axis=1), 0] = 1.0  # as nothing holds the point
    share /= share.sum(axis=1, keepdims=True)
    return held.ravel(), share.ravel().astype(np.float32)


def _matrix3(matrix: FloatArray) -> Gf.Matrix3d:
    return Gf.Matrix3d(*matrix.ravel().tolist())
