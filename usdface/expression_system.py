"""The expression system: marker features, the fuzzy system that evaluates them, the correction.

`usdface.correction` measures the features (`space`, `face_unit`, `smoothing`), evaluates the
fuzzy system on them (`usdface.fuzzy`) and blends the expression poses of its outputs over the
solved weights (`likeness`, `mode`, `gain`, `response`, `evidence`, `blend_time`, `ease`).
"""

from dataclasses import dataclass
from math import isfinite
from typing import Literal

from usdface.errors import InputError
from usdface.fuzzy.system import FuzzySystem
from usdface.fuzzy.variables import check_choice
from usdface.options import (
    BLEND_TIME,
    EVIDENCE,
    FEATURE_SMOOTHING,
    RESPONSE,
    CorrectionMode,
    FeatureSpace,
)

__all__ = ["Axis", "ExpressionSystem", "FaceUnit", "MarkerFeature", "Measure"]

Axis = Literal["x", "y", "z"]
Measure = Literal["absolute", "signed"]
FaceUnit = Literal["none", "marker_spread"]

# Features smoothed longer than this [s] lose expressions.
_LONGEST_SMOOTHING = 10.0


@dataclass(frozen=True, slots=True)
class MarkerFeature:
    """A marker's distance to the nose tip along an axis, as it differs from neutral.

    Attributes
    ----------
    role : str
        Of the marker, see `usdface.setup.retarget_setup.RetargetSetup.roles`.
    axis : {"x", "y", "z"}
    measure : {"signed", "absolute"}
        Whether the difference has a sign, see `usdface.correction.features.measure`.
    """

    role: str
    axis: Axis = "y"
    measure: Measure = "signed"

    def __post_init__(self) -> None:
        if not self.role:
            raise InputError("the input has no role; name the role of the marker that it reads")
        check_choice("axis", self.axis, Axis)
        check_choice("measure", self.measure, Measure)

    @property
    def name(self) -> str:
        """Default name of the input variable that reads it."""
        return f"{self.role}_{self.axis}"


@dataclass(frozen=True, slots=True)
class ExpressionSystem:
    """A fuzzy system that recognises emotions in marker features, and how they correct weights.

    Attributes
    ----------
    fuzzy : FuzzySystem
        Its outputs are emotions.
    features : tuple of MarkerFeature
        The feature that each input of `fuzzy` reads.
    space : {"character", "take"}
        Where features are measured: on the character's markers or on the performer's.
    face_unit : {"marker_spread", "none"}
        The divisor of features: "none" leaves them in millimetres.
    smoothing : float [s]
        How far noisy features are smoothed over time, see `usdface.correction.features.smooth`.
    mode, gain
        How the emotions are blended over the weights, see `usdface.correction.take_blending`.
    response : (onset, full)
        Outputs at which a pose begins to be raised and is raised whole, see
        `usdface.correction.pose_blend.respond`; of an event, the largest output.
    evidence : float
        Similarity of solved weights to a pose at which half of it is raised, 0 to 1, see
        `usdface.correction.evidence`; 0 = rules alone decide.
    likeness : float
        How far the classifier of the whole face counts: 0 = rules alone decide; up to 0.5 it
        suppresses a rule where it finds another emotion; up to 1 it also raises emotions, see
        `usdface.correction.expression_classifier`.
    blend_time : float [s]
        Duration over which a raised pose is blended in and out, see
        `usdface.correction.temporal_blend.blended`.
    ease : float
        How far the antagonists of raised blend shapes are reduced, 0 to 1, see
        `usdface.correction.pose_blend.ease_antagonists`.

    Raises
    ------
    InputError
        If there are not as many features as inputs, or a setting cannot be used.

    Examples
    --------
    >>> shot = usdface.make_shot(
    ...     "examples/head.usdc", "examples/take.usdc", "shot.usda", bind="examples/bind.json"
    ... ).value
    >>> shot.system.emotions[:3], shot.system.mode
    (('joy', 'sadness', 'anger'), 'raise')
    """

    fuzzy: FuzzySystem
    features: tuple[MarkerFeature, ...]
    space: FeatureSpace = "character"
    face_unit: FaceUnit = "marker_spread"
    smoothing: float = FEATURE_SMOOTHING
    mode: CorrectionMode = "raise"
    gain: float = 1.0
    response: tuple[float, float] = RESPONSE
    evidence: float = EVIDENCE
    likeness: float = 0.0
    blend_time: float = BLEND_TIME
    ease: float = 0.0

    def __post_init__(self) -> None:
        if len(self.features) != len(self.fuzzy.inputs):
            raise InputError(
                f"the fuzzy system has {len(self.fuzzy.inputs)} inputs, but "
                f"{len(self.features)} marker features; expected one for each"
            )
        check_choice("space of the fuzzy system", self.space, FeatureSpace)
        check_choice("face unit of the fuzzy system", self.face_unit, FaceUnit)
        check_choice("mode of the fuzzy system", self.mode, CorrectionMode)
        if not (isfinite(self.gain) and self.gain >= 0):
            raise InputError(f"gain of the fuzzy system is {self.gain}; expected 0 or more")
        self._check_response()
        for name, seconds in (("smoothing", self.smoothing), ("blend time", self.blend_time)):
            if not 0 <= seconds <= _LONGEST_SMOOTHING:
                raise InputError(
                    f"{name} of the fuzzy system is {seconds:g}; expected seconds, 0 to "
                    f"{_LONGEST_SMOOTHING:g}"
                )
        shares = {"ease": self.ease, "evidence": self.evidence, "likeness": self.likeness}
        for name, share in shares.items():
            if not 0 <= share <= 1:
                raise InputError(f"{name} of the fuzzy system is {share}; expected 0 to 1")

    def _check_response(self) -> None:
        try:
            onset, full = map(float, self.response)
        except (TypeError, ValueError):
            onset = full = -1.0
        if not (isfinite(full) and 0 <= onset < full):
            raise InputError(
                f"response of the fuzzy system is {self.response!r}; expected an output of 0 or "
                "more, then a larger one"
            )
        object.__setattr__(self, "response", (onset, full))

    @property
    def emotions(self) -> tuple[str, ...]:
        """Names of the outputs, in the order of the columns that `evaluate` gives."""
        return self.fuzzy.output_names
