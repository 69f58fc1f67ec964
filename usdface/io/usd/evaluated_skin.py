"""The skin of one mesh, computed by UsdSkel itself."""

from dataclasses import dataclass

import numpy as np
from pxr import Gf, UsdSkel, Vt

from usdface.arrays import FloatArray, IntArray
from usdface.certificate.joint_motion import JointMotion
from usdface.io.usd.world_transforms import world_transform

__all__ = ["UsdSkin", "normal_matrix"]


@dataclass(frozen=True, eq=False, slots=True)
class UsdSkin:
    """How UsdSkel binds one mesh."""

    skinning: UsdSkel.SkinningQuery
    skeleton: UsdSkel.SkeletonQuery

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

    def mapped(self, moves: Vt.Matrix4dArray | None) -> Vt.Matrix4dArray:
        """Return transforms in the mesh's own order of joints; UsdSkel does so for points."""
        mapper = self.skinning.GetJointMapper()
        return moves if mapper is None else mapper.Remap(moves)

    def skin_normals(self, normals: Vt.Vec3fArray, moves: Vt.Matrix4dArray, code: float) -> None:
        """Turn normals with the joints, in place."""
        turns = normal_matrix(np.array(self.mapped(moves)))
        UsdSkel.SkinNormals(
            self.skinning.GetSkinningMethod(),
            _matrix3(normal_matrix(np.array(self.skinning.GetGeomBindTransform(code)))),
            Vt.Matrix3dArray.FromNumpy(turns),
            *self.skinning.ComputeVaryingJointInfluences(len(normals), code),
            self.skinning.GetNumInfluencesPerComponent(),
            normals,
        )

    def joint_motion(
        self, codes: FloatArray, si: FloatArray, count: int, used: IntArray
    ) -> JointMotion | None:
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
        space = np.stack([world_transform(self.skeleton.GetPrim(), code) @ si for code in at])
        space = space[:, None]
        placed = binds @ joints
        # The space itself is a joint that holds all: weights need not add up to 1.
        transforms = np.zeros((len(at), joints.shape[1] + 1, 3, 4))
        transforms[:, :-1] = (placed[..., :3] @ space[..., :3, :3]).swapaxes(-1, -2)
        transforms[:, -1, :, 3] = space[:, 0, 3, :3]
        turns = np.zeros((*transforms.shape[:2], 3, 3))
        normals = normal_matrix(binds) @ normal_matrix(joints) @ normal_matrix(space)
        turns[:, :-1] = normals.swapaxes(-1, -2)
        held, weights = skinning.ComputeVaryingJointInfluences(count, float(codes[0]))
        indices = np.array(held, np.int64).reshape(count, -1)[used]
        values = np.array(weights, np.float64).reshape(count, -1)[used]
        space_itself = np.full((len(used), 1), transforms.shape[1] - 1)
        return JointMotion.of(
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


def _matrix3(matrix: FloatArray) -> Gf.Matrix3d:
    return Gf.Matrix3d(*matrix.ravel().tolist())
