"""The directions in which a camera sees the markers of a head that turns before it."""

from dataclasses import dataclass, replace

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray, freeze

__all__ = ["Views"]


@dataclass(frozen=True, eq=False, slots=True)
class Views:
    """Projections of marker displacements by the camera, and their certainty.

    Attributes
    ----------
    markers : tuple of str, length M
    slopes : (F, M, 2, 3) float64
        Derivative of a marker's image position by its position in head space. For a frontal face it
        is the first two axes.
    certainty : (F, M) float64
        The deviation of the take over that of the sample, by the errors of the markers; 0 = no
        information.
    mapped : bool
        Displacements go through the space map; else they are taken as they are.
    """

    markers: tuple[str, ...]
    slopes: FloatArray
    certainty: FloatArray
    mapped: bool = True

    def __post_init__(self) -> None:
        freeze(self, "slopes", "certainty")

    @property
    def errors(self) -> FloatArray:
        """The markers' deviations over that of the sample: (M,) [1]."""
        return np.asarray(1.0 / np.sqrt((self.certainty**2).mean(axis=0)).clip(min=1e-3))

    def of(self, markers: tuple[str, ...]) -> "Views":
        """Return the views of some of the markers; one that is not here has no certainty."""
        if markers == self.markers:
            return self
        slopes = np.zeros((len(self.slopes), len(markers), 2, 3))
        certainty = np.zeros(slopes.shape[:2])
        for column, name in enumerate(markers):
            if name in self.markers:
                own = self.markers.index(name)
                slopes[:, column] = self.slopes[:, own]
                certainty[:, column] = self.certainty[:, own]
        return replace(self, markers=markers, slopes=slopes, certainty=certainty)

    def at(self, frames: IntArray | BoolArray | slice) -> "Views":
        """Return the views of some frames."""
        return replace(self, slopes=self.slopes[frames], certainty=self.certainty[frames])

    def where(self, visible: BoolArray) -> "Views":
        """Return the views with no certainty of markers that are not `visible` (F, M)."""
        return replace(self, certainty=np.where(visible, self.certainty, 0.0))

    def projected(self, displacements: FloatArray) -> FloatArray:
        """Return displacements in head space, projected: (F, ..., 2 M) [m].

        `displacements` are (F, ..., 3 M) [m], or (1, ..., 3 M) where they are the same everywhere.
        """
        wide = displacements.ndim - 2
        apart = displacements.reshape(*displacements.shape[:-1], -1, 3)
        slopes = self.slopes.reshape(len(self.slopes), *(1,) * wide, -1, 2, 3)
        # By coordinates: products of so many small matrices take ten times as long.
        projected = slopes[..., 0] * apart[..., :1]
        projected = projected + slopes[..., 1] * apart[..., 1:2] + slopes[..., 2] * apart[..., 2:]
        return np.asarray(projected.reshape(*projected.shape[:-2], -1))

    def weighted(self, projected: FloatArray) -> FloatArray:
        """Return projections (F, ..., 2 M) in units of the samples' deviation: (F, ..., 2 M)."""
        wide = projected.ndim - 2
        certainty = np.repeat(self.certainty, 2, axis=1)
        return np.asarray(projected * certainty.reshape(len(certainty), *(1,) * wide, -1))
