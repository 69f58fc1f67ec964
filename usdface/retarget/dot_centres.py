"""Where a camera sees the middles of painted dots, beside the means of the skin under them."""

import numpy as np
from scipy.sparse import csr_array

from usdface.arrays import FloatArray
from usdface.face.dot_skin import DotSkin
from usdface.frame_blocks import by_blocks
from usdface.geometry.rigid_fit import Pose
from usdface.retarget.one_camera import PinholeCamera

__all__ = ["beside_means"]


def beside_means(
    skin: DotSkin, weights: FloatArray, pose: Pose, camera: PinholeCamera
) -> FloatArray:
    """Return how far the middle of each dot is from the image of its skin's mean: (F, B, 2) [px].

    The middle is the centroid, in the image, of all parts that face the camera; what hides them is
    not reckoned with. 0 for a dot without skin, or of which nothing faces the camera.

    Parameters
    ----------
    skin : DotSkin
    weights : (F, S) float64
        Of its evaluator.
    pose : Pose
        Of the head in camera space.
    camera : PinholeCamera
    """
    count, parts = len(skin.bound), len(skin.dots)
    owners = csr_array((np.ones(parts), (np.arange(parts), skin.dots)), shape=(parts, count))

    def beside(block: slice) -> FloatArray:
        moved = skin.evaluator.displacements(weights[block])
        own = Pose(pose.rotations[block], pose.translations[block])
        placed = own.to_take(skin.points + moved.reshape(len(moved), -1, 3))
        corners = placed[:, skin.triangles]
        a, b, c = (camera.image(corners[:, :, k]) for k in range(3))
        facing = (b - a)[..., 0] * (c - a)[..., 1] - (b - a)[..., 1] * (c - a)[..., 0]
        areas = skin.shares * np.maximum(facing, 0.0)
        middles = camera.image(np.einsum("nk,fnkd->fnd", skin.centroids, corners))
        whole = areas @ owners
        sums = np.stack([(areas * middles[..., k]) @ owners for k in range(2)], axis=-1)
        means = camera.image(np.einsum("bv,fvd->fbd", skin.means, placed, optimize=True))
        seen = whole[..., None] > 0.0
        return np.where(seen, sums / np.where(seen, whole[..., None], 1.0) - means, 0.0)

    return by_blocks(len(weights), beside)
