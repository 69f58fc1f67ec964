"""Heights on a face by marker names.

Only up and down are read from names. Left and right follow from up and front, and are the
performer's to some and the camera's to others.
"""

from collections.abc import Sequence

import numpy as np

from usdface.arrays import FloatArray

__all__ = ["named_heights"]

# Words in names, the more specific first, and their height between chin (-1) and forehead (1), read
# off a face; only the correlation with them counts, so that tenths do not matter.
_HEIGHTS = {
    "forehead": 1.0,
    "brow": 0.7,
    "temple": 0.5,
    "eye": 0.45,
    "lid": 0.45,
    "nose": 0.1,
    "nostril": 0.0,
    "cheek": -0.05,
    "lip": -0.45,
    "mouth": -0.45,
    "jaw": -0.8,
    "chin": -1.0,
}
# Fewer named markers or heights determine no direction: three heights, with two names to spare.
_FEWEST, _FEWEST_HEIGHTS = 5, 3


def named_heights(names: Sequence[str]) -> FloatArray:
    """Return how high each marker is by its name: (M,), NaN where it has no known word.

    All NaN where too few names have one.

    >>> named_heights(("ForeHead_M", "Chin_R1", "Leyebrow_M", "m4", "Mouth_Up", "NoseTop"))
    array([ 1.  , -1.  ,  0.7 ,   nan, -0.45,  0.1 ])
    """
    found = [
        next((h for word, h in _HEIGHTS.items() if word in name.lower()), np.nan) for name in names
    ]
    heights = np.array(found, dtype=np.float64)
    known = heights[~np.isnan(heights)]
    if len(known) < _FEWEST or len(np.unique(known)) < _FEWEST_HEIGHTS:
        return np.full(len(names), np.nan)
    return heights
