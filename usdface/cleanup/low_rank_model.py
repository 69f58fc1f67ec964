"""A low-rank model of a face's markers, which predicts one from the others.

Most of a face's motion is a few modes (Tipping and Bishop 1999, probabilistic principal
components): still markers are mean + scores @ modes + white noise, the scores Gaussian with the
powers of the modes. The scores of a frame follow from whichever markers it shows, and the
prediction of a marker from all others has a closed form.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray

__all__ = [
    "FRAMES_PER_MODE",
    "LowRankModel",
    "fit_low_rank_model",
    "predict_from_others",
    "reconstruct",
]

# 95 % of a real face's motion are 3 to 7; 8 fill gaps of a second best, 4 those of four seconds.
# As the next two: set by hand; judge: `python benchmarks/cleanup.py`; docs/constants.md lists them.
_MODES = 8
# Frames for each mode at least, or the modes follow single frames instead of the face.
FRAMES_PER_MODE = 8
# Rounds of expectation and maximisation.
_ROUNDS = 6
# Coordinates whose covariance is made, 72 MB; of more, only its largest part is found.
_MANY = 3000
# Frames in one batch: bounds the memory.
_TOGETHER = 4096


@dataclass(frozen=True, eq=False, slots=True)
class LowRankModel:
    """Still markers = mean + scores @ modes + noise.

    Attributes
    ----------
    mean : (M, D) float64
    modes : (K, M, D) float64
        Orthonormal.
    powers : (K,) float64
        Variance of the scores.
    variance : float
        Of the noise, for each coordinate.
    """

    mean: FloatArray
    modes: FloatArray
    powers: FloatArray
    variance: float


def fit_low_rank_model(
    still: FloatArray, seen: BoolArray, filled: FloatArray, rounds: int = _ROUNDS
) -> tuple[LowRankModel, FloatArray]:
    """Fit the model to the entries that are `seen`.

    Parameters
    ----------
    still : (F, M, D) float64
        Markers without the head's motion.
    seen : (F, M) bool
        The entries to learn from; each marker in one frame at least.
    filled : (F, M, D) float64
        A first guess of all entries; only those that are not seen count.
    rounds : int
        Of expectation and maximisation, where something is not seen.

    Returns
    -------
    LowRankModel
    filled : (F, M, D) float64
        `still`, and the model's reconstruction where it is not seen.
    """
    shape, entries = still.shape, seen[..., None]
    filled = np.where(entries, still, filled)
    gappy = np.flatnonzero(~seen.all(axis=1))
    flat = filled.reshape(len(still), -1)
    # About a fixed place, so that frames without gaps are summed once.
    place = flat.mean(axis=0)
    whole = np.delete(flat, gappy, axis=0) - place
    many = flat.shape[1] > _MANY
    total, squares = whole.sum(axis=0), None if many else whole.T @ whole
    count = min(_MODES, len(flat) // FRAMES_PER_MODE, flat.shape[1] - 1)
    for _ in range(rounds if len(gappy) else 1):
        part = flat[gappy] - place
        shift = (total + part.sum(axis=0)) / len(flat)
        mean = place + shift
        if squares is None:
            values, vectors, rest = _largest(flat - mean, count)
        else:
            covariance = (squares + part.T @ part) / len(flat) - np.outer(shift, shift)
            values, vectors = np.linalg.eigh(covariance)
            rest = float(values[: len(values) - count].clip(min=0.0).mean())
        floor = max(rest, 1e-12 * float(values[-1]), 1e-300)
        keep = slice(len(values) - count, None)
        powers = np.maximum(values[keep] - floor, 1e-3 * floor)
        modes = vectors[:, keep].T.reshape(-1, *shape[1:])
        model = LowRankModel(mean.reshape(shape[1:]), modes, powers, floor)
        if len(gappy):
            predicted = reconstruct(model, filled[gappy], seen[gappy])
            filled[gappy] = np.where(entries[gappy], still[gappy], predicted)
    return model, filled


def _largest(away: FloatArray, count: int) -> tuple[FloatArray, FloatArray, float]:
    """Return the largest variances (K,), their directions (N, K), and the mean of the others.

    Of `away` (F, N) from the mean, by products with it: no matrix of all pairs of coordinates.
    """
    from scipy.sparse.linalg import LinearOperator, eigsh  # few takes need it

    frames, size = away.shape
    total, wanted = float((away**2).sum()) / frames, max(count, 1)
    if not total:  # nothing moves
        return np.zeros(wanted), np.eye(size, wanted), 0.0
    covariance = LinearOperator(
        (size, size), matvec=lambda v: away.T @ (away @ v.ravel()) / frames, dtype=np.float64
    )
    # The start is fixed, so that the answer is.
    values, vectors = eigsh(covariance, wanted, v0=away[np.abs(away).sum(axis=1).argmax()])
    order = np.argsort(values)
    values, vectors = values[order].clip(min=0.0), vectors[:, order]
    kept = float(values[len(values) - count :].sum())
    return values, vectors, max(total - kept, 0.0) / (size - count)


def reconstruct(model: LowRankModel, still: FloatArray, seen: BoolArray) -> FloatArray:
    """Reconstruct each marker from all that are visible.

    Parameters
    ----------
    model : LowRankModel
    still : (F, M, D) float64
    seen : (F, M) bool
        Markers to reconstruct from.

    Returns
    -------
    (F, M, D) float64
        The markers of the most probable scores.
    """
    predicted = np.empty_like(still)
    for rows, spread, mine in _spreads(model, seen):
        predicted[rows] = model.mean + _explained(model, still[rows], seen[rows], spread[mine])
    return predicted


def predict_from_others(model: LowRankModel, still: FloatArray, seen: BoolArray) -> FloatArray:
    """Predict each marker from all others that are visible.

    Parameters and result are those of `reconstruct`.
    """
    predicted = np.empty_like(still)
    eye = np.eye(still.shape[2])
    for rows, spread, mine in _spreads(model, seen):
        here = seen[rows][..., None]
        away = np.where(here, still[rows] - model.mean, 0.0)
        explained = _explained(model, still[rows], seen[rows], spread[mine])
        # (I - H)^-1 of the residual is that of the leave-one-out prediction (H the hat matrix).
        part = np.einsum("ukl,lme->ukme", spread, model.modes)
        own = np.einsum("kmd,ukme->umde", model.modes, part) / model.variance
        factor = np.linalg.inv(eye - own)
        left = np.einsum("fmde,fme->fmd", factor[mine], away - explained)
        predicted[rows] = model.mean + np.where(here, away - left, explained)
    return predicted


def _explained(
    model: LowRankModel, still: FloatArray, seen: BoolArray, spread: FloatArray
) -> FloatArray:
    away = np.where(seen[..., None], still - model.mean, 0.0).reshape(len(still), -1)
    modes = model.modes.reshape(len(model.modes), away.shape[1])
    pulls = away @ modes.T / model.variance
    scores = np.einsum("fkl,fl->fk", spread, pulls)
    return np.asarray((scores @ modes).reshape(still.shape))


def _spreads(
    model: LowRankModel, seen: BoolArray
) -> Iterator[tuple[IntArray, FloatArray, IntArray]]:
    """Yield frames, posterior covariances of scores by visible markers, and each frame's."""
    says = np.einsum("kmd,lmd->mkl", model.modes, model.modes) / model.variance
    order, which = _by_pattern(seen)
    for start in range(0, len(order), _TOGETHER):
        rows, mine = order[start : start + _TOGETHER], which[start : start + _TOGETHER]
        _, examples = np.unique(mine, return_index=True)
        precision = np.tensordot(seen[rows[examples]].astype(np.float64), says, 1)
        spread = np.linalg.inv(precision + np.diag(1.0 / model.powers))
        yield rows, spread, mine - mine[0]


def _by_pattern(seen: BoolArray) -> tuple[IntArray, IntArray]:
    """Order frames by which markers they show; return the order and each place's pattern."""
    # As few words a frame: numpy's own unique compares rows marker by marker.
    packed = np.packbits(seen, axis=1)
    words = np.zeros((len(seen), -(-packed.shape[1] // 8) * 8), dtype=np.uint8)
    words[:, : packed.shape[1]] = packed
    keys = words.view(np.uint64)
    order = np.lexsort(keys.T)
    changes = (keys[order[1:]] != keys[order[:-1]]).any(axis=1)
    return order, np.concatenate([[0], np.cumsum(changes)])
