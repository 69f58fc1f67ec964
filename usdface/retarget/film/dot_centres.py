"""Offsets of the imaged centres of painted dots from the mean of the skin under them."""

import numpy as np
from scipy.sparse import csr_array

from usdface.arrays import FloatArray
from usdface.face.dot_skin import DotSkin
from usdface.geometry.rigid_fit import Pose
from usdface.numerics.frame_blocks import by_blocks
from usdface.retarget.film.one_camera import PinholeCamera

__all__ = ["dot_centre_offsets", "foreshortening"]


def dot_centre_offsets(
    skin: DotSkin, weights: FloatArray, pose: Pose, camera: PinholeCamera
) -> FloatArray:
    """Return the offset of each dot's centre from the image of its skin's mean: (F, B, 2) [px].

    The centre is the centroid, in the image, of all parts that face the camera; occlusion is
    ignored. 0 for a dot without skin, or of which nothing faces the camera.

    Parameters
    ----------
    skin : DotSkin
    weights : (F, S) float64
        Of its evaluator.
    pose : Pose
        Of the head in camera space.
    camera : PinholeCamera
    """
    owners = _owners(skin)

    def beside(block: slice) -> FloatArray:
        placed = _placed(skin, weights[block], pose, block)
        corners = placed[:, skin.triangles]
        areas = skin.shares * np.maximum(_image_areas(corners, camera), 0.0)
        middles = camera.image(np.einsum("nk,fnkd->fnd", skin.centroids, corners))
        whole = areas @ owners
        sums = np.stack([(areas * middles[..., k]) @ owners for k in range(2)], axis=-1)
        means = camera.image(np.einsum("bv,fvd->fbd", skin.means, placed, optimize=True))
        is_visible = whole[..., None] > 0.0
        return np.where(is_visible, sums / np.where(is_visible, whole[..., None], 1.0) - means, 0.0)

    return by_blocks(len(weights), beside)


def foreshortening(
    skin: DotSkin, weights: FloatArray, pose: Pose, camera: PinholeCamera
) -> FloatArray:
    """Return the share of each dot's area that its slant leaves in the image: (F, B), 0 to 1.

    1 head on, the cosine of the slant of a flat dot; 1 for a dot without skin. Parameters are those
    of `dot_centre_offsets`.
    """
    owners = _owners(skin)

    def facing(block: slice) -> FloatArray:
        corners = _placed(skin, weights[block], pose, block)[:, skin.triangles]
        across = np.cross(
            corners[..., 1, :] - corners[..., 0, :], corners[..., 2, :] - corners[..., 0, :]
        )
        scale = camera.focal_length / corners[..., 2].mean(axis=-1)  # px per metre
        frontal = (skin.shares * np.linalg.norm(across, axis=-1) * scale**2) @ owners
        shown = (skin.shares * np.maximum(_image_areas(corners, camera), 0.0)) @ owners
        there = frontal > 0.0
        return np.where(there, shown / np.where(there, frontal, 1.0), 1.0).clip(0.0, 1.0)

    return by_blocks(len(weights), facing)


def _owners(skin: DotSkin) -> csr_array:
    """Return the dot (B) that each part (N) belongs to: (N, B)."""
    count, parts = len(skin.bound), len(skin.dots)
    return csr_array((np.ones(parts), (np.arange(parts), skin.dots)), shape=(parts, count))


def _placed(skin: DotSkin, weights: FloatArray, pose: Pose, block: slice) -> FloatArray:
    """Return the vertices of some frames in camera space: (F, V, 3) [m]."""
    moved = skin.evaluator.displacements(weights)
    return np.asarray(pose.at(block).to_take(skin.points + moved.reshape(len(moved), -1, 3)))


def _image_areas(corners: FloatArray, camera: PinholeCamera) -> FloatArray:
    """Return twice the area of triangles (F, N, 3, 3) in the image, below 0 if they face away."""
    a, b, c = (camera.image(corners[:, :, k]) for k in range(3))
    return np.asarray((b - a)[..., 0] * (c - a)[..., 1] - (b - a)[..., 1] * (c - a)[..., 0])
