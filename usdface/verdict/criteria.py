"""The criteria of a verdict: a measure, its two limits, and the remedy.

Limits lie between takes that are known to be good and takes that were degraded on purpose;
``python -m benchmarks.verdict`` prints both (docs/verdict.md).
"""

from dataclasses import dataclass

import numpy as np

__all__ = ["CRITERIA", "Criterion"]


@dataclass(frozen=True, slots=True)
class Criterion:
    """A criterion of a verdict.

    Attributes
    ----------
    code : str
        Stable.
    look_at : float
        From this value of the measure on a person should look at the result.
    not_usable : float
        From this value on the result is not usable; infinite: never for this reason alone.
    subject : str
        The defect, in a line; ``{value}`` and ``{where}`` are filled in.
    remedy : str
        Advice that mends it.
    unit : str
        Of the measure: "" for a share of 1.
    """

    code: str
    look_at: float
    not_usable: float
    subject: str
    remedy: str
    unit: str = ""


_BINDING = "usdface shot ... --write-bind bind.json --bind-figure bind.png"

CRITERIA: tuple[Criterion, ...] = (
    Criterion(
        "SIDES_MIRRORED",
        1.3,
        1.5,
        "the markers fit the mirrored face {value} times better",
        "exchange the left and right labels of the take or of the binding; "
        "of coordinates with left-handed axes, negate one axis in the take instead",
        unit="times",
    ),
    Criterion(
        "PLACES_MISFIT",
        0.17,
        0.28,
        "at rest the markers lie {value} of their spread beside their vertices, most {where}",
        f"check the binding: {_BINDING}",
    ),
    Criterion(
        "PLACE_WRONG",
        18.0,
        np.inf,
        "at rest one marker lies {value} mm beside its vertex, far more than the others: {where}",
        f"check its vertex and its label: {_BINDING}",
        unit="mm",
    ),
    Criterion(
        "MOTION_UNEXPLAINED",
        0.3,
        0.7,
        "the blend shapes leave {value} of the motion in their reach unexplained, most {where}",
        f"check where these markers sit ({_BINDING}) and whether the character has blend shapes "
        "for this motion",
    ),
    Criterion(
        "MOTION_BEYOND_SHAPES",
        0.3,
        np.inf,
        "{value} of the motion is beyond the character's blend shapes, most {where}",
        "add or enlarge blend shapes there; the rest of the face follows all the same",
    ),
    Criterion(
        "NEUTRAL_EXPRESSIVE",
        0.18,
        0.3,
        "the neutral frames show an expression: {value} of the motion is away from it ({where})",
        "name frames in which the face rests: usdface shot ... --neutral FIRST LAST, or auto",
    ),
    Criterion(
        "NEUTRAL_AT_LIMIT",
        0.5,  # `usdface.retarget.neutral_weights.LARGEST`, at which the estimate ends
        np.inf,
        "the neutral frames show {value} or more of a blend shape: {where}",
        "name frames in which the face rests: usdface shot ... --neutral FIRST LAST",
    ),
    Criterion(
        "NOISE_LARGE",
        0.4,
        0.9,
        "noise of the markers is {value} of all motion",
        "check the capture; usdface:solve:smoothness above 1 smooths more",
    ),
    Criterion(
        "MARKER_ASTRAY",
        2.5,
        np.inf,
        "a marker is {value} mm from the solved face in the mean: {where}",
        "look at its track and its vertex; leave it out of the binding if it is lost",
        unit="mm",
    ),
    Criterion(
        "BINDING_UNSURE",
        0.15,
        0.5,
        "{value} of the places are unsure: {where}",
        f"place them by hand: {_BINDING}",
    ),
    Criterion(
        "PLACES_BESIDE",
        5.0,
        np.inf,
        "half the markers sit {value} mm or more beside their vertices, as the take shows",
        f"correct the binding: {_BINDING}",
        unit="mm",
    ),
    Criterion(
        "MARKERS_OCCLUDED",
        0.3,
        0.7,
        "markers are occluded in {value} of the take, most {where}",
        "check the labels; leave out markers that are hardly seen",
    ),
    Criterion(
        "SHAPES_UNDETERMINED",
        0.36,
        0.42,
        "the markers leave half the blend shapes undetermined: standard deviation {value}",
        "add markers where the report says (next markers), or choose a character with fewer shapes",
    ),
    Criterion(
        "SHAPE_RESTS_OPEN",
        0.35,
        np.inf,
        "a blend shape rests open: {where} is above {value} in nine tenths of the take",
        "check the neutral frames, or pin it",
    ),
    Criterion(
        "WEIGHTS_AT_LIMIT",
        0.15,
        np.inf,
        "a blend shape is at its limit in {value} of the take: {where}",
        "the performer goes beyond the character: a lower --exaggeration, usdface calibrate, or a "
        "larger shape",
    ),
    Criterion(
        "REGION_FLAT",
        2.0,
        np.inf,
        "the skin of a region travels {value} times less than the performer's: {where}",
        "check its markers' vertices and the character's blend shapes; REGION_MUTED says whether "
        "--exaggeration helps",
        unit="times",
    ),
    Criterion(
        "PERFORMANCE_STILL",
        0.01,
        0.5,
        "the face does not move: {value} of the least motion of a performance are missing",
        "check the take, its frames and its labels: usdface view shows the motion",
    ),
    Criterion(
        "PERFORMANCE_SHORT",
        0.5,
        np.inf,
        "the take is too short for a performance: {where}, {value} less than a second",
        "check that all of it was exported and read; a pose alone is no performance",
    ),
    Criterion(
        "CURVES_IDLE",
        0.4,
        np.inf,
        "{value} of the recorded motion moves no blend shape: {where}",
        "name blend shapes for these curves: usdface shot ... --write-bind bind.json; or choose a "
        "character that has them",
    ),
    Criterion(
        "TAKE_SIZE",
        2.0,
        np.inf,
        "the performer's face is {value} times as {where} as a human one",
        "name the unit of length: usdface take ... --units",
        unit="times",
    ),
    Criterion(
        "RIG_SIZE",
        2.0,
        np.inf,
        "the character's face is {value} times as {where} as a human one; all millimetres are its "
        "own",
        "if it is meant to be human, scale it where it was made (glTF is in metres, USD in its "
        "metersPerUnit), or name the unit of a folder's meshes: usdface rig ... --meters-per-unit",
        unit="times",
    ),
)
