"""Head motion in the image: a robust fit of shift, rotation and scale to the dots."""

from dataclasses import dataclass

import numpy as np

from usdface.arrays import FloatArray

__all__ = ["IDENTITY", "Similarity", "fit_similarity"]

# Rounds of rejecting outliers, and their least distance in median distances.
_ROUNDS, _OFF = 3, 2.5


@dataclass(frozen=True, slots=True)
class Similarity:
    """x -> factor * x + shift, with image places as complex numbers.

    Attributes
    ----------
    factor : complex
        Scale and turn.
    shift : complex [px]
    """

    factor: complex
    shift: complex

    def __call__(self, places: FloatArray) -> FloatArray:
        """Return the moved places (..., 2)."""
        moved = self.factor * _complex(places) + self.shift
        return np.stack([moved.real, moved.imag], axis=-1)


IDENTITY = Similarity(1.0 + 0.0j, 0.0j)


def fit_similarity(before: FloatArray, after: FloatArray) -> Similarity:
    """Fit the motion that takes places (N, 2) to others, by least squares without outliers.

    One dot gives a shift; none gives no motion.
    """
    a, b = _complex(before), _complex(after)
    kept = np.ones(len(a), dtype=bool)
    fitted = IDENTITY
    for _ in range(_ROUNDS):
        x, y = a[kept], b[kept]
        if not len(x):
            return IDENTITY
        mx, my = x.mean(), y.mean()
        power = float((np.abs(x - mx) ** 2).sum())
        factor = complex(((y - my) * (x - mx).conj()).sum() / power) if power > 1.0 else 1.0 + 0.0j
        fitted = Similarity(factor, complex(my - factor * mx))
        off = np.abs(fitted.factor * a + fitted.shift - b)
        kept = off <= max(_OFF * float(np.median(off)), 0.5)
    return fitted


def _complex(places: FloatArray) -> np.ndarray:
    return np.asarray(places[..., 0] + 1j * places[..., 1])
