"""A take of one camera, and the skin of the character under its markers."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from usdface.arrays import FloatArray
from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.face.dot_skin import DotSkin
from usdface.retarget.neutral import neutral_markers
from usdface.takes import MarkerTake

__all__ = ["FilmedTake", "Sized", "as_they_are"]

# Makes of the character's blend shapes those of a calibrated performer.
Sized = Callable[[BlendShapeEvaluator], BlendShapeEvaluator]


def as_they_are(shapes: BlendShapeEvaluator) -> BlendShapeEvaluator:
    """Return the blend shapes of a performer who is not calibrated: the character's."""
    return shapes


@dataclass(frozen=True, eq=False)
class FilmedTake:
    """A take of one camera, and the character's face under its markers.

    Attributes
    ----------
    take : MarkerTake
        Of M markers.
    skin : DotSkin
        Of the character under them: head space.
    neutral : (int, int)
        First and last neutral frame index, inclusive.
    sized : callable
        Makes of the skin's blend shapes those of a calibrated performer.
    shown : (M, 2) float64 [px], or 0
        Displacements in the neutral frames by weights that they show.
    mapped : bool
        Displacements go through the space map; else they are taken as they are.
    """

    take: MarkerTake
    skin: DotSkin
    neutral: tuple[int, int]
    sized: Sized = as_they_are
    shown: FloatArray | float = 0.0
    mapped: bool = True

    @property
    def image(self) -> FloatArray:
        """Positions of the markers in the image: (F, M, 2) [px]."""
        return self.take.positions

    @property
    def face(self) -> FloatArray:
        """Rest positions of the markers on the character: (M, 3) [m]."""
        return self.skin.rest

    @cached_property
    def rest(self) -> FloatArray:
        """Rest positions of the markers in the image: (M, 2) [px]."""
        return neutral_markers(self.image, self.neutral) - self.shown

    @cached_property
    def moving(self) -> DotSkin:
        """The same skin, moved by blend shapes of the performer's size."""
        return replace(self.skin, evaluator=self.sized(self.skin.evaluator))

    def without(self, beside: FloatArray) -> "FilmedTake":
        """Return the take of the means of the skin, without the offsets `beside` (F, M, 2) [px]."""
        return replace(self, take=replace(self.take, positions=self.image - beside))

    def part(self, most: int) -> "FilmedTake":
        """Return evenly spread frames, at most `most`, and the neutral ones."""
        take, (first, last) = self.take, self.neutral
        last = min(last, first + most)
        spread = np.linspace(0, len(self.image) - 1, min(len(self.image), most)).round()
        frames = np.union1d(spread.astype(np.int64), np.arange(first, last + 1))
        start = int(np.searchsorted(frames, first))
        return replace(
            self,
            take=take.with_frames(frames),
            neutral=(start, start + last - first),
        )

    def moved(self, weights: FloatArray) -> FloatArray:
        """Return the markers' displacements by weights (F, S): (F, M, 3) [m]."""
        moved = self.moving.marker_evaluator.displacements(weights)
        return np.asarray(moved.reshape(len(weights), -1, 3))
