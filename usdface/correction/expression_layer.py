"""The expression layer: the default system of a rig, and the correction of solved weights."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from usdface.arrays import FloatArray
from usdface.correction.contact import limit_correction
from usdface.correction.evidence import Evidence, evidence_of
from usdface.correction.feature_extraction import Features
from usdface.correction.gains import Gains
from usdface.correction.gaps import Gaps, gaps_of
from usdface.correction.pose_blend import correct, ease_antagonists, pose_shares
from usdface.correction.raised_events import (
    JudgedEvent,
    judged_events,
    raise_part,
    shown_shares,
)
from usdface.correction.rule_check import check_rules
from usdface.correction.temporal_blend import blend_frames, blend_out, blended
from usdface.errors import InputError
from usdface.expression_system import ExpressionSystem
from usdface.face.bound_face import BoundFace
from usdface.face.layout import FaceLayout, split_poses
from usdface.face.mirror import SIDES, Side, half_weights
from usdface.face.regions import GainRegion
from usdface.face.symmetry import symmetric_pairs
from usdface.findings import Finding, finding
from usdface.fuzzy.inference import Evaluation, evaluate
from usdface.options import MARKER_NOISE, CorrectionOptions
from usdface.retarget_setup import Expression, RetargetSetup
from usdface.rule_design.design import design_system
from usdface.rule_design.marker_roles import known_roles

_Outputs = Mapping[Side, FloatArray]

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
    evidence = evidence_of(face, names, system.evidence)
    blending = _Blending(system, poses, names, layout, gains, evidence, weights, times)
    outputs = {side: evaluation.outputs for side, evaluation in evaluations.items()}
    if system.mode == "add":
        corrected, shown = blending.add(outputs)
    else:
        corrected, shown = blending.raise_up(outputs)
    gaps = gaps_of(face, names, poses)
    corrected, new_findings = _keep_contact(weights, corrected, gaps, blending.frames)
    findings += new_findings
    sides = {
        side: SideTrace(features.sides[side], evaluation, shown[side])
        for side, evaluation in evaluations.items()
    }
    traced = ExpressionTrace(system, features.markers, features.unit, poses, sides)
    return Correction(corrected, traced, check_rules(system) + findings)


@dataclass(frozen=True, eq=False, slots=True)
class _Blending:
    """The poses (E, T) of a system, and the weights (F, T) that they are blended over."""

    system: ExpressionSystem
    poses: FloatArray
    names: tuple[str, ...]
    layout: FaceLayout
    gains: Gains
    evidence: Evidence
    weights: FloatArray
    times: FloatArray | None

    @property
    def frames(self) -> int:
        """Frames that a raised pose needs to come and go; 0 where each frame is on its own."""
        if self.times is None or self.system.mode == "add":
            return 0
        return blend_frames(self.times, self.system.blend_time)

    def add(self, outputs: _Outputs) -> tuple[FloatArray, _Outputs]:
        """Return weights with the paper's addition, and the share of each pose by side."""
        parts, frames = self._parts(), len(self.weights)
        drives, emotions = _driving(outputs), self.system.emotions
        strengths = np.array([drives[side][:, row] for row, side, _, _ in parts])
        strengths = strengths.reshape(len(parts), frames).T
        poses = np.array([pose for *_, pose in parts]).reshape(len(parts), len(self.names))
        regional = self.gains.of([(emotions[row], region) for row, _, region, _ in parts], frames)
        gain = self.gains.system
        from_rest = correct(np.zeros(self.weights.shape), strengths, poses, regional, "add", gain)
        corrected = correct(self._eased(from_rest), strengths, poses, regional, "add", gain)
        own = self.gains.of_emotions(emotions, frames)
        response = self.system.response
        shown = {s: pose_shares(given, own, "add", gain, response) for s, given in outputs.items()}
        return corrected, shown

    def raise_up(self, outputs: _Outputs) -> tuple[FloatArray, _Outputs]:
        """Return weights that are raised event by event, and the share of each pose by side."""
        added, reached = np.zeros(self.weights.shape), np.zeros(self.weights.shape)
        drives = _driving(outputs)
        judged: dict[tuple[int, Side], list[JudgedEvent]] = {}
        for row, side, region, part in self._parts():
            if (row, side) not in judged:
                judged[row, side] = self._judged(drives[side][:, row], row, side)
            gain = self._gain(row, region)
            raise_part(judged[row, side], self.weights, part, gain, added, reached)
        eased = self._eased(reached)
        corrected = np.clip(eased + blended(added, self.frames), 0.0, 1.0)
        shares = {}
        for side, given in outputs.items():
            columns = [
                shown_shares(self._judged(given[:, row], row, side), self._gain(row, None))
                for row in range(len(self.poses))
            ]
            shares[side] = np.array(columns).reshape(given.shape[::-1]).T
        return corrected, shares

    def _parts(self) -> list[tuple[int, Side, GainRegion | None, FloatArray]]:
        return split_poses(self.poses, self.names, self.layout)

    def _judged(self, output: FloatArray, row: int, side: Side) -> list[JudgedEvent]:
        """Return the events of an emotion on a side, whose weights and pose the other side gets."""
        weights, pose = self.weights, self.poses[row]
        if side != "both":
            pairs = symmetric_pairs(self.names)
            weights, (pose,) = (half_weights(w, pairs, side) for w in (weights, pose[None]))
        whole_take, response = self.times is not None, self.system.response
        return judged_events(output, weights, pose, self.evidence, response, whole_take)

    def _gain(self, row: int, region: GainRegion | None) -> FloatArray:
        own = self.gains.of([(self.system.emotions[row], region)], len(self.weights))[:, 0]
        return own * self.gains.system

    def _eased(self, raised: FloatArray) -> FloatArray:
        if self.system.ease == 0:
            return self.weights
        pairs = self.layout.antagonists
        return ease_antagonists(self.weights, raised, self.names, pairs, self.system.ease)


def _driving(outputs: _Outputs) -> dict[Side, FloatArray]:
    """Return the outputs that the blend shapes of each side follow.

    Those of neither half follow the smaller output: symmetric in left and right.
    """
    whole = outputs["both"]
    if len(outputs) > 1:
        whole = np.minimum(outputs["left"], outputs["right"])
    return {side: outputs.get(side, whole) if side != "both" else whole for side in SIDES}


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
