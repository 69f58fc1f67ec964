"""Takes: recorded markers or weights, as immutable arrays in SI units, Y up.

Axis letters throughout the project: F frames, M markers, S blend shapes, V vertices,
D dimensions (2 or 3), R rules.
"""

from usdface.takes.marker_take import FARTHEST, MarkerTake, visible
from usdface.takes.recorded_range import check_range
from usdface.takes.take_axes import frame_step
from usdface.takes.weights_take import WeightsTake

__all__ = ["FARTHEST", "MarkerTake", "WeightsTake", "check_range", "frame_step", "visible"]
