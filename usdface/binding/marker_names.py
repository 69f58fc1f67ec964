"""What marker names tell of a face: how high on it a marker is.

Up and down are all that is asked of names. Left and right follow from up and front, and are
told as the performer's by some and as the beholder's by others.
"""

from collections.abc import Sequence

import numpy as np

from usdface.arrays import FloatArray

__all__ = ["named_heights"]

# Words in names, the more telling first, and how high they are between chin (-1) and forehead (1).
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
_FEWEST = 5


def named_heights(names: Sequence[str]) -> FloatArray:
    """Return how high each marker is by its name: (M,), NaN where the name does not say.

    All NaN where the names say too little to be believed.

    >>> named_heights(("ForeHead_M", "Chin_R1", "Leyebrow_M", "m4", "Mouth_Up", "NoseTop"))
    array([ 1.  , -1.  ,  0.7 ,   nan, -0.45,  0.1 ])
    """
    found = [
        next((h for word, h in _HEIGHTS.items() if word in name.lower()), np.nan) for name in names
    ]
    heights = np.array(found, dtype=np.float64)
    known = heights[~np.isnan(heights)]
    if len(known) < _FEWEST or len(np.unique(known)) < 3:
        return np.full(len(names), np.nan)
    return heights
