"""The setup of one face: binding, neutral, options, pins, and the performer's calibration."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import get_args

import numpy as np

from usdface.arguments import checked
from usdface.errors import InputError, did_you_mean
from usdface.frozen_mapping import FrozenMapping
from usdface.options import (
    EXAGGERATION_RANGE,
    LARGEST_CURVE_FACTOR,
    CleanOptions,
    ClosureOptions,
    HeadMode,
    MapOptions,
    SolveOptions,
    check_exaggeration,
)
from usdface.setup.binding import Binding
from usdface.setup.binding_origin import BindingOrigin
from usdface.setup.calibration import Calibration
from usdface.setup.pin import Pin
from usdface.short_repr import short_repr
from usdface.takes import MarkerTake, WeightsTake

__all__ = [
    "RetargetSetup",
    "check_curve_factor",
    "check_neutral_frames",
    "check_neutral_weights",
    "unbound",
]


@checked
@dataclass(frozen=True, eq=False, slots=True)
class RetargetSetup:
    """Everything `retarget` needs to know about a face besides take and rig.

    Attributes
    ----------
    binding : Binding
    head : {"solve", "markers", "stabilised"}
        "solve": the head pose is found together with the weights. "markers": a rigid fit on
        `head_markers`. "stabilised": no head motion.
    head_markers : tuple of str
        Markers on a rigid object, for `head` "markers".
    move_head : bool
        The character's head moves as the performer's; else the face stays in its place.
    head_joint : str
        Path or name of the joint that carries the face; "" = found by the skin of the face, and
        the whole character moves if there is none.
    eye_joints : (str, str) or ()
        Paths or names of the joints that turn the left and the right eye by the gaze curves of a
        take of weights; () = found by their names.
    eye_turn : float
        Factor on these turns, 0 to 4.
    neutral : (int, int) or None
        First and last neutral frame index, inclusive; None = the take's neutral is the
        rig's own neutral mesh, in the same space.
    neutral_assumed : bool
        `neutral` is a default: the frames were neither named nor searched for.
    neutral_removed : bool or None
        A take of weights counts from its weights in the neutral frames; None = where they are
        named.
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

    __repr__ = short_repr

    binding: Binding
    head: HeadMode = "solve"
    head_markers: tuple[str, ...] = ()
    move_head: bool = True
    head_joint: str = ""
    eye_joints: tuple[str, ...] = ()
    eye_turn: float = 1.0
    neutral: tuple[int, int] | None = (0, 0)
    neutral_assumed: bool = False
    neutral_removed: bool | None = None
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
        object.__setattr__(self, "roles", FrozenMapping(self.roles))
        weights = FrozenMapping(self.neutral_weights)
        object.__setattr__(self, "neutral_weights", weights)
        for name, weight in weights.items():
            if not 0 <= weight <= 1:
                raise InputError(
                    f"the neutral weight of {name!r} is {weight}; expected 0 to 1", "SETTING_WRONG"
                )
        curves = {curve: FrozenMapping(own) for curve, own in self.curves.items()}
        object.__setattr__(self, "curves", FrozenMapping(curves))
        for curve, own in curves.items():
            for name, factor in own.items():
                check_curve_factor(curve, name, factor)
        pinned = [pin.shape for pin in self.pins]
        if len(set(pinned)) != len(pinned):
            raise InputError("a blend shape is pinned twice; give it one Pin", "NAME_REPEATED")
        parts = FrozenMapping(self.exaggeration)
        object.__setattr__(self, "exaggeration", parts)
        for part, factor in parts.items():
            check_exaggeration(part, factor)
        if weights and self.neutral is None:
            raise InputError(
                'the neutral "rig" has no weights; name neutral frames', "SETTING_WRONG"
            )
        if len(self.eye_joints) not in (0, 2):
            raise InputError(
                f"the joints of the eyes are {self.eye_joints}; expected that of the left and that "
                "of the right one",
                "SETTING_WRONG",
            )
        if not EXAGGERATION_RANGE[0] <= self.eye_turn <= EXAGGERATION_RANGE[1]:
            raise InputError(
                f"the factor on the turns of the eyes is {self.eye_turn}; expected 0 to "
                f"{EXAGGERATION_RANGE[1]:g}",
                "SETTING_WRONG",
            )
        if self.head not in get_args(HeadMode):
            raise InputError(
                f"the head is {self.head!r}; expected {', '.join(get_args(HeadMode))}",
                "SETTING_WRONG",
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


def check_neutral_frames(neutral: tuple[int, int], frame_count: int, source: str = "") -> None:
    """Refuse neutral frames, first and last, that a take of `frame_count` frames does not have.

    Parameters
    ----------
    neutral : (int, int)
        Frame indices.
    frame_count : int
    source : str
        Of the take, for the message.

    Raises
    ------
    InputError
    """
    first, last = neutral
    if first > last:
        raise InputError(
            f"neutral frames {first} to {last} are reversed; expected first and last frame",
            "SETTING_WRONG",
        )
    if not 0 <= first <= last < frame_count:
        raise InputError(
            f"neutral frames {first} to {last} lie outside the take{source and f' {source}'}, "
            f"which has frames 0 to {frame_count - 1}; name others (--neutral FIRST LAST, or auto)",
            "FRAMES_OUTSIDE",
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
