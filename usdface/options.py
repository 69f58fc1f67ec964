"""Every setting with its default: the one place where defaults live.

Standard library only, so that the command line can show them without loading numpy.
Settings that belong to a shot are authored on its prims (see ``usdface/schemas``); the
dataclasses here are the values that `usdface shot` writes, and those of missing attributes.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from math import isfinite
from os import PathLike
from typing import Any, Literal, get_args

from usdface.arguments import checked
from usdface.errors import InputError, did_you_mean

__all__ = [
    "BLEND_TIME",
    "CONTACT_TOLERANCE",
    "EVIDENCE",
    "EXAGGERATION_PARTS",
    "EXAGGERATION_RANGE",
    "EXTREME_REACHED",
    "FEATURE_SMOOTHING",
    "LARGEST_CURVE_FACTOR",
    "LARGEST_OFFSET",
    "LEARNED_SMOOTHING",
    "LIKENESS",
    "MARKER_NOISE",
    "NEXT_MARKERS",
    "OFFSET_SPREAD",
    "PERFORMER_GAIN_RANGE",
    "PERFORMER_GAIN_SPREAD",
    "PIN_REACH",
    "RESPONSE",
    "BindOptions",
    "CleanOptions",
    "ClosureOptions",
    "CorrectionMode",
    "CorrectionOptions",
    "DeliverOptions",
    "ExportOptions",
    "FeatureSpace",
    "FitOptions",
    "HeadMode",
    "HoldOut",
    "ImportOptions",
    "Kernel",
    "MapOptions",
    "MarkerOptions",
    "ProcessOptions",
    "RigOptions",
    "Setting",
    "SolveErrors",
    "SolveGains",
    "SolveGaze",
    "SolveLimits",
    "SolveMode",
    "SolveNeutral",
    "SolveOptions",
    "SolvePlaces",
    "SolvePrior",
    "SolveShrinkage",
    "TakeOptions",
    "ViewOptions",
    "check_exaggeration",
    "solve_settings",
]

LengthUnit = Literal["mm", "cm", "m", "in"]
UpAxis = Literal["Y", "Z"]
Purpose = Literal["guide", "proxy"]
Kernel = Literal["multiquadric", "gaussian", "inverse_quadratic", "inverse_multiquadric"]
MapForm = Literal["neutral_relative", "paper"]
MapChoosing = Literal["auto", "fixed"]
SolveMode = Literal["take", "frame"]
SolveLimits = Literal["declared", "known"]
SolvePlaces = Literal["found", "bound"]
SolveGains = Literal["found", "given"]
SolveNeutral = Literal["found", "given"]
SolveErrors = Literal["found", "alike"]
SolveShrinkage = Literal["restored", "kept"]
SolveGaze = Literal["recorded", "solved"]
SolvePrior = Literal["learned", "fixed"]
HeadMode = Literal["solve", "markers", "stabilised"]
CorrectionMode = Literal["raise", "add"]
FeatureSpace = Literal["character", "take"]
HoldOut = Literal["auto", "recording", "variant"]

# Largest fuzzy output of an event at which a pose begins to be raised, and from which on all of
# it is: half an expression is taken for a whole one, a seventh for none
# (benchmarks/expressions.py).
RESPONSE = (0.15, 0.4)
# Similarity of the solved weights of brows and mouth to those of a pose (cosine) at which half of
# it is raised, set by benchmarks/expression_takes.py: recorded motion is less like a pose in one of
# the two, expressions that other people show at half are more.
EVIDENCE = 0.85
# Of the default design: the classifier of the whole face suppresses a rule where it finds another
# emotion, and adds an emotion where no rule fires.
LIKENESS = 1.0
# Time [s] that a raised pose takes to come and to go, added to that of the performance.
BLEND_TIME = 0.2
# Standard deviation [s] of the Gaussian that smooths the marker features of the fuzzy system with
# 0.3 mm of noise or more; less noise is smoothed less.
FEATURE_SMOOTHING = 0.2
# The same where rules are learned from labelled takes. A designed term begins 0.2 deviations of its
# noise from neutral and needs calm features; a learned one begins at 0.5 and is whole at 2 or more,
# so it can afford to be quicker: examples hold an expression for a fraction of a second, and 0.2 s
# would flatten it (benchmarks/README.md, fuzzy_fit).
LEARNED_SMOOTHING = 0.15
# By how much a correction may part closed lips or lids [m]: less is not seen.
CONTACT_TOLERANCE = 0.0005

# A performer's gain: the range of a movement against the character's own. What it may be, and
# its standard deviation about 1; how far from rest a performer's neutral may be, and its deviation
# [1]. Set by hand; python benchmarks/calibration.py measures their effect.
PERFORMER_GAIN_RANGE = (0.5, 2.0)
PERFORMER_GAIN_SPREAD = 0.2
LARGEST_OFFSET = 0.2
OFFSET_SPREAD = 0.05
# Probability that a movement went to its extreme in a take that is said to go to all of them.
EXTREME_REACHED = 0.8

# How many places for more markers are named.
NEXT_MARKERS = 5
# Noise of a marker coordinate where there is no take to measure it on [m]: the jitter of optical
# markers. Features that move less are uninformative.
MARKER_NOISE = 3e-4

_TIMECODE = re.compile(r"([01]?\d|2[0-3]):[0-5]\d:[0-5]\d[:;]\d+(\.\d+)?", re.ASCII)

# Within this time [s] of a pin a weight bends towards it.
PIN_REACH = 0.2
# Parts of the performance with an exaggeration: the whole face, and its regions.
EXAGGERATION_PARTS = ("face", "brows", "eyes", "mouth")
# Regions of a report that have no exaggeration of their own, and those that their shapes belong to.
_EXAGGERATED_WITH = {"nose": ("mouth",), "jaw": ("mouth",), "cheeks": ("mouth", "eyes")}
EXAGGERATION_RANGE = (0.0, 4.0)
# Factor of a recorded curve on a blend shape: as large as an exaggeration, of either sign.
LARGEST_CURVE_FACTOR = 4.0


def _check_choice(name: str, value: object, choices: Any, code: str = "SETTING_WRONG") -> None:
    if value not in get_args(choices):
        raise InputError(f"{name!r} is {value!r}; expected {', '.join(get_args(choices))}", code)


def _check_number(name: str, value: float, above_zero: bool = False) -> None:
    if not (isfinite(value) and value >= 0) or (above_zero and value == 0):
        wanted = "a number above 0" if above_zero else "a number, 0 or more"
        raise InputError(f"{name!r} is {value}; expected {wanted}", "SETTING_WRONG")


def check_exaggeration(part: str, factor: float) -> None:
    """Raise InputError if there is no such part, or the factor is out of range."""
    low, high = EXAGGERATION_RANGE
    if part not in EXAGGERATION_PARTS:
        if regions := _EXAGGERATED_WITH.get(part):
            hint = f"; the blend shapes of {part} belong to {' and '.join(regions)}"
        else:
            hint = did_you_mean(part, EXAGGERATION_PARTS)
        raise InputError(
            f"exaggeration of {part!r}; expected {', '.join(EXAGGERATION_PARTS)}{hint}",
            "SETTING_WRONG",
        )
    if not low <= factor <= high:
        raise InputError(
            f"the exaggeration of {part!r} is {factor:g}; expected {low:g} to {high:g}",
            "SETTING_WRONG",
        )


@dataclass(frozen=True, slots=True)
class Setting:
    """The range of a field of `SolveOptions`, and its row in the schema.

    Attributes
    ----------
    doc : str
        Of the attribute ``usdface:solve:<name>``; "" = it is no setting of a shot.
    choices : a Literal type, or None
        None = a number, 0 or more.
    above_zero : bool
        Of a number: not 0.
    """

    doc: str = ""
    choices: Any = None
    above_zero: bool = False

    def check(self, name: str, value: Any) -> None:
        """Raise InputError if `name` cannot be `value`."""
        if self.choices is None:
            _check_number(name, value, self.above_zero)
        else:
            _check_choice(name, value, self.choices)


def _row(doc: str = "", *, choices: Any = None, above_zero: bool = False) -> dict[str, Setting]:
    return {"setting": Setting(doc, choices, above_zero)}


def _check_timecode(name: str, value: str) -> None:
    if not _TIMECODE.fullmatch(value):
        raise InputError(
            f"{name!r} is {value!r}; expected HH:MM:SS:FF, as '01:00:00:00'", "SETTING_WRONG"
        )


def _check_share(name: str, value: float) -> None:
    if not 0 <= value <= 1:
        raise InputError(f"{name!r} is {value}; expected 0 to 1", "SETTING_WRONG")


@checked
@dataclass(frozen=True, slots=True, kw_only=True)
class TakeOptions:
    """Options of reading a take, for all that the file itself does not say.

    `units`, `up_axis`, `rate` override the file; `dimension` 2 reads x and y as pixels of an image
    (y down) of `image_size` [px], filmed with `focal_length` [px]. `start_timecode` is the SMPTE
    timecode of the first frame. Samples of 2D tracks with less than `confidence` are occluded;
    None = the usual threshold of the format. Of images: `dots` is the colour of the dots ("green",
    "#3a7" or the place "x,y" of one; by default it is detected), `names` a file of names at places,
    `fixes` a file of corrections; `bind`, a binding file of the `rig`, names the dots by where the
    bound vertices lie.

    Examples
    --------
    >>> usdface.TakeOptions(units="mm", rate=60.0).up_axis is None
    True
    """

    units: LengthUnit | None = None
    up_axis: UpAxis | None = None
    rate: float | None = None
    dimension: Literal[2, 3] | None = None
    image_size: tuple[int, int] | None = None
    focal_length: float | None = None
    start_timecode: str | None = None
    dots: str | None = None
    names: str | PathLike[str] | None = None
    fixes: str | PathLike[str] | None = None
    bind: str | PathLike[str] | None = None
    rig: str | PathLike[str] | None = None
    confidence: float | None = None

    def __post_init__(self) -> None:
        if self.confidence is not None:
            _check_share("confidence", self.confidence)
        if self.start_timecode is not None:
            _check_timecode("start_timecode", self.start_timecode)
        if self.units is not None:
            _check_choice("units", self.units, LengthUnit, "UNIT_UNKNOWN")
        if self.up_axis is not None:
            _check_choice("up_axis", self.up_axis, UpAxis, "AXIS_UNKNOWN")
        if self.dimension not in (2, 3, None):
            raise InputError(f"'dimension' is {self.dimension}; expected 2, 3", "SETTING_WRONG")
        for pixels in self.image_size or ():
            _check_number("image_size", pixels, above_zero=True)


@checked
@dataclass(frozen=True, slots=True, kw_only=True)
class RigOptions:
    """Options of reading a rig, for all that the source does not say.

    `meters_per_unit` is the unit of folders of OBJ and PLY (None: 0.01, centimetres) or of
    MakeHuman targets (None: 0.1, decimetres); `up_axis` holds for OBJ and PLY (MakeHuman's is Y;
    glTF and USD name unit and axis). `neutral` names the neutral mesh of a folder; `asset_root` a
    folder that textures may come from beside that of the asset.

    Examples
    --------
    >>> usdface.RigOptions(meters_per_unit=0.001, up_axis="Z").neutral
    ''
    """

    meters_per_unit: float | None = None
    up_axis: UpAxis = "Y"
    neutral: str = ""
    asset_root: str = ""

    def __post_init__(self) -> None:
        if self.meters_per_unit is not None:
            _check_number("meters_per_unit", self.meters_per_unit, above_zero=True)
        _check_choice("up_axis", self.up_axis, UpAxis, "AXIS_UNKNOWN")


@checked
@dataclass(frozen=True, slots=True, kw_only=True)
class MapOptions:
    """The space map from performer to character.

    `radius` is the shape parameter in multiples of the mean distance between a neutral
    marker and its nearest neighbour; `smoothing` is added to the diagonal of the kernel
    matrix (scaled to 1 at distance 0). Neither counts in the paper's form, which takes the
    smallest distance and no smoothing. With the `choice` "auto" kernel, radius and smoothing
    are those that best predict left-out markers; with "fixed" they are as given here.

    Examples
    --------
    >>> usdface.MapOptions(choice="fixed", kernel="gaussian").radius
    3.0
    """

    kernel: Kernel = "multiquadric"
    form: MapForm = "neutral_relative"
    choice: MapChoosing = "auto"
    radius: float = 3.0
    smoothing: float = 1.0

    def __post_init__(self) -> None:
        _check_choice("kernel", self.kernel, Kernel)
        _check_choice("form", self.form, MapForm)
        _check_choice("choice", self.choice, MapChoosing)
        _check_number("radius", self.radius, above_zero=True)
        _check_number("smoothing", self.smoothing)


@checked
@dataclass(frozen=True, slots=True, kw_only=True)
class CleanOptions:
    """Steps of the marker clean-up (`usdface.cleanup`) that are done before the solve.

    Attributes
    ----------
    blinks : bool
        The motion with which landmarks of an image answer recorded blinks is taken off.
    swaps : bool
        Swapped labels are corrected.
    spikes : bool
        Jumps away from the face are taken as occluded.
    gaps : bool
        Gaps are filled; the solve still takes the filled positions as occluded.

    Examples
    --------
    >>> usdface.CleanOptions(gaps=False).spikes
    True
    """

    blinks: bool = True
    swaps: bool = True
    spikes: bool = True
    gaps: bool = True


@checked
@dataclass(frozen=True, slots=True, kw_only=True)
class ClosureOptions:
    """The closure layer (`usdface.closure`), which comes after the correction.

    Attributes
    ----------
    lids : bool
        Blinks and eyes that are held shut close on the character, and its lids do not cross.
    lips : bool
        Lips that touch on the performer touch on the character.

    Examples
    --------
    >>> usdface.ClosureOptions(lips=False).lids
    True
    """

    lids: bool = True
    lips: bool = True


@checked
@dataclass(frozen=True, slots=True, kw_only=True)
class SolveOptions:
    """The blend-shape solve.

    Attributes
    ----------
    mode : {"take", "frame"}
        "take": all frames together, smooth in time. "frame": each frame alone, exactly.
    limits : {"declared", "known"}
        Shapes that never exceed others: those that the rig declares, or also those that are
        known by name: mouthClose is at most jawOpen.
    smoothness : float
        Multiplies the smoothness that the solve derives from the markers' own noise;
        0 solves each frame alone.
    agility : float [1/s^3]
        Expected power of the second derivative of a weight over time: 27 was measured on
        real range-of-motion curves.
    prior : {"learned", "fixed"}
        "learned": which weights move, how far and which together is learned from the take
        (`usdface.retarget.solver.covariance`). "fixed": all by `agility` and `spread`.
    pace : float [rad/s]
        Where the prior is learned: weights move less above this frequency.
    spread : float [1]
        Expected size of a weight, for the ridge term (relative to the error of the markers):
        0.5 gave the best weights back on real range-of-motion curves.
    sparsity : float [1]
        L1 penalty on the weights, relative to the error of the markers: few shapes are used
        rather than many. 1 / `sparsity` is the mean of a weight that it expects; 0 = none.
    restraint : float [1]
        L1 penalty on the weights in proportion to the misfit of performer and character, relative
        to the face's size (the RMS radius of its markers): shapes that explain no more than the
        difference of two faces rest. 0 = none.
    places : {"found", "bound"}
        "found": marker positions are estimated from rest and motion, some millimetres along the
        skin from their vertices. "bound": markers sit on their vertices.
    gains : {"found", "given"}
        "found": gains are estimated for movements that surely exceed the character's, so that
        their peaks are not clipped. "given": as the performer's file has them.
    neutral : {"found", "given"}
        "found": weights that the neutral frames show are estimated from the take and subtracted,
        unless weights are given with the frames. "given": the frames are neutral.
    errors : {"found", "alike"}
        "found": markers that move unlike the face around them get less weight.
        "alike": all get the same weight.
    shrinkage : {"restored", "kept"}
        "restored": brows that the solve made too small, because the rig's blend shapes explain
        their motion badly, are scaled up to fit the markers best, up to twice. "kept": as solved.
    symmetry : float [1]
        Penalty on the difference of left and right shapes, relative to the error of the
        markers: they differ by about 1 / sqrt(`symmetry`); 0 = none.
    gaze : {"recorded", "solved"}
        "recorded": the recorded gaze (`MarkerTake.gaze`) drives the eyes. "solved": gaze is solved
        from the lids.
    vergence : float [1]
        Expected difference of the two eyes' weights for one direction of gaze: eyes move together.
        Eyes that meet 0.25 m away turn in by 7 degrees each, a fifth of a look to the side; large
        = each eye by itself.
    iterations : int
        Iterations of the whole-take solve at 30 Hz, up to twice as many at faster rates; 1.3
        times as many where the prior is learned.
    tolerance : float [1]
        The solve stops when no weight changes by more.

    Examples
    --------
    >>> usdface.SolveOptions(sparsity=2.0).smoothness
    1.0
    """

    mode: SolveMode = field(
        default="take",
        metadata=_row(
            "take: all frames together, smooth in time. frame: each frame alone, exactly.",
            choices=SolveMode,
        ),
    )
    limits: SolveLimits = field(
        default="declared",
        metadata=_row(
            "Shapes that never exceed others: those that the rig declares, or also those known by "
            "name (mouthClose is at most jawOpen).",
            choices=SolveLimits,
        ),
    )
    smoothness: float = field(
        default=1.0,
        metadata=_row(
            "Factor on the smoothness that is derived from the markers' noise [1]; 0 = each frame "
            "alone."
        ),
    )
    agility: float = field(
        default=27.0,
        metadata=_row(
            "Expected power of the second derivative of a weight [1/s^3]; larger = faster motion.",
            above_zero=True,
        ),
    )
    spread: float = field(
        default=0.5,
        metadata=_row(
            "Expected size of a weight [1]; smaller keeps weights nearer to 0.", above_zero=True
        ),
    )
    prior: SolvePrior = field(
        default="learned",
        metadata=_row(
            "learned: how far weights move, and which together, is learned from the take. fixed: "
            "by agility and spread.",
            choices=SolvePrior,
        ),
    )
    pace: float = field(
        default=8.0,
        metadata=_row(
            "Of a learned prior: weights move less above this frequency [rad/s].", above_zero=True
        ),
    )
    sparsity: float = field(
        default=0.0,
        metadata=_row(
            "L1 penalty on the weights, relative to the markers' error [1]; more = fewer shapes at "
            "once."
        ),
    )
    restraint: float = field(
        default=0.067,
        metadata=_row(
            "L1 penalty on the weights, by the misfit of two faces and the face's size [1]; more = "
            "fewer shapes on another person's face."
        ),
    )
    places: SolvePlaces = field(
        default="found",
        metadata=_row(
            "found: marker positions are estimated from rest and motion, near their vertices. "
            "bound: markers sit on their vertices.",
            choices=SolvePlaces,
        ),
    )
    gains: SolveGains = field(
        default="found",
        metadata=_row(
            "found: gains are estimated for movements that exceed the character's. given: as the "
            "performer's file has them.",
            choices=SolveGains,
        ),
    )
    neutral: SolveNeutral = field(
        default="found",
        metadata=_row(
            "found: weights that the neutral frames show are estimated and subtracted. given: the "
            "frames are neutral.",
            choices=SolveNeutral,
        ),
    )
    errors: SolveErrors = field(
        default="found",
        metadata=_row(
            "found: markers that move unlike the face around them get less weight. alike: all get "
            "the same weight.",
            choices=SolveErrors,
        ),
    )
    shrinkage: SolveShrinkage = field(
        default="restored",
        metadata=_row(
            "restored: brows that the solve made too small are scaled up to fit the markers best. "
            "kept: as solved.",
            choices=SolveShrinkage,
        ),
    )
    symmetry: float = field(
        default=0.0,
        metadata=_row(
            "Penalty on the difference of left and right, relative to the markers' error [1]."
        ),
    )
    gaze: SolveGaze = field(
        default="recorded",
        metadata=_row(
            "recorded: the recorded gaze of the take drives the eyes. solved: gaze is solved from "
            "the lids.",
            choices=SolveGaze,
        ),
    )
    vergence: float = field(
        default=0.2,
        metadata=_row(
            "Expected difference of the two eyes' gaze [1]; large = each eye by itself.",
            above_zero=True,
        ),
    )
    iterations: int = field(default=100, metadata=_row(above_zero=True))
    tolerance: float = field(default=1e-8, metadata=_row(above_zero=True))

    def __post_init__(self) -> None:
        for part in fields(self):
            part.metadata["setting"].check(part.name, getattr(self, part.name))


def solve_settings() -> dict[str, Setting]:
    """Return the settings of the solve that a shot has, by name: ``usdface:solve:<name>``."""
    settings = {part.name: part.metadata["setting"] for part in fields(SolveOptions)}
    return {name: setting for name, setting in settings.items() if setting.doc}


@checked
@dataclass(frozen=True, slots=True, kw_only=True)
class CorrectionOptions:
    """Options of the correction: emotions blended over the solved weights.

    Attributes
    ----------
    mode : {"raise", "add"}
        "raise" brings weights up to the pose and lowers none; "add" adds the pose (Zikky et al.
        2013).
    gain : float
        Factor on the poses: "raise" brings weights up to this much of them. 1 raises a face fully
        to the pose of the emotion it half shows, 0.5 not at all.
    ease : float
        How far antagonists of raised blend shapes are lowered: 1 = to 1 less the raised weight.

    Raises
    ------
    InputError
        If a value is not one of its choices or out of its range.

    Examples
    --------
    >>> usdface.CorrectionOptions(gain=0.5).mode
    'raise'
    """

    mode: CorrectionMode = "raise"
    gain: float = 1.0
    ease: float = 0.0

    def __post_init__(self) -> None:
        _check_choice("mode", self.mode, CorrectionMode)
        _check_number("gain", self.gain)
        _check_share("ease", self.ease)


@checked
@dataclass(frozen=True, slots=True, kw_only=True)
class FitOptions:
    """Options of fitting a fuzzy system (`usdface.rule_learning.fitting`).

    Attributes
    ----------
    paper : bool
        Terms from minimum, medium and maximum over the reference poses, as the fuzzy paper has
        it, instead of learned rules or the default design.
    space : {"character", "take"}
        Where features are measured: on the character after the solve, or on the performer.
    hold_out : {"auto", "recording", "variant"}
        The group that each cross-validation fold holds out; "auto" takes recordings where most
        emotions occur in several of them.

    Examples
    --------
    >>> usdface.FitOptions(space="take").hold_out
    'auto'
    """

    paper: bool = False
    space: FeatureSpace = "character"
    hold_out: HoldOut = "auto"

    def __post_init__(self) -> None:
        _check_choice("space", self.space, FeatureSpace)
        _check_choice("hold_out", self.hold_out, HoldOut)


@checked
@dataclass(frozen=True, slots=True, kw_only=True)
class ExportOptions:
    """Options of an export.

    Attributes
    ----------
    clip : str
        The one clip to write, by name; "" = all.
    pointer : bool
        Write a channel of its own for each weight, too (KHR_animation_pointer).
    quantize : bool
        Store points, normals and texture coordinates as 16-bit integers (KHR_mesh_quantization).
    asset_root : str
        A folder that textures may come from beside those of the layers that name them.
    purpose : tuple of str
        Also keep meshes of these purposes, which a render does not show: "guide", "proxy".
    influences : int
        Joints that a point keeps at most in glTF, the strongest; 0 = all.

    Examples
    --------
    >>> usdface.ExportOptions(clip="smile").quantize
    False
    """

    clip: str = ""
    pointer: bool = False
    quantize: bool = False
    asset_root: str = ""
    purpose: tuple[str, ...] = ()
    influences: int = 0

    def __post_init__(self) -> None:
        if self.influences < 0:
            raise InputError(
                f"influences is {self.influences}; expected 0 or more", "SETTING_WRONG"
            )
        object.__setattr__(self, "purpose", tuple(self.purpose))
        for purpose in self.purpose:
            _check_choice("purpose", purpose, Purpose)


@checked
@dataclass(frozen=True, slots=True, kw_only=True)
class DeliverOptions:
    """The range and the rate of a deliverable, `process(deliver=...)`.

    Attributes
    ----------
    start, end : int or None
        First and last frame of the cut, counted at `rate` on the shot's timeline; None: those of
        the take. The solve sees the whole take in any case.
    handles : int
        Frames before and after the cut that are also written, as far as the take has them.
    rate : float [Hz]
        Frames a second; 0: those of the shot (framesPerSecond).

    Examples
    --------
    >>> usdface.DeliverOptions(start=1001, end=1096, handles=8).rate
    0.0
    """

    start: int | None = None
    end: int | None = None
    handles: int = 0
    rate: float = 0.0

    def __post_init__(self) -> None:
        _check_number("rate", self.rate)
        _check_number("handles", self.handles)
        if self.start is not None and self.end is not None and self.start > self.end:
            raise InputError(
                f"the range begins at frame {self.start} and ends at {self.end}", "SETTING_WRONG"
            )


@checked
@dataclass(frozen=True, slots=True, kw_only=True)
class ImportOptions:
    """Options of reading a glTF: `usdface import`.

    `asset_root` is a folder that its buffers and images may come from beside that of the file.

    Examples
    --------
    >>> usdface.ImportOptions(asset_root="textures").asset_root
    'textures'
    """

    asset_root: str = ""


@checked
@dataclass(frozen=True, slots=True, kw_only=True)
class BindOptions:
    """The binding of a shot, beyond its binding file.

    `propose` proposes vertices for the markers that the binding file leaves out; without a file it
    is always done. `neutral` is the first and last neutral frame index, and `peaks` are indices of
    frames with strong expressions; both override the file, and "auto" detects them. Neutral frames
    are also detected if the file names none, in 3D takes and where vertices are proposed.

    Examples
    --------
    >>> usdface.BindOptions(neutral=(0, 29)).propose
    False
    """

    propose: bool = False
    neutral: tuple[int, int] | Literal["auto"] | None = None
    peaks: tuple[int, ...] | Literal["auto"] | None = None

    def __post_init__(self) -> None:
        for name in ("neutral", "peaks"):
            if isinstance(getattr(self, name), str):
                _check_choice(name, getattr(self, name), Literal["auto"])
        if isinstance(self.neutral, tuple) and not 0 <= self.neutral[0] <= self.neutral[1]:
            raise InputError(
                f"neutral frames {self.neutral[0]} to {self.neutral[1]}; expected the first and "
                "the last frame index, 0 or more",
                "SETTING_WRONG",
            )


@checked
@dataclass(frozen=True, slots=True, kw_only=True)
class MarkerOptions:
    """Search for the best places for markers.

    Attributes
    ----------
    count : int
        How many places.
    noise : float [m]
        Standard deviation of a marker coordinate, on a human face.

    Examples
    --------
    >>> usdface.MarkerOptions(count=3).noise
    0.0003
    """

    count: int = NEXT_MARKERS
    noise: float = MARKER_NOISE

    def __post_init__(self) -> None:
        _check_number("noise", self.noise)


@checked
@dataclass(frozen=True, slots=True, kw_only=True)
class ViewOptions:
    """A page that shows a face.

    Attributes
    ----------
    face_only : bool
        Leave out meshes that no blend shape moves: the page becomes smaller.
    textures : bool
        Show the images of base colours; without them materials have their plain colours.
    asset_root : str
        A folder that textures and buffers may come from beside the asset's own.
    footage : path, optional
        The images that the take was made of: every n-th one is shown with its labelled dots.
    tracks : path, optional
        The report of that take (`usdface take --report`), whose confidence colours the dots.

    Examples
    --------
    >>> usdface.ViewOptions(face_only=True).asset_root
    ''
    """

    face_only: bool = False
    textures: bool = True
    asset_root: str = ""
    footage: str | PathLike[str] | None = None
    tracks: str | PathLike[str] | None = None


@checked
@dataclass(frozen=True, slots=True, kw_only=True)
class ProcessOptions:
    """Options of one run, which override the shot's own.

    Attributes
    ----------
    express : bool
        Correct the solved weights by the expression layer.
    closure : bool
        Close eyes and lips as the shot says; False leaves them as solved and corrected.
    head : bool
        Move the character's head as the performer's moves, if the shot says so.
    clean : bool
        Clean the markers as the shot says; False solves them as recorded.
    solve : {"take", "frame"} or None
        In place of the shot's `SolveOptions.mode`.
    exaggeration : mapping of "face", "brows", "eyes", "mouth" to float
        Factors on the solved weights, in place of the shot's; those not named stay.
    gains : mapping of emotion to float
        Constant factors on the poses of emotions, in place of the shot's; those not named stay.
    trace : bool
        Keep the memberships of all terms in `ShotResult.trace`, for an explanation.

    Examples
    --------
    >>> usdface.ProcessOptions(express=False, solve="frame").head
    True
    """

    express: bool = True
    closure: bool = True
    head: bool = True
    clean: bool = True
    solve: SolveMode | None = None
    exaggeration: Mapping[str, float] = field(default_factory=dict)
    gains: Mapping[str, float] = field(default_factory=dict)
    trace: bool = False

    def __post_init__(self) -> None:
        if self.solve is not None:
            _check_choice("solve", self.solve, SolveMode)
        for part, factor in self.exaggeration.items():
            check_exaggeration(part, factor)
        for emotion, gain in self.gains.items():
            _check_number(f"gain of {emotion}", gain)
