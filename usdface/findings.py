"""Findings: what was dropped, guessed, approximated or is wrong, each with a stable code.

An error stops the run (`usdface.errors`); a finding lets it go on and is shown on screen
and in the report. One code has one meaning for ever. A new code is one line in `CODES`.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

__all__ = ["CODES", "Finding", "Severity", "finding", "severest"]

Severity = Literal["info", "warning", "error"]

CODES: dict[str, tuple[Severity, str]] = {
    # takes
    "MARKER_OCCLUDED": ("info", "a marker is hidden in some frames"),
    "MARKER_NEVER_SEEN": ("warning", "a marker is hidden in every frame and is left out"),
    "MARKER_WITHOUT_NEUTRAL": ("warning", "hidden in all neutral frames and left out"),
    "MARKER_UNBOUND": ("info", "a marker of the take has no place on the rig and is left out"),
    "MARKER_UNKNOWN": ("warning", "the binding names a marker that the take does not have"),
    "MARKER_SWAPPED": ("warning", "markers had each other's labels; put right"),
    "MARKER_SPIKE": ("info", "a marker jumped away from the face; taken as hidden there"),
    "MARKER_FILLED": ("info", "a gap of a marker was filled in"),
    "CLEANUP_SKIPPED": ("info", "too few frames or markers to clean the take up"),
    "LABEL_CHANGED": ("info", "a marker label was shortened or made unique"),
    "FRAMES_MISSING": ("warning", "the file announces more frames than it holds"),
    "FRAMES_DROPPED": ("info", "frames are missing between recorded ones; times are kept"),
    "FRAME_EMPTY": ("info", "a frame without data was left out or is wholly occluded"),
    "UNITS_ASSUMED": ("warning", "the file does not name its unit of length"),
    "UP_AXIS_ASSUMED": ("info", "the file does not name its up axis"),
    "RATE_ASSUMED": ("warning", "the file does not name its frame rate"),
    "CHANNEL_IGNORED": ("info", "a channel that usdface does not use was left out"),
    # rigs
    "SHAPE_EMPTY": ("warning", "a blend shape moves nothing"),
    "SHAPE_SKIPPED": ("warning", "a shape file does not fit the neutral mesh and is left out"),
    "FACES_DIFFER": ("warning", "a shape file has other faces, maybe another order of points"),
    "SHAPE_TARGET_MISSING": ("error", "a blend shape target does not exist"),
    "POINT_INDICES_UNSORTED": ("info", "point indices are not sorted, which some programs need"),
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
    "TOPOLOGY_DIFFERS": ("error", "faces and points do not belong together"),
    "NORMALS_MISSING": ("info", "normals are missing or do not follow a shape; shading may differ"),
    "BOUNDS_MISSING": ("warning", "positions have no bounds, which glTF wants; viewers may refuse"),
    "INBETWEEN_WRONG": ("error", "an inbetween has no place of its own between 0 and 1"),
    "BINDING_TARGET_MISSING": ("error", "a skeleton or animation that is bound does not exist"),
    "WEIGHTS_LENGTH_WRONG": ("error", "the number of weights is not that of the blend shapes"),
    "WEIGHTS_OUT_OF_RANGE": ("info", "weights leave 0 to 1, which is allowed but rarely meant"),
    "VALUES_WRONG": ("error", "numbers are missing, cut off, NaN or infinite"),
    "SHAPE_UNKNOWN": ("warning", "a named blend shape is not on the rig"),
    "NAME_CHANGED": ("info", "a name was made unique or legal; the original is kept beside it"),
    "FACES_TRIANGULATED": ("info", "faces with more than three corners were split"),
    "NORMALS_COMPUTED": ("info", "the source has no normals; smooth ones were computed"),
    "TANGENTS_COMPUTED": (
        "info",
        "how shapes turn tangents is computed from how they turn normals",
    ),
    "INBETWEEN_DROPPED": ("warning", "an inbetween cannot be written to this format"),
    "INBETWEEN_FLAT": ("info", "inbetweens stay shapes: their weights were moved on their own"),
    "COMBINATION_IGNORED": ("warning", "a combination shape is solved as one of its own"),
    "FEATURE_DROPPED": ("warning", "the target format or this version does not hold a feature"),
    "FEATURE_APPROXIMATED": ("warning", "the target format holds only something like it"),
    "POINTS_ROUNDED": ("info", "points are stored as 16-bit integers, as was asked for"),
    "TEXTURE_CONVERTED": ("info", "a texture was converted to a format that glTF holds"),
    "TEXTURE_TILED": ("info", "each tile of a UDIM texture has a material of its own now"),
    "TEXTURE_MISSING": ("warning", "a texture file cannot be read and is left out"),
    "INFLUENCES_MANY": ("info", "more than four joints move a point; some programs read four"),
    "CURVE_RESAMPLED": ("info", "an animation curve was resampled"),
    "SCALE_ROUNDED": ("info", "UsdSkel holds scales of joints as 16-bit numbers"),
    "ANIMATION_DROPPED": ("warning", "an animation was left out"),
    "ANIMATION_CREATED": ("info", "the rig has no SkelAnimation; the solve layer adds one"),
    "CONVERSION_INEXACT": ("warning", "what was written is not what was read"),
    "CONVERSION_UNCERTIFIED": ("info", "what was written could not be compared with its source"),
    # binding
    "BIND_PROPOSED": ("info", "where markers sit was proposed, not given"),
    "BIND_UNSURE": ("warning", "most proposed places are unsure"),
    "PLACE_DOUBTED": ("warning", "the given place of a marker does not fit the others"),
    "PLACE_UNSURE": ("warning", "the proposed place of a marker may be wrong"),
    "MARKER_OFF_FACE": ("warning", "a marker lies off the face and gets no place"),
    "MARKER_DUPLICATE": ("warning", "two markers are always at one place; one is left out"),
    "NEUTRAL_FOUND": ("info", "neutral frames were looked for and found"),
    # retarget
    "NEUTRAL_ASSUMED": ("warning", "no neutral frames were named"),
    "NOSE_TIP_ASSUMED": ("warning", "no marker is named as the nose tip"),
    "HEAD_MARKERS_FEW": ("warning", "fewer than three head markers are visible in some frames"),
    "HEAD_MARKERS_IN_LINE": (
        "warning",
        "the head markers lie in a line and leave a turn open; the face's own markers decide",
    ),
    "MARKERS_FEW": ("warning", "the markers cannot tell all blend shapes apart"),
    "TAKE_STILL": ("warning", "no marker moves in the whole take"),
    "WEIGHTS_CLIPPED": ("warning", "recorded weights outside 0 to 1 were clipped"),
    "FRAME_UNSOLVED": ("warning", "frames without visible markers follow their neighbours"),
    "SHAPE_UNSEEN": ("info", "a blend shape moves no bound marker and stays at 0"),
    "SHAPE_UNSURE": (
        "info",
        "the markers say little or nothing of a blend shape; one at this vertex would show it",
    ),
    "PIN_IGNORED": ("warning", "a pin fits no blend shape, no frame or no weight in 0 to 1"),
    "GAIN_UNSEEN": ("info", "a blend shape never moves in the calibration take; its gain stays 1"),
    "GAIN_UNKNOWN": (
        "info",
        "the calibration take leaves a gain open: small movement and low gain look alike",
    ),
    # expressions
    "EXPRESSION_UNKNOWN": ("warning", "the rig has no shapes for an expression"),
    "EXPRESSION_UNSEEN": ("warning", "the markers cannot tell an expression from the others"),
    "EXPRESSION_SHARED": ("info", "the markers show a little of an expression in another"),
    "MARKERS_CANNOT_SEPARATE": ("warning", "no marker motion tells two emotions apart"),
    "FIT_CONFUSED": ("warning", "a fitted system takes an emotion for another"),
    "FIT_UNTESTED": ("info", "an emotion was learned from one recording and could not be tested"),
    "RULE_FIRES_AT_NEUTRAL": ("warning", "a rule fires on a neutral face"),
    "SETTING_UNREAD": ("warning", "a setting, a curve or an override that nothing reads"),
    "RULE_UNREACHABLE": ("warning", "a rule can never fire"),
    "RULE_OFF": ("info", "a rule is switched off or weighs 0"),
    "RULES_CONTRADICT": ("warning", "two rules ask for the same and say different values"),
    "RANGE_UNCOVERED": ("warning", "no term covers a part of an input's range"),
    "ROLE_ASSUMED": ("info", "the file names no marker for an input; its name was taken"),
    "MEANING_DIFFERS": ("warning", "another program computes something else from the file"),
    "CONTACT_KEPT": ("info", "a correction was taken back where lips or lids touch"),
    "EXPRESS_SKIPPED": ("warning", "the shot has no fuzzy system; no express layer is written"),
    # every job
    "ADVICE_FAILED": (
        "info",
        "advice could not be given; the result does not depend on it",
    ),
}


@dataclass(frozen=True, slots=True)
class Finding:
    """One recoverable fact.

    Attributes
    ----------
    code : str
        A key of `CODES`.
    where : str
        File, prim path, marker, shape or frame range that it concerns.
    message : str
        What happened, in one line.
    severity : {"info", "warning", "error"}
    """

    code: str
    where: str
    message: str
    severity: Severity

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

    Raises
    ------
    KeyError
        If `code` is not in `CODES` (a mistake in the program, not in its input).
    """
    severity, default = CODES[code]
    return Finding(code, where, message or default, severity)


def severest(findings: Iterable[Finding]) -> Severity:
    """Return the highest severity among `findings`; "info" when there are none."""
    order: tuple[Severity, ...] = ("info", "warning", "error")
    return max((f.severity for f in findings), key=order.index, default="info")
