"""The expression layer: the default system of a rig, and the correction of solved weights."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from usdface.arrays import FloatArray
from usdface.correction.contact import limit_correction
from usdface.correction.feature_extraction import Features
from usdface.correction.gains import Gains
from usdface.correction.gaps import Gaps, gaps_of
from usdface.correction.pose_blend import correct, ease_antagonists, pose_shares
from usdface.correction.rule_check import check_rules
from usdface.correction.temporal_blend import blend_frames, blend_in, blend_out
from usdface.errors import InputError
from usdface.expression_system import ExpressionSystem
from usdface.face.bound_face import BoundFace
from usdface.face.layout import FaceLayout, split_poses
from usdface.face.mirror import Side
from usdface.findings import Finding, finding
from usdface.fuzzy.inference import Evaluation, evaluate
from usdface.options import MARKER_NOISE, CorrectionOptions
from usdface.retarget_setup import Expression, RetargetSetup
from usdface.rule_design.design import design_system
from usdface.rule_design.marker_roles import known_roles

__all__ = [
    "Correction",
    "ExpressionTrace",
    "SideTrace",
    "assign_roles",
    "design",
    "express",
    "expression_poses",
]


@dataclass(frozen=True, eq=False, slots=True)
class SideTrace:
    """The evaluation of the whole face, or of one half as if the other did the same.

    Attributes
    ----------
    inputs : (F, I) float64
        Features, in units of `ExpressionTrace.unit`; columns as `ExpressionSystem.inputs`.
    evaluation : Evaluation
        Emotions, firing strengths, and memberships if requested.
    shown : (F, E) float64
        The share of its pose that each emotion gets, without the gains of regions.
    """

    inputs: FloatArray
    evaluation: Evaluation
    shown: FloatArray


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


def design(
    face: BoundFace, expressions: Sequence[Expression], correction: CorrectionOptions
) -> tuple[ExpressionSystem | None, dict[str, str], list[Finding]]:
    """Design the default system from the expression poses, on the bound markers.

    Returns
    -------
    ExpressionSystem or None
        None without markers or expressions.
    dict of str to str
        Role to marker: those of the face, and others that the system reads.
    list of Finding
        EXPRESS_SKIPPED where there is no system.
    """
    roles = dict(face.roles)
    if not face.markers or not expressions:
        reason = "the rig's shapes make no expression" if face.markers else "no marker is bound"
        message = f"{reason}, so there are no rules and no express layer"
        return None, roles, [finding("EXPRESS_SKIPPED", face.mesh.path, message)]
    system, read, findings = design_system(face, expressions, MARKER_NOISE)
    system = replace(system, mode=correction.mode, gain=correction.gain, ease=correction.ease)
    return system, read | roles, findings


def assign_roles(
    system: ExpressionSystem, setup: RetargetSetup, expressions: Sequence[Expression], where: str
) -> tuple[RetargetSetup, list[Finding]]:
    """Assign the roles that a system reads to bound markers: those of the setup, or by label.

    Returns
    -------
    RetargetSetup
    list of Finding
        EXPRESSION_UNKNOWN for each emotion without a pose.

    Raises
    ------
    InputError
        If a role has no marker; `where` names the system.
    """
    names = setup.binding.markers
    # A marker may have several given roles; one without any has its label as its role.
    given = {role: name for role, name in setup.roles.items() if name in names}
    known = known_roles(names, setup.roles) | given
    required = dict.fromkeys(feature.role for feature in system.features)
    missing = [role for role in required if role not in known]
    if missing:
        roles = f"role{'s' if len(missing) > 1 else ''} {', '.join(map(repr, missing))}"
        example = ", ".join(f'"{role}": "..."' for role in missing)
        raise InputError(
            f"{where}: the fuzzy system reads the marker {roles}, which no bound marker has; "
            f'name markers for them in the binding, "roles": {{{example}}}'
        )
    posed = {expression.name for expression in expressions}
    findings = [
        finding("EXPRESSION_UNKNOWN", name, f"no expression pose for {name!r}; it moves nothing")
        for name in system.emotions
        if name not in posed
    ]
    setup = replace(setup, roles=dict(setup.roles) | {role: known[role] for role in required})
    return setup, findings


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
    poses, findings = expression_poses(system, names, expressions)
    findings += [
        finding("SHAPE_UNKNOWN", name, "it is named in a side, region or antagonist of the shot")
        for name in layout.shapes
        if name not in names
    ]
    evaluations = {
        side: evaluate(system.fuzzy, inputs, memberships=trace)
        for side, inputs in features.sides.items()
    }
    gains = gains or Gains.constant(system.gain, expressions)
    parts = _driven_parts(system, evaluations, poses, names, layout, gains)
    settings = (system.mode, gains.system, system.response)
    eased = weights
    if system.ease > 0:
        raised = correct(np.zeros(weights.shape), *parts, *settings)
        eased = ease_antagonists(weights, raised, names, layout.antagonists, system.ease)
    corrected = correct(eased, *parts, *settings)
    frames = 0
    if system.mode == "raise" and times is not None:
        frames = blend_frames(times, system.blend_time)
        corrected = blend_in(eased, corrected, frames)
    gaps = gaps_of(face, names, poses)
    corrected, new_findings = _keep_contact(weights, corrected, gaps, frames)
    findings += new_findings
    own = gains.of_emotions(system.emotions, len(weights))
    sides = {
        side: SideTrace(
            features.sides[side], evaluation, pose_shares(evaluation.outputs, own, *settings)
        )
        for side, evaluation in evaluations.items()
    }
    traced = ExpressionTrace(system, features.markers, features.unit, poses, sides)
    return Correction(corrected, traced, check_rules(system) + findings)


def _driven_parts(
    system: ExpressionSystem,
    evaluations: Mapping[Side, Evaluation],
    poses: FloatArray,
    names: tuple[str, ...],
    layout: FaceLayout,
    gains: Gains,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the parts of the poses: emotion (F, P), weights (P, T) and gain (F, P) of each."""
    parts = split_poses(poses, names, layout)
    outputs = {side: evaluation.outputs for side, evaluation in evaluations.items()}
    whole = outputs["both"]
    if len(outputs) > 1:
        # Blend shapes of neither half follow the smaller output: symmetric in left and right.
        outputs["both"] = np.minimum(outputs["left"], outputs["right"])
    strengths = np.array([outputs.get(side, whole)[:, row] for row, side, _, _ in parts])
    emotion_regions = [(system.emotions[row], region) for row, _, region, _ in parts]
    return (
        strengths.reshape(len(parts), len(whole)).T,
        np.array([pose for *_, pose in parts]).reshape(len(parts), len(names)),
        gains.of(emotion_regions, len(whole)),
    )


def expression_poses(
    system: ExpressionSystem, names: tuple[str, ...], expressions: Sequence[Expression]
) -> tuple[FloatArray, list[Finding]]:
    """Return the pose of each emotion (E, T) in blend shapes `names`; zeros where there is none."""
    poses, findings = np.zeros((len(system.emotions), len(names))), []
    by_name = {expression.name: expression for expression in expressions}
    for row, emotion in enumerate(system.emotions):
        expression = by_name.get(emotion)
        if expression is None:
            message = f"no expression pose for {emotion!r}"
            findings.append(finding("EXPRESSION_UNKNOWN", emotion, message))
            continue
        poses[row] = expression.pose(names)
        for shape in set(expression.shapes) - set(names):
            findings.append(
                finding("SHAPE_UNKNOWN", shape, f"it is named in the expression {emotion!r}")
            )
    return poses, findings


def _keep_contact(
    weights: FloatArray, corrected: FloatArray, gaps: Gaps, blend: int
) -> tuple[FloatArray, list[Finding]]:
    limited_weights, limited, excess = limit_correction(weights, corrected, gaps)
    if limited.any() and blend:
        # Less of every weight may still widen a gap more; so the limit is applied again.
        limited_weights = limit_correction(
            weights, blend_out(weights, corrected, limited_weights, blend), gaps
        )[0]
    findings = []
    for contact in dict.fromkeys(gaps.contact):
        own = np.array([name == contact for name in gaps.contact])
        frames = np.flatnonzero(limited[:, own].any(axis=1))
        if len(frames):
            message = (
                f"the correction was limited in {len(frames)} frames ({frames[0]} to {frames[-1]}) "
                f"to keep the contact, a gap by {1000 * excess[:, own].max():.1f} mm at most"
            )
            findings.append(finding("CONTACT_KEPT", contact, message))
    return limited_weights, findings
