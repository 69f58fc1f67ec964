"""The setup of one face: which marker sits where on the rig, and how the take is solved."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from usdface.arrays import FloatArray, IntArray, frozen
from usdface.binding_origin import BindingOrigin
from usdface.errors import InputError, did_you_mean
from usdface.options import (
    AMPLITUDE_RANGE,
    LARGEST_CURVE_FACTOR,
    LARGEST_OFFSET,
    CleanOptions,
    ClosureOptions,
    HeadMode,
    MapOptions,
    SolveOptions,
    check_exaggeration,
)
from usdface.performer_face import PerformerFace
from usdface.takes import MarkerTake, WeightsTake

__all__ = [
    "Binding",
    "Calibration",
    "Expression",
    "Pin",
    "RetargetSetup",
    "check_curve_factor",
    "check_neutral_weights",
    "unbound",
]


@dataclass(frozen=True, eq=False, slots=True)
class Binding:
    """The binding of markers to the rig: `markers[i]` is on vertex `points[i]` of `mesh`.

    `mesh` is a mesh name or prim path; "" = the only mesh of the rig that has shapes.
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
        object.__setattr__(self, "points", frozen(self.points, np.int64))
        if self.confidence is not None:
            object.__setattr__(self, "confidence", frozen(self.confidence))
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


@dataclass(frozen=True, eq=False, slots=True)
class Expression:
    """An expression pose: one key shape of the rig as weights of its blend shapes.

    Attributes
    ----------
    name : str
        The emotion.
    shapes : tuple of str, length K
    weights : (K,) float64
        In [0, 1].
    gain : float
        Factor on its correction.

    Raises
    ------
    InputError
        If the weights are not as many as the shapes, or not in [0, 1].

    Examples
    --------
    >>> joy = usdface.Expression("joy", ("mouthSmileLeft", "mouthSmileRight"), [0.9, 0.9])
    >>> joy.pose(("jawOpen", "mouthSmileLeft")).tolist()
    [0.0, 0.9]
    """

    name: str
    shapes: tuple[str, ...]
    weights: FloatArray
    gain: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "weights", frozen(self.weights))
        if self.weights.shape != (len(self.shapes),):
            raise InputError(
                f"expression {self.name!r} has {self.weights.size} weights "
                f"for {len(self.shapes)} shapes",
                "WEIGHTS_LENGTH_WRONG",
            )
        if not ((self.weights >= 0) & (self.weights <= 1)).all():
            raise InputError(
                f"expression {self.name!r}: weights must lie in [0, 1]", "SETTING_WRONG"
            )

    def pose(self, names: tuple[str, ...]) -> FloatArray:
        """Return the weights in the order of `names`: (len(names),); others are left out."""
        own = dict(zip(self.shapes, self.weights, strict=True))
        return np.array([own.get(name, 0.0) for name in names])


@dataclass(frozen=True, eq=False, slots=True)
class Pin:
    """Weights of one blend shape that are fixed: `weights` (K,) in [0, 1] at `frames` (K,).

    `frames` are frame indices of the take, rising; there is at least one.

    Raises
    ------
    InputError
        If they are not, or not as many as weights, or a weight is outside 0 to 1.

    Examples
    --------
    >>> usdface.Pin("eyeBlinkLeft", [40, 41], [1.0, 1.0]).frames.tolist()
    [40, 41]
    """

    shape: str
    frames: IntArray
    weights: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "frames", frozen(self.frames, np.int64))
        object.__setattr__(self, "weights", frozen(self.weights))
        if self.frames.ndim != 1 or self.frames.shape != self.weights.shape or not self.frames.size:
            raise InputError(
                f"the pins of {self.shape!r} are {self.weights.size} weights at {self.frames.size} "
                "frames; expected as many, and at least one",
                "WEIGHTS_LENGTH_WRONG",
            )
        if self.frames[0] < 0 or (np.diff(self.frames) <= 0).any():
            raise InputError(
                f"the frame indices of the pins of {self.shape!r} do not rise from 0 on",
                "SETTING_WRONG",
            )
        if not ((self.weights >= 0) & (self.weights <= 1)).all():
            raise InputError(f"a pin of {self.shape!r} is outside 0 to 1", "SETTING_WRONG")


@dataclass(frozen=True, eq=False, slots=True)
class Calibration:
    """How a performer's movements relate to the character's blend shapes.

    A performer's weight w of shape k moves the markers as ``amplitudes[k] * w - offsets[k]`` times
    the character's shape does; shapes that are not named have amplitude 1 and offset 0.

    Attributes
    ----------
    shapes : tuple of str, length K
    amplitudes : (K,) float64
        How large each movement is against the character's, in `usdface.options.AMPLITUDE_RANGE`.
    offsets : (K,) float64
        How far the performer's neutral is from rest, 0 to `usdface.options.LARGEST_OFFSET`. A
        take's own `RetargetSetup.neutral_weights` override the offset of a shape.
    face : PerformerFace or None
        Where the performer's markers sit, and how the shapes move them.

    Examples
    --------
    >>> calibration = usdface.Calibration(("jawOpen",), [1.3], [0.05])
    >>> float(calibration.of(("mouthPucker", "jawOpen"))[0][1])
    1.3
    """

    shapes: tuple[str, ...]
    amplitudes: FloatArray
    offsets: FloatArray
    face: PerformerFace | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "amplitudes", frozen(self.amplitudes))
        object.__setattr__(self, "offsets", frozen(self.offsets))
        count = len(self.shapes)
        if len(set(self.shapes)) != count:
            raise InputError("the calibration names a blend shape twice", "NAME_REPEATED")
        for name, values, low, high in (
            ("gains", self.amplitudes, *AMPLITUDE_RANGE),
            ("offsets", self.offsets, 0.0, LARGEST_OFFSET),
        ):
            if values.shape != (count,):
                raise InputError(
                    f"the calibration has {values.size} {name} for {count} blend shapes",
                    "WEIGHTS_LENGTH_WRONG",
                )
            # Files hold single precision.
            good = (values >= low - 1e-6) & (values <= high + 1e-6)
            if not good.all():
                worst = int(np.argmin(good))
                raise InputError(
                    f"the calibration's {name} must lie in {low:g} to {high:g}; "
                    f"{self.shapes[worst]!r} has {values[worst]:g}",
                    "SETTING_WRONG",
                )

    def of(self, names: tuple[str, ...]) -> tuple[FloatArray, FloatArray]:
        """Return amplitudes and offsets in the order of `names`: (len(names),), (len(names),)."""
        own = {n: k for k, n in enumerate(self.shapes)}
        amplitudes, offsets = np.ones(len(names)), np.zeros(len(names))
        for place, name in enumerate(names):
            if name in own:
                k = own[name]
                amplitudes[place], offsets[place] = self.amplitudes[k], self.offsets[k]
        return amplitudes, offsets


@dataclass(frozen=True, eq=False, slots=True)
class RetargetSetup:
    """Everything `retarget` needs to know about a face besides take and rig.

    Attributes
    ----------
    binding : Binding
    head : {"solve", "markers", "stabilised"}
        "solve": the head pose is found together with the weights. "markers": a rigid fit on
        `head_markers`, which are on a rigid object. "stabilised": no head motion.
    move_head : bool
        The character's head moves as the performer's; else the face stays in its place.
    head_joint : str
        Path or name of the joint that carries the face; "" = found by the skin of the face, and
        the whole character moves if there is none.
    neutral : (int, int) or None
        First and last neutral frame index, inclusive; None = the take's neutral is the
        rig's own neutral mesh, in the same space.
    neutral_assumed : bool
        `neutral` is a default: the frames were neither named nor searched for.
    neutral_weights : mapping of str to float
        Blend shape weights of the character that the performer shows in the neutral frames, a
        little open mouth say; those not named are 0, or as `calibration` says. With none the solve
        finds them (`usdface.options.SolveOptions.neutral`).
    peaks : tuple of int
        Frame indices of strong expressions, by which places are proposed; () = not named.
    nose_tip : str
        Marker that the fuzzy system measures distances to; "" = none.
    roles : mapping of str to str
        Role name (as in "lip_lower_y") to marker name.
    map : MapOptions
        The space map from performer to character.
    solve : SolveOptions
    clean : CleanOptions
        Steps of the marker clean-up.
    closure : ClosureOptions
        Eyes and lips that close on the character.
    pins : tuple of Pin
        Weights that are fixed in some frames, one for a blend shape.
    calibration : Calibration or None
        Of the performer; None = movements are as large as the character's.
    curves : mapping of str to mapping of str to float
        For a take of weights: the blend shapes that a curve drives, with factors of at most
        `usdface.options.LARGEST_CURVE_FACTOR`; other curves go by their names.
    exaggeration : mapping of "face", "brows", "eyes", "mouth" to float
        Factors on the solved weights (`usdface.retarget.exaggeration`), 0 to 4; those not named
        are 1.
    unsure : Binding
        Proposed vertices that are too unsure to be bound, to be checked by a person.
    origin : BindingOrigin or None
        The mesh and the take that a binding file was made with; None = unknown.

    Examples
    --------
    >>> binding = usdface.Binding(("chin", "nose"), [812, 40])
    >>> usdface.RetargetSetup(binding, neutral=(0, 29), nose_tip="nose").head
    'solve'
    """

    binding: Binding
    head: HeadMode = "solve"
    head_markers: tuple[str, ...] = ()
    move_head: bool = True
    head_joint: str = ""
    neutral: tuple[int, int] | None = (0, 0)
    neutral_assumed: bool = False
    neutral_weights: Mapping[str, float] = field(default_factory=dict)
    peaks: tuple[int, ...] = ()
    nose_tip: str = ""
    roles: Mapping[str, str] = field(default_factory=dict)
    map: MapOptions = field(default_factory=MapOptions)
    solve: SolveOptions = field(default_factory=SolveOptions)
    clean: CleanOptions = field(default_factory=CleanOptions)
    closure: ClosureOptions = field(default_factory=ClosureOptions)
    pins: tuple[Pin, ...] = ()
    calibration: Calibration | None = None
    curves: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    exaggeration: Mapping[str, float] = field(default_factory=dict)
    unsure: Binding = field(default_factory=lambda: Binding((), np.zeros(0, dtype=np.int64)))
    origin: BindingOrigin | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "roles", MappingProxyType(dict(self.roles)))
        weights = MappingProxyType(dict(self.neutral_weights))
        object.__setattr__(self, "neutral_weights", weights)
        for name, weight in weights.items():
            if not 0 <= weight <= 1:
                raise InputError(
                    f"the neutral weight of {name!r} is {weight}; expected 0 to 1", "SETTING_WRONG"
                )
        told = {curve: MappingProxyType(dict(own)) for curve, own in self.curves.items()}
        object.__setattr__(self, "curves", MappingProxyType(told))
        for curve, own in told.items():
            for name, factor in own.items():
                check_curve_factor(curve, name, factor)
        pinned = [pin.shape for pin in self.pins]
        if len(set(pinned)) != len(pinned):
            raise InputError("a blend shape is pinned twice; give it one Pin", "NAME_REPEATED")
        parts = MappingProxyType(dict(self.exaggeration))
        object.__setattr__(self, "exaggeration", parts)
        for part, factor in parts.items():
            check_exaggeration(part, factor)
        if weights and self.neutral is None:
            raise InputError(
                'the neutral "rig" has no weights; name neutral frames', "SETTING_WRONG"
            )
        if self.head == "markers" and len(self.head_markers) < 3:
            raise InputError(
                f"the head needs at least three rigid markers; got {len(self.head_markers)}. "
                'Name more, or use "solve"',
                "MARKERS_TOO_FEW",
            )


def unbound(take: MarkerTake | WeightsTake) -> RetargetSetup:
    """Return the setup of a take that needs no binding.

    Raises
    ------
    InputError
        If it is a marker take.
    """
    if isinstance(take, MarkerTake):
        raise InputError(
            f"the markers of {take.source} need a place on the rig: give --bind bind.json, "
            f'e.g. {{"markers": {{"{take.names[0]}": {{"point": 0}}}}}}',
            "BINDING_MISSING",
        )
    # A recorded head turns from where it is in the neutral frames.
    assumed = take.head is not None
    return RetargetSetup(Binding((), np.zeros(0, dtype=np.int64)), neutral_assumed=assumed)


def check_curve_factor(curve: str, shape: str, factor: object) -> None:
    """Refuse the factor of a curve on a blend shape that is no number of a usual size.

    Raises
    ------
    InputError
    """
    number = isinstance(factor, (int, float)) and not isinstance(factor, bool)
    if not number or not abs(factor) <= LARGEST_CURVE_FACTOR:  # type: ignore[arg-type]
        raise InputError(
            f"the factor of the curve {curve!r} on {shape!r} is {factor!r}; expected "
            f"{-LARGEST_CURVE_FACTOR:g} to {LARGEST_CURVE_FACTOR:g}",
            "SETTING_WRONG",
        )


def check_neutral_weights(weights: Mapping[str, float], shape_names: Sequence[str]) -> None:
    """Refuse neutral weights of other names than those of the bound mesh's blend shapes.

    Raises
    ------
    InputError
        Naming the first one.
    """
    for name in weights:
        if name not in shape_names:
            raise InputError(
                f"a neutral weight is of {name!r}, a blend shape the bound mesh has not"
                f"{did_you_mean(name, shape_names)}",
                "SHAPE_UNKNOWN",
            )
