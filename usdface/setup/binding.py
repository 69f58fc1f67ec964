"""The binding of markers to the rig."""

from dataclasses import dataclass

import numpy as np

from usdface.arguments import checked
from usdface.arrays import FloatArray, IntArray, freeze
from usdface.errors import InputError

__all__ = ["Binding"]


@checked
@dataclass(frozen=True, eq=False, slots=True)
class Binding:
    """The binding of markers to the rig: `markers[i]` is on vertex `points[i]` of `mesh`.

    `mesh` is a mesh name or prim path; "" = the face of the rig.
    `confidence` (len(markers),) float64 in [0, 1] is that of proposed vertices
    (`usdface.binding`); NaN = unknown, None = unknown for all.

    Examples
    --------
    >>> binding = usdface.Binding(("chin", "nose"), [812, 40])
    >>> dict(zip(binding.markers, binding.points.tolist(), strict=True))
    {'chin': 812, 'nose': 40}
    """

    markers: tuple[str, ...]
    points: IntArray
    mesh: str = ""
    confidence: FloatArray | None = None

    def __post_init__(self) -> None:
        freeze(self, "points", dtype=np.int64)
        if self.confidence is not None:
            freeze(self, "confidence")
            if self.confidence.shape != (len(self.markers),):
                raise InputError(
                    f"the binding has {self.confidence.size} confidences "
                    f"for {len(self.markers)} markers",
                    "SCHEMA_BROKEN",
                )
            if ((self.confidence < 0) | (self.confidence > 1)).any():
                raise InputError(
                    "a confidence of the binding is not within 0 to 1", "SETTING_WRONG"
                )
        if len(set(self.markers)) != len(self.markers):
            raise InputError("the binding names a marker twice", "NAME_REPEATED")
        if self.points.shape != (len(self.markers),):
            raise InputError(
                f"the binding has {self.points.size} points for {len(self.markers)} markers",
                "SCHEMA_BROKEN",
            )
