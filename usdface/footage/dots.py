"""The dots found in one image: centres with their uncertainty, ellipses, contrast."""

from dataclasses import dataclass

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray, frozen

__all__ = ["Dots", "no_dots"]


@dataclass(frozen=True, eq=False, slots=True)
class Dots:
    """Dots of an image; pixel (0, 0) is the top left one, and its centre lies at (0.5, 0.5).

    Attributes
    ----------
    centres : (K, 2) float64 [px]
        x right, y down.
    deviations : (K,) float64 [px]
        Standard deviation of each coordinate of the centre, from the noise around the dot.
    axes : (K, 2) float64 [px]
        Long and short half axis of the ellipse with the dot's moments.
    angles : (K,) float64 [rad]
        Of the long axis, from x towards y.
    areas : (K,) float64 [px^2]
    fills : (K,) float64 [1]
        Area divided by that of the ellipse: 1 for discs and ellipses.
    heights : (K,) float64
        Signal above the surroundings, in code values.
    faint : (K,) bool
        Mixed with its surroundings too much to be a dot by itself: only a track that expects a dot
        there uses it.
    """

    centres: FloatArray
    deviations: FloatArray
    axes: FloatArray
    angles: FloatArray
    areas: FloatArray
    fills: FloatArray
    heights: FloatArray
    faint: BoolArray

    def __post_init__(self) -> None:
        for name in self.__slots__:
            kind = np.bool_ if name == "faint" else np.float64
            object.__setattr__(self, name, frozen(getattr(self, name), kind))

    def __len__(self) -> int:
        return len(self.centres)

    def __getitem__(self, rows: BoolArray | IntArray) -> "Dots":
        """Return some of the dots."""
        return Dots(*(getattr(self, name)[rows] for name in self.__slots__))

    @property
    def sure(self) -> "Dots":
        """Those that are not faint."""
        return self[~self.faint]

    @property
    def roundness(self) -> FloatArray:
        """(K,) float64 [1]: short axis divided by long axis."""
        return np.asarray(self.axes[:, 1] / self.axes[:, 0])

    @property
    def radii(self) -> FloatArray:
        """(K,) float64 [px]: of the disc of the same area."""
        return np.asarray(np.sqrt(self.areas / np.pi))


def no_dots() -> Dots:
    """Return the dots of an image without any."""
    none = np.zeros(0)
    pairs = np.zeros((0, 2))
    return Dots(
        centres=pairs,
        deviations=none,
        axes=pairs,
        angles=none,
        areas=none,
        fills=none,
        heights=none,
        faint=np.zeros(0, dtype=bool),
    )
