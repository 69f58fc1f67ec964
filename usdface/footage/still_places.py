"""Places of dots without the head's motion in the image."""

import numpy as np

from usdface.arrays import FloatArray
from usdface.footage.similarity import fit_similarity

__all__ = ["median_visible", "still_places"]


def still_places(places: FloatArray) -> FloatArray:
    """Return places (F, M, 2) without the head's motion in the image."""
    home = median_visible(places)
    still = np.full_like(places, np.nan)
    for _ in range(2):
        for frame, row in enumerate(places):
            seen = ~np.isnan(row[:, 0]) & ~np.isnan(home[:, 0])
            still[frame] = fit_similarity(row[seen], home[seen])(row)
        home = median_visible(still)
    return still


def median_visible(values: FloatArray) -> FloatArray:
    """Return the median (M, 2) of (F, M, 2) over the frames that are not NaN; NaN if all are."""
    result = np.full(values.shape[1:], np.nan)
    ever = ~np.isnan(values[..., 0]).all(axis=0)
    if ever.any():
        result[ever] = np.nanmedian(values[:, ever], axis=0)
    return result
