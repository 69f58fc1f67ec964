"""Findings: losses, guesses, approximations and faults, each with a stable code.

An error stops the run (`usdface.errors`); a finding lets it go on and is shown on screen
and in the report. One code has one meaning for ever. A new code is one line in `CODES`.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from usdface.plain_text import plain

__all__ = ["CODES", "Finding", "Severity", "finding", "severest"]

_LONGEST, _LONGEST_PLACE = 800, 400  # characters

Severity = Literal["info", "warning", "error"]

CODES: dict[str, tuple[Severity, str]] = {
    # takes
    "MARKER_OCCLUDED": ("info", "a marker is occluded in some frames"),
    "MARKER_NEVER_SEEN": ("warning", "a marker is occluded in every frame and is left out"),
    "MARKER_WITHOUT_NEUTRAL": (
        "warning",
        "a marker is occluded in all neutral frames and is left out",
    ),
    "MARKER_UNBOUND": ("info", "a marker of the take is bound to no vertex and is left out"),
    "MARKER_BESIDE": (
        "info",
        "markers sit beside the vertices that they are bound to, as rest and motion show",
    ),
    "MARKER_UNKNOWN": ("warning", "the binding names a marker that the take does not have"),
    "MARKER_SWAPPED": ("warning", "labels of markers were swapped, and corrected"),
    "MARKER_SPIKE": ("info", "a marker jumped away from the face; taken as occluded there"),
    "MARKER_FILLED": ("info", "a gap of a marker was filled in"),
    "CLEANUP_SKIPPED": ("info", "too few frames or markers to clean the take up"),
    "LABEL_CHANGED": ("info", "a marker label was shortened or made unique"),
    "FRAMES_MISSING": ("warning", "the file announces more frames than it holds"),
    "FRAMES_DROPPED": ("info", "frames are missing between recorded ones; times are kept"),
    "FRAME_EMPTY": ("info", "a frame without data was left out, or all its markers are occluded"),
    "UNITS_ASSUMED": ("warning", "the file does not name its unit of length"),
    "DEFAULT_PRIM_CHOSEN": ("info", "the stage has no defaultPrim; one was chosen"),
    "UP_AXIS_ASSUMED": ("info", "the file does not name its up axis"),
    "RATE_ASSUMED": ("warning", "the file does not name its frame rate"),
    "CHANNEL_IGNORED": ("info", "a channel that usdface does not use was left out"),
    # formats of other packages
    "PLUGIN_FAILED": ("warning", "a format of another package cannot be loaded"),
    "PLUGIN_CONFLICT": ("warning", "two packages claim files of one kind"),
    # hooks of other packages
    "HOOK_APPLIED": ("info", "a hook of another package changed the data"),
    "HOOK_SKIPPED": ("info", "a hook of another package was left out"),
    # bindings of other takes, shared layers
    "FRAMES_NOT_CARRIED": (
        "warning",
        "neutral and peak frames of a binding are of another take, and are looked for anew",
    ),
    "LAYER_KEPT": ("warning", "a layer that shots share is kept, and differs from this shot's"),
    # sequences
    "PERFORMER_UNCALIBRATED": ("warning", "a performer of the show file has no calibration"),
    "SHOT_FAILED": ("error", "a shot of the sequence could not be made or processed"),
    "SHOT_MISSING": ("error", "a shot of the sequence has no result, or one that is out of date"),
    "SHOT_KEPT": ("warning", "a shot was edited, and is not made anew from what it is made of"),
    "RANGE_OUTSIDE": ("warning", "frames of the range are not in the take, and are not written"),
    # rigs
    "SHAPE_EMPTY": ("info", "a blend shape moves no point"),
    "SHAPE_SKIPPED": ("warning", "a shape file does not fit the neutral mesh and is left out"),
    "FACES_DIFFER": ("warning", "a shape file has other faces; its points may be in another order"),
    "SHAPE_TARGET_MISSING": ("error", "a blend shape target does not exist"),
    "POINT_INDICES_UNSORTED": ("info", "point indices are not sorted, which some programs require"),
    "POINT_INDICES_REPEATED": (
        "warning",
        "a point index is repeated; its offsets add up in UsdSkel",
    ),
    "POINT_INDICES_OUTSIDE": ("error", "a point index is outside the mesh"),
    "POINT_STRAY": (
        "warning",
        "a point lies or is moved far off from all others",
    ),
    "OFFSETS_LENGTH_WRONG": ("error", "offsets, normals or indices of a shape differ in number"),
    "SHAPE_NAMES_MISMATCH": ("error", "names and targets of blend shapes differ in number"),
    "SHAPE_NAME_REPEATED": ("warning", "two blend shapes of a mesh share one name"),
    "SHAPE_NAMES_MISSING": ("warning", "morph targets have no names"),
    "TARGETS_UNEQUAL": ("error", "primitives of a mesh differ in their number of morph targets"),
    "MESH_OUTSIDE": (
        "warning",
        "a mesh is outside of every SkelRoot: it is kept, without its blend shapes, which UsdSkel "
        "does not move there",
    ),
    "TOPOLOGY_DIFFERS": ("error", "faces and points do not belong together"),
    "NORMALS_MISSING": ("info", "normals are missing or do not follow a shape; shading may differ"),
    "BOUNDS_MISSING": (
        "warning",
        "positions have no min and max, which glTF requires; viewers may refuse the file",
    ),
    "INBETWEEN_WRONG": ("error", "an inbetween has no weight of its own between 0 and 1"),
    "BINDING_TARGET_MISSING": ("error", "a bound skeleton or animation does not exist"),
    "SKELROOT_MISSING": (
        "error",
        "a mesh with blend shapes is below no SkelRoot; UsdSkel moves none of them",
    ),
    "SKELETON_MISSING": (
        "error",
        "a mesh with blend shapes is bound to no skeleton; UsdSkel moves none of them",
    ),
    "SCHEMA_UNAPPLIED": ("error", "SkelBindingAPI is not applied; UsdSkel ignores the binding"),
    "ANIMATION_UNMATCHED": (
        "error",
        "an animation names no blend shape of the meshes that it moves",
    ),
    "WEIGHTS_LENGTH_WRONG": ("error", "the number of weights is not that of the blend shapes"),
    "WEIGHTS_OUT_OF_RANGE": (
        "info",
        "weights are outside 0 to 1, which is allowed but rarely intended",
    ),
    "VALUES_WRONG": ("error", "numbers are missing, cut off, NaN or infinite"),
    "SHAPE_UNKNOWN": ("warning", "a named blend shape is not on the rig"),
    "NAME_CHANGED": ("info", "a name was made unique or legal; the original is kept beside it"),
    "FACES_TRIANGULATED": ("info", "faces with more than three corners were split"),
    "NORMALS_COMPUTED": ("info", "the source has no normals; smooth ones were computed"),
    "NORMALS_FLAT": (
        "info",
        "the source has no normals: faces are lit flat, as USD and glTF define",
    ),
    "TANGENTS_COMPUTED": (
        "info",
        "tangent offsets of shapes were computed from their normal offsets",
    ),
    "INBETWEEN_DROPPED": ("warning", "an inbetween cannot be written to this format"),
    "INBETWEEN_FLAT": (
        "info",
        "inbetweens stay separate shapes: their weights were animated separately",
    ),
    "COMBINATION_IGNORED": ("warning", "a combination shape is solved as an independent one"),
    "FEATURE_DROPPED": ("warning", "the target format or this version does not support a feature"),
    "FEATURE_APPROXIMATED": (
        "warning",
        "the target format supports only an approximation of a feature",
    ),
    "EXTENSION_DROPPED": ("warning", "data of a glTF extension are left out"),
    "NODES_DROPPED": ("info", "nodes that carry nothing are left out; their transforms are kept"),
    "POINTS_ROUNDED": ("info", "points are stored as 16-bit integers, as requested"),
    "TEXTURE_CONVERTED": ("info", "a texture was converted to a format that glTF supports"),
    "TEXTURE_TILED": ("info", "each tile of a UDIM texture became a material"),
    "TEXTURE_MISSING": ("warning", "a texture file cannot be read and is left out"),
    "ASSET_OUTSIDE": (
        "warning",
        "a file outside the folder of the asset is left out; --asset-root DIR allows it",
    ),
    "INFLUENCES_MANY": (
        "warning",
        "more than four joints influence a point; some programs read four",
    ),
    "SKIN_WEIGHTS_NORMALISED": (
        "info",
        "skin weights that did not add up to 1 were brought to it, as glTF programs do",
    ),
    "POINTS_TO_SHAPES": (
        "info",
        "points that change over time became blend shapes",
    ),
    "CURVE_RESAMPLED": ("info", "an animation curve was resampled"),
    "SCALE_ROUNDED": ("info", "joint scales are stored as 16-bit floats in UsdSkel"),
    "ANIMATION_DROPPED": ("warning", "an animation was left out"),
    "ANIMATION_CREATED": ("info", "the rig has no SkelAnimation; the solve layer adds one"),
    "CONVERSION_INEXACT": ("warning", "the written file differs from its source"),
    "CONVERSION_UNCERTIFIED": ("info", "the written file could not be compared with its source"),
    # binding
    "BIND_PROPOSED": ("info", "the vertices of markers were proposed, not given"),
    "BIND_UNSURE": ("warning", "most proposed vertices have a low confidence"),
    "PLACE_DOUBTED": ("warning", "the given vertex of a marker does not fit the other markers"),
    "PLACE_UNSURE": ("warning", "the proposed vertex of a marker may be wrong"),
    "PLACES_NOT_PROPOSED": ("warning", "no vertices could be proposed for the markers of a page"),
    "NAME_CONTRADICTED": ("warning", "a marker lies elsewhere on the face than its name tells"),
    "SIDES_EXCHANGED": ("warning", "the names of the markers tell left for right"),
    "NAMES_UNUSED": ("warning", "the names of the markers fit no face; places are found without"),
    "MARKER_OFF_FACE": ("warning", "a marker is off the face and is left out"),
    "MARKER_DUPLICATE": ("warning", "two markers are always at the same position; one is left out"),
    "RIG_SIZE_UNUSUAL": ("warning", "the face is far larger or smaller than a human one"),
    "NEUTRAL_FOUND": ("info", "neutral frames were detected"),
    # retarget
    "NEUTRAL_ASSUMED": ("warning", "no neutral frames are named; the first frame is taken"),
    "NOSE_TIP_ASSUMED": ("warning", "no marker is named as the nose tip; the foremost is taken"),
    "HEAD_MARKERS_FEW": ("warning", "fewer than three head markers are visible in some frames"),
    "HEAD_MARKERS_IN_LINE": (
        "warning",
        "the head markers are collinear and leave a rotation open; all markers determine it",
    ),
    "MARKERS_FEW": ("warning", "the markers cannot distinguish all blend shapes"),
    "TAKE_STILL": ("warning", "no marker moves in the whole take"),
    "WEIGHTS_CLIPPED": ("warning", "recorded weights outside 0 to 1 were clipped"),
    "FRAME_UNSOLVED": ("warning", "frames without visible markers follow their neighbours"),
    "SOLVE_UNCOMPILED": ("info", "the inner loops of the solve run in numpy, several times slower"),
    "SHAPE_UNSEEN": ("info", "a blend shape moves no bound marker and stays at 0"),
    "SHAPE_UNSURE": (
        "info",
        "the markers hardly determine a blend shape; one at this vertex would",
    ),
    "PIN_IGNORED": (
        "warning",
        "a pin has an unknown blend shape, a frame outside the take or a weight outside 0 to 1",
    ),
    "REGION_MUTED": (
        "warning",
        "a region of the character moves less than the performer's",
    ),
    "DIRECTION_UNKNOWN": (
        "info",
        "the calibration take does not show how the performer makes a blend shape",
    ),
    "PERFORMER_UNMATCHED": (
        "warning",
        "the performer's file does not know markers as they are bound; there the shapes are the "
        "character's",
    ),
    "PERFORMER_MARKERS_MOVED": (
        "info",
        "markers sit elsewhere than in the take that the performer's file was made of",
    ),
    "GAIN_UNSEEN": ("info", "a blend shape never moves in the calibration take; its gain stays 1"),
    "GAIN_UNKNOWN": (
        "info",
        "the calibration take leaves a gain undetermined: small movement and low gain look alike",
    ),
    # expressions
    "EXPRESSION_UNKNOWN": ("warning", "the rig has no shapes for an expression"),
    "EXPRESSION_UNSEEN": (
        "warning",
        "the markers cannot distinguish an expression from the others",
    ),
    "EXPRESSION_SHARED": ("info", "the features of one expression also show a little in another"),
    "MARKERS_CANNOT_SEPARATE": ("warning", "no marker motion distinguishes two emotions"),
    "FIT_CONFUSED": ("warning", "a fitted system confuses an emotion with another"),
    "FIT_UNTESTED": ("info", "an emotion was learned from one recording and could not be tested"),
    "RULE_FIRES_AT_NEUTRAL": ("warning", "a rule fires on a neutral face"),
    "ATTRIBUTE_REPLACED": ("warning", "an attribute of another type is replaced by the result"),
    "SETTING_UNREAD": ("warning", "a setting, a curve or an override is ignored"),
    "RULE_UNREACHABLE": ("warning", "a rule can never fire"),
    "RULE_OFF": ("info", "a rule is disabled or has weight 0"),
    "RULES_CONTRADICT": ("warning", "two rules have the same antecedent and different consequents"),
    "RANGE_UNCOVERED": ("warning", "no term covers a part of an input's range"),
    "ROLE_ASSUMED": ("info", "the file names no marker for an input; the input's name was taken"),
    "MEANING_DIFFERS": ("warning", "another program evaluates the file differently"),
    "CONTACT_KEPT": ("info", "a correction was limited to keep lips or lids in contact"),
    # closure
    "EYES_CLOSED": ("info", "eyes that blink or stay shut were closed on the character"),
    "BLINK_GUESSED": ("warning", "a blink was seen on one eye only and given to both"),
    "LIDS_UNSEEN": ("info", "no marker shows the lids of an eye; its blinks are not completed"),
    "LIDS_CROSS": ("warning", "pinned weights make the lids of an eye cross"),
    "LIPS_CLOSED": ("info", "lips that touch on the performer were brought together"),
    "LIPS_UNSEEN": ("info", "no markers show the touch of the lips; it is not completed"),
    "EXPRESS_SKIPPED": ("warning", "the shot has no fuzzy system; no express layer is written"),
    # every job
    "FILE_UNREADABLE": ("error", "a file is missing, may not be read, or is of another kind"),
    "ADVICE_FAILED": (
        "info",
        "advice could not be given; the result does not depend on it",
    ),
}


@dataclass(frozen=True, slots=True)
class Finding:
    """A recoverable loss, guess or fault.

    Attributes
    ----------
    code : str
        A key of `CODES`.
    where : str
        File, prim path, marker, shape or frame range that it concerns.
    message : str
        One line.
    severity : {"info", "warning", "error"}

    Examples
    --------
    >>> _, findings = usdface.read_take("examples/performance.trc")
    >>> all(finding.severity in ("info", "warning", "error") for finding in findings)
    True
    """

    code: str
    where: str
    message: str
    severity: Severity

    def __post_init__(self) -> None:
        """Escape and shorten what came from a file."""
        object.__setattr__(self, "where", plain(self.where, _LONGEST_PLACE))
        object.__setattr__(self, "message", plain(self.message, _LONGEST))

    def as_dict(self) -> dict[str, str]:
        """Return the finding as plain values for a JSON report."""
        return {
            "code": self.code,
            "severity": self.severity,
            "where": self.where,
            "message": self.message,
        }


def finding(code: str, where: str, message: str = "") -> Finding:
    """Make a finding of a known code; the table gives severity and default message.

    Parameters
    ----------
    code : str
        A key of `CODES`.
    where : str
        The thing it is about: a marker, blend shape, prim path or file.
    message : str
        One line, in place of the default.

    Returns
    -------
    Finding

    Raises
    ------
    KeyError
        If `code` is not in `CODES` (a mistake in the program, not in its input).

    Examples
    --------
    >>> usdface.finding("MARKER_OCCLUDED", "chin", "hidden in 3 of 9 frames").severity
    'info'
    """
    severity, default = CODES[code]
    return Finding(code, where, message or default, severity)


def severest(findings: Iterable[Finding]) -> Severity:
    """Return the highest severity among `findings`; "info" when there are none."""
    order: tuple[Severity, ...] = ("info", "warning", "error")
    return max((f.severity for f in findings), key=order.index, default="info")
