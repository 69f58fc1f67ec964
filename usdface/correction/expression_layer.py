"""The expression layer: the correction of solved weights, and its trace."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from usdface.arrays import FloatArray
from usdface.correction.apertures import Apertures, apertures_of
from usdface.correction.combined_outputs import with_classification
from usdface.correction.contact import limit_correction
from usdface.correction.evidence import evidence_of
from usdface.correction.feature_extraction import Features
from usdface.correction.gains import Gains
from usdface.correction.held_back import held_back_findings
from usdface.correction.rule_check import check_rules
from usdface.correction.take_blending import MissingRegions, TakeBlending
from usdface.correction.temporal_blend import blend_out
from usdface.expression_system import ExpressionSystem
from usdface.face.bound_face import BoundFace
from usdface.face.mirror import Side
from usdface.findings import Finding, finding
from usdface.fuzzy.inference import Evaluation, evaluate
from usdface.setup.expression import Expression

__all__ = [
    "Correction",
    "ExpressionTrace",
    "SideTrace",
    "express",
]


@dataclass(frozen=True, eq=False, slots=True)
class SideTrace:
    """The evaluation of the whole face, or of one half mirrored to the other side.

    Attributes
    ----------
    inputs : (F, I) float64
        Features, in units of `ExpressionTrace.unit`; columns as `ExpressionSystem.inputs`.
    evaluation : Evaluation
        Emotions, of rules and classifier, firing strengths, and memberships if requested.
    intensity : (F, E) float64
        The share of its pose that each emotion gets, without the gains of regions.
    missing : mapping of "brows", "mouth" to (F, E) bool
        Frames in which a region held the correction back: it does not match the pose.
    by_rules : (F, E) float64
        Emotions of the rules alone.
    """

    inputs: FloatArray
    evaluation: Evaluation
    intensity: FloatArray
    missing: MissingRegions
    by_rules: FloatArray


@dataclass(frozen=True, eq=False, slots=True)
class ExpressionTrace:
    """Inputs and intermediate values of the correction.

    Attributes
    ----------
    system : ExpressionSystem
    markers : tuple of str, length I
        The marker that each input reads.
    unit : float [m]
        The length that features are divided by.
    poses : (E, T) float64
        Weights of each emotion's pose.
    sides : mapping of "both", "left", "right" to SideTrace
        Halves only where a blend shape belongs to one. Blend shapes of neither half follow the
        smaller output of the two halves.
    """

    system: ExpressionSystem
    markers: tuple[str, ...]
    unit: float
    poses: FloatArray
    sides: Mapping[Side, SideTrace]

    @property
    def emotions(self) -> dict[str, FloatArray]:
        """The curve (F,) of each emotion, of the whole face."""
        outputs = self.sides["both"].evaluation.outputs
        return dict(zip(self.system.emotions, outputs.T, strict=True))

    @property
    def firing(self) -> FloatArray:
        """The firing strength of each rule, of the whole face: (F, R)."""
        return self.sides["both"].evaluation.firing


@dataclass(frozen=True, eq=False, slots=True)
class Correction:
    """The corrected weights (F, T) in [0, 1], their trace, and findings."""

    weights: FloatArray
    trace: ExpressionTrace
    findings: list[Finding]


def express(
    system: ExpressionSystem,
    features: Features,
    face: BoundFace,
    *,
    names: tuple[str, ...],
    weights: FloatArray,
    expressions: Sequence[Expression],
    gains: Gains | None = None,
    times: FloatArray | None = None,
    trace: bool = False,
) -> Correction:
    """Correct weights by the features of a face.

    Parameters
    ----------
    system : ExpressionSystem
    features : Features
        Of "both" sides, and of each half if blend shapes follow the halves.
    face : BoundFace
        Sides and regions of its layout decide which evaluation a blend shape follows; contact is
        kept where it has lips and lids.
    names : tuple of str, length T
    weights : (F, T) float64
        Solved weights of the blend shapes `names`.
    expressions : sequence of Expression
    gains : Gains, optional
        Default: those of the system and of the expressions, constant over the take.
    times : (F,) float64 [s], optional
        If given, the correction is blended in over the system's blend time; otherwise each frame
        is corrected on its own.
    trace : bool
        Keep the memberships of all terms.
    """
    layout = face.layout
    poses, findings = _expression_poses(system, names, expressions)
    findings += [
        finding("SHAPE_UNKNOWN", name, "it is named in a side, region or antagonist of the shot")
        for name in layout.shapes
        if name not in names
    ]
    by_rules = {
        side: evaluate(system.fuzzy, inputs, memberships=trace)
        for side, inputs in features.sides.items()
    }
    evaluations = with_classification(system, features.classifications, by_rules, expressions)
    gains = gains or Gains.constant(system.gain, expressions)
    evidence = evidence_of(face, names, system.evidence)
    blending = TakeBlending(system, poses, names, layout, gains, evidence, weights, times)
    outputs, rules_alone = (
        {side: evaluation.outputs for side, evaluation in of.items()}
        for of in (evaluations, by_rules)
    )
    if system.mode == "add":
        blended = blending.add(outputs)
    else:
        blended = blending.raise_up(outputs, rules_alone)
    apertures = apertures_of(face, names, poses)
    corrected, new_findings = _keep_contact(
        weights, blended.weights, apertures, blending.frames, times
    )
    findings += new_findings
    findings += held_back_findings(system, outputs, blended.missing)
    sides = {
        side: SideTrace(
            features.sides[side],
            evaluation,
            blended.intensity[side],
            blended.missing[side],
            by_rules[side].outputs,
        )
        for side, evaluation in evaluations.items()
    }
    traced = ExpressionTrace(system, features.markers, features.unit, poses, sides)
    return Correction(corrected, traced, check_rules(system) + findings)


def _expression_poses(
    system: ExpressionSystem, names: tuple[str, ...], expressions: Sequence[Expression]
) -> tuple[FloatArray, list[Finding]]:
    """Return the pose of each emotion (E, T) in blend shapes `names`; zeros where there is none."""
    poses, findings = np.zeros((len(system.emotions), len(names))), []
    by_name = {expression.name: expression for expression in expressions}
    for row, emotion in enumerate(system.emotions):
        expression = by_name.get(emotion)
        if expression is None:
            message = "no expression pose for {expression!r}"
            findings.append(finding("EXPRESSION_UNKNOWN", emotion, message, emotion))
            continue
        poses[row] = expression.pose(names)
        for shape in set(expression.shapes) - set(names):
            findings.append(
                finding(
                    "SHAPE_UNKNOWN", shape, "it is named in the expression {expression!r}", emotion
                )
            )
    return poses, findings


def _keep_contact(
    weights: FloatArray,
    corrected: FloatArray,
    apertures: Apertures,
    blend: int,
    times: FloatArray | None,
) -> tuple[FloatArray, list[Finding]]:
    limited_weights, limited, excess = limit_correction(weights, corrected, apertures)
    if limited.any() and blend:
        # Smaller corrections may still change an aperture more, so the limit is applied again.
        limited_weights = limit_correction(
            weights, blend_out(weights, corrected, limited_weights, blend, times), apertures
        )[0]
    findings = []
    for contact in dict.fromkeys(apertures.contact):
        own = np.array([name == contact for name in apertures.contact])
        frames = np.flatnonzero(limited[:, own].any(axis=1))
        if len(frames):
            message = (
                "the correction was limited in {frame_count} frames ({first_frame} to "
                "{last_frame}) to keep the contact, a gap by {gap_mm:.2g} mm at most"
            )
            findings.append(
                finding(
                    "CONTACT_KEPT",
                    contact,
                    message,
                    len(frames),
                    frames[0],
                    frames[-1],
                    1000 * excess[:, own].max(),
                )
            )
    return limited_weights, findings
