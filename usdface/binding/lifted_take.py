"""A take of an image in space: each marker at the depth that its name has on the rig's face.

An image has no depth, but a marker whose name tells its place has that of the face there. A camera
far away, scaled orthography, is fitted to these places in each frame; markers keep where they are
in the image, and depth follows the head. That is enough to find where they sit, and no more:
motion towards the camera is not in it.
"""

from dataclasses import dataclass, replace

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.binding.face_surface import FaceSurface
from usdface.binding.landmarks import find_landmarks
from usdface.binding.name_priors import FEWEST_NAMED, name_priors
from usdface.errors import InputError
from usdface.takes import MarkerTake

__all__ = ["lifted_take"]

# Degrees of freedom of the Student-t errors of names, and rounds of weighting by them, as in
# `usdface.binding.name_priors`.
_DEGREES_OF_FREEDOM, _ROUNDS = 4.0, 12
# Weight of names with more than one place in the first round: they follow the others.
_OPEN = 1e-3
# Depths that vary by less than this share of the width, squared, determine no turn: rounding.
_FLAT = 1e-9
# Fewer visible markers determine no camera: its 8 numbers need 4, with one to spare. Nor do those
# of a part of the face, as a mouth below an occluded brow: fewer than this share of the fullest
# frame's. Set by hand.
_FEWEST_VISIBLE, _LEAST_SHARE = 5, 0.5


def lifted_take(
    take: MarkerTake, surface: FaceSurface, given: FloatArray | None = None
) -> MarkerTake:
    """Return a take of an image in space [m], without the markers that have no known place.

    Parameters
    ----------
    take : MarkerTake
        Of an image.
    surface : FaceSurface
        Of the rig.
    given : (M, 3) float64 [m], optional
        Places that are known otherwise; NaN = by the name.

    Raises
    ------
    InputError
        If too few names tell a place, or the rig's blend shapes move no lips or no lids.
    """
    landmarks = find_landmarks(surface)
    priors = name_priors(take.names, landmarks) if landmarks else None
    if priors is None:
        raise InputError(
            f"the take {take.source} is of an image; where its markers sit can be proposed only by "
            f"names that tell the places of {FEWEST_NAMED} (left_mouth_corner, chin, landmark_30), "
            "on a rig with lips that part and lids that close. Place them on the page of `usdface "
            "bind`, or give all in --bind bind.json",
            "TAKE_KIND_WRONG",
        )
    places = np.full((len(take.names), 3), np.nan) if given is None else given
    fixed = ~np.isnan(places[:, 0])
    used = np.flatnonzero(fixed | priors.known)
    sides = (each.at(fixed, places) for each in (priors, priors.mirrored()))
    views = [_view(take.positions[:, used], s.points[used], s.spreads[used]) for s in sides]
    # A mirrored face would be seen from behind.
    facing = views[0] if views[0].facing >= views[1].facing else views[1]
    return replace(
        take,
        names=tuple(take.names[i] for i in used),
        positions=facing.positions,
        image_size=None,
        focal_length=0.0,
        diameters=None,
        deviation=0.0,
    )


@dataclass(frozen=True, eq=False, slots=True)
class _View:
    """Markers in space (F, M, 3) [m], and how far the face looks into the camera (cosine)."""

    positions: FloatArray
    facing: float


def _view(image: FloatArray, places: FloatArray, spreads: FloatArray) -> _View:
    """Lift markers (F, M, 2) [px] to the depth of their `places` (M, A, 3) [m].

    By iteratively reweighted least squares: names that are far off have less weight, and one with
    several places is at the nearest.
    """
    seen = ~np.isnan(image[..., 0])
    count = seen.sum(axis=1, keepdims=True)
    seen &= count >= max(_FEWEST_VISIBLE, _LEAST_SHARE * count.max(initial=0))
    rows = np.arange(len(places))
    points, several = places[:, 0], ~np.isnan(places[:, 1:, 0]).all(axis=1)
    weights = np.where(several, _OPEN, 1.0)
    for _ in range(_ROUNDS):
        turns, flat = _camera(image, seen, points, weights / spreads**2)
        # (F, M, A): NaN for places that a name does not have.
        mapped = np.einsum("fij,maj->fmai", turns[:, :2], places)
        apart = ((mapped - flat[:, :, None]) ** 2).sum(axis=3)
        total = np.where(seen[..., None], apart, 0.0).sum(axis=0)
        squared = np.nan_to_num(total / np.maximum(seen.sum(axis=0), 1)[:, None], nan=np.inf)
        points = places[rows, squared.argmin(axis=1)]
        weights = 1.0 / (1.0 + squared.min(axis=1) / spreads**2 / _DEGREES_OF_FREEDOM)
    depths = np.einsum("fj,mj->fm", turns[:, 2], points)[..., None]
    lifted = np.where(seen[..., None], np.concatenate([flat, depths], axis=2), np.nan)
    return _View(lifted, float(np.nanmedian(turns[:, 2, 2])))


def _camera(
    image: FloatArray, seen: BoolArray, points: FloatArray, weights: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Fit a scaled orthographic camera in each frame.

    Returns
    -------
    (F, 3, 3) float64
        Rotations of the head; NaN in frames that show too few markers.
    (F, M, 2) float64 [m]
        The markers as seen, in the unit and from the origin of `points`.
    """
    share = np.where(seen, weights, 0.0)
    known = np.where(seen[..., None], image, 0.0)
    basis = np.column_stack([points, np.ones(len(points))])
    normal = np.einsum("fm,mi,mj->fij", share, basis, basis, optimize=True)
    right = np.einsum("fm,mi,fmk->fik", share, basis, known, optimize=True)
    enough = seen.any(axis=1)
    affine = np.full((len(image), 4, 2), np.nan)
    affine[enough] = np.linalg.pinv(normal[enough], rcond=_FLAT, hermitian=True) @ right[enough]
    turns, scales = np.full((len(image), 3, 3), np.nan), np.full(len(image), np.nan)
    u, lengths, vt = np.linalg.svd(affine[enough, :3].transpose(0, 2, 1), full_matrices=False)
    across = u @ vt
    turns[enough] = np.stack(
        [across[:, 0], across[:, 1], np.cross(across[:, 0], across[:, 1])], axis=1
    )
    scales[enough] = lengths.mean(axis=1)
    flat = (image - affine[:, 3:]) / scales[:, None, None]
    return turns, flat
