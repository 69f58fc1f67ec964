"""A place on a face: a vertex, its region and side, and the nearest marker."""

from dataclasses import asdict, dataclass
from typing import Any

__all__ = ["Place"]

_ONE = {"cheeks": "cheek", "brows": "brow", "eyes": "eye"}


@dataclass(frozen=True, slots=True)
class Place:
    """A vertex, and where on the face it is.

    Attributes
    ----------
    vertex : int
    region : str
    side : {"left", "right", ""}
        The character's; "" in the middle.
    marker : str
        The nearest bound marker; "" without markers.
    distance_mm : float
        To it.
    """

    vertex: int
    region: str
    side: str = ""
    marker: str = ""
    distance_mm: float = 0.0

    def __str__(self) -> str:
        # In the middle there is no one brow.
        named = (
            f"{self.side} {_ONE.get(self.region, self.region)}"
            if self.side
            else f"middle of the {self.region}"
        )
        away = f", {self.distance_mm:.0f} mm from marker {self.marker}" if self.marker else ""
        return f"{named}{away} (vertex {self.vertex})"

    def as_dict(self) -> dict[str, Any]:
        """Return the place as plain values."""
        return asdict(self)
