"""A take of markers: their positions over time."""

import math
from dataclasses import dataclass, replace

import numpy as np

from usdface.arguments import checked
from usdface.arrays import BoolArray, FloatArray, IntArray, freeze
from usdface.errors import InputError
from usdface.short_repr import short_repr
from usdface.takes.take_axes import check_names, check_rate, check_times

__all__ = ["FARTHEST", "MarkerTake", "visible"]

# From the origin [m, or pixels of an image]: no capture volume and no image is larger, and squares
# of it keep their digits.
FARTHEST = 1e5


def visible(positions: FloatArray) -> BoolArray:
    """Return where markers (..., D) were seen, that is, are not NaN: (...,) bool."""
    return np.asarray(~np.isnan(positions[..., 0]))


@checked
@dataclass(frozen=True, eq=False, slots=True)
class MarkerTake:
    """Marker positions over time.

    Attributes
    ----------
    names : tuple of str, length M
        Marker labels, unique.
    times : (F,) float64 [s]
        Strictly increasing, 0 at the first recorded frame.
    positions : (F, M, D) float64
        D = 3: metres, Y up, right-handed. D = 2: pixels, x right, y up (an image's y is
        negated on reading). NaN in all D components = occluded, nowhere else.
    rate : float [Hz]
        Nominal frame rate of the recording; 0 where a file has none.
    meters_per_unit : float
        Unit of length of the source file, e.g. 0.001 for millimetres (1 for D = 2).
    up_axis : {"Y", "Z"}
        Up axis of the source file.
    start_timecode : str
        SMPTE timecode of the first frame as the source gives it; "" where it has none.
    image_size : (int, int) or None
        Width and height [px] of the image a 2D take was made on.
    source : str
        File the take was read from.
    focal_length : float [px]
        Of the camera that filmed a 2D take; 0 = unknown.
    first_frame : int
        Number of frames of the footage before the first one of the take.
    diameters : (M,) float64 [m, or pixels for D = 2] or None
        Of painted dots, of which a camera shows the middle; NaN = unknown. Such a marker moves as
        the mean of the skin under it, any other as the place that it is bound to.
    deviation : float [m, or pixels for D = 2]
        Standard deviation of a coordinate, as far as it is known before the take is solved; 0 =
        unknown.
    blink : (F,) float64 or None
        How far a recorder saw both eyes blink by itself, 0 to 1 (of action unit 45 in FACS, of
        which 1 is the greatest intensity); NaN where it saw no face.
    gaze : (F, 2) float64 [rad] or None
        Yaw, to the head's own left, and pitch, up, of both eyes in their head, as a recorder saw
        them; NaN where it saw no face.

    Examples
    --------
    >>> positions = [[[0.0, 0.0, 0.0]], [[0.0, 0.001, 0.0]]]
    >>> take = usdface.MarkerTake(("nose",), [0.0, 1 / 60], positions, 60.0)
    >>> take.visible.tolist(), take.select(("nose",)).shape
    ([[True], [True]], (2, 1, 3))
    """

    __repr__ = short_repr

    names: tuple[str, ...]
    times: FloatArray
    positions: FloatArray
    rate: float = 0.0
    meters_per_unit: float = 1.0
    up_axis: str = "Y"
    start_timecode: str = ""
    image_size: tuple[int, int] | None = None
    source: str = ""
    focal_length: float = 0.0
    first_frame: int = 0
    diameters: FloatArray | None = None
    deviation: float = 0.0
    blink: FloatArray | None = None
    gaze: FloatArray | None = None

    def __post_init__(self) -> None:
        freeze(self, "times", "positions")
        shape = self.positions.shape
        if len(shape) != 3 or shape[1] != len(self.names) or shape[2] not in (2, 3):
            raise InputError(
                f"marker positions have shape {shape}; "
                f"expected (frames, {len(self.names)} markers, 2 or 3)",
                "VALUES_WRONG",
            )
        if not self.names:
            raise InputError("the marker take has no markers; expected at least one", "TAKE_EMPTY")
        check_names(self.names, "marker")
        check_times(self.times, shape[0], "marker take")
        check_rate(self.rate, "marker take")
        bad = np.isnan(self.positions)
        if np.isinf(self.positions).any() or (bad.any(axis=2) != bad.all(axis=2)).any():
            raise InputError(
                "marker positions must be finite, or NaN in all components", "VALUES_WRONG"
            )
        if not 1e-12 <= self.meters_per_unit < math.inf:
            raise InputError(
                f"a unit of the marker take is {self.meters_per_unit} m; expected a positive "
                "number, such as 0.001",
                "VALUES_WRONG",
            )
        if self.image_size and min(self.image_size) <= 0:
            raise InputError(
                f"the image is {self.image_size[0]} x {self.image_size[1]} px; expected positive "
                "numbers",
                "VALUES_WRONG",
            )
        if not 0.0 <= self.focal_length < math.inf:
            raise InputError(
                f"the focal length is {self.focal_length} px; expected a positive number, or 0",
                "VALUES_WRONG",
            )
        if self.diameters is not None:
            freeze(self, "diameters")
            _check_diameters(self.diameters, len(self.names))
        if not 0.0 <= self.deviation <= FARTHEST:
            raise InputError(
                f"the deviation of the markers is {self.deviation}; expected a positive number of "
                f"{FARTHEST:g} at most, or 0",
                "VALUES_WRONG",
            )
        if self.blink is not None:
            freeze(self, "blink")
            _check_blink(self.blink, len(self.times))
        if self.gaze is not None:
            freeze(self, "gaze")
            _check_gaze(self.gaze, len(self.times))
        if self.up_axis not in ("Y", "Z"):
            raise InputError(f"up axis is {self.up_axis!r}; expected 'Y' or 'Z'", "AXIS_UNKNOWN")

    @property
    def dimension(self) -> int:
        """2 for image markers, 3 for markers in space."""
        return int(self.positions.shape[2])

    @property
    def visible(self) -> BoolArray:
        """(F, M) bool: True where the marker was seen."""
        return visible(self.positions)

    def with_markers(self, markers: IntArray | BoolArray) -> "MarkerTake":
        """Return the take of some of the markers, by their numbers or as a mask (M,)."""
        kept = np.arange(len(self.names))[markers]
        return replace(
            self,
            names=tuple(self.names[k] for k in kept.tolist()),
            positions=self.positions[:, kept],
            diameters=None if self.diameters is None else self.diameters[kept],
        )

    def with_frames(self, frames: IntArray | slice) -> "MarkerTake":
        """Return the take of some of the frames; their times stay."""
        return replace(
            self,
            times=self.times[frames],
            positions=self.positions[frames],
            blink=None if self.blink is None else self.blink[frames],
            gaze=None if self.gaze is None else self.gaze[frames],
        )

    def select(self, names: tuple[str, ...]) -> FloatArray:
        """Return the positions of the named markers, in that order: (F, len(names), D).

        Raises
        ------
        InputError
            If the take has no marker of such a name.
        """
        missing = [n for n in names if n not in self.names]
        if missing:
            raise InputError(
                f"the take {self.source or ''} has no marker {', '.join(map(repr, missing))}; "
                f"it has {', '.join(self.names)}",
                "MARKER_UNKNOWN",
            )
        return self.positions[:, [self.names.index(n) for n in names]]


def _check_diameters(diameters: FloatArray, markers: int) -> None:
    if diameters.shape != (markers,):
        raise InputError(
            f"the marker take has {diameters.size} diameters for {markers} markers",
            "VALUES_WRONG",
        )
    known = diameters[~np.isnan(diameters)]
    if not ((known > 0.0) & (known <= FARTHEST)).all():
        raise InputError(
            f"diameters of markers must be positive and {FARTHEST:g} at most, or NaN where unknown",
            "VALUES_WRONG",
        )


def _check_blink(blink: FloatArray, frames: int) -> None:
    if blink.shape != (frames,):
        raise InputError(
            f"the marker take has values of blinks of shape {blink.shape}; expected ({frames},)",
            "VALUES_WRONG",
        )
    seen = blink[~np.isnan(blink)]
    if not ((seen >= 0.0) & (seen <= 1.0)).all():
        raise InputError(
            "values of blinks must be 0 to 1, or NaN where no face is seen", "VALUES_WRONG"
        )


def _check_gaze(gaze: FloatArray, frames: int) -> None:
    if gaze.shape != (frames, 2):
        raise InputError(
            f"the marker take has a gaze of shape {gaze.shape}; expected ({frames}, 2)",
            "VALUES_WRONG",
        )
    if (np.abs(gaze) > math.pi).any():
        raise InputError(
            "angles of the gaze must be within pi, or NaN where no face is seen", "VALUES_WRONG"
        )
