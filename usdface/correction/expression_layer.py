"""The expression layer over solved weights: designed for a rig, and at work."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from usdface.arrays import FloatArray
from usdface.correction.contact import Gaps, gaps_of, hold
from usdface.correction.gains import Gains
from usdface.correction.pose_blend import correct, eased
from usdface.correction.rule_check import check_rules
from usdface.correction.temporal_blend import blend_frames, blended_in, blended_out
from usdface.errors import InputError
from usdface.expression_system import ExpressionSystem
from usdface.face.layout import FaceParts, find_parts, pose_parts
from usdface.face.mirror import Side
from usdface.findings import Finding, finding
from usdface.fuzzy.inference import Evaluation, evaluate
from usdface.options import MARKER_NOISE, CorrectionOptions
from usdface.retarget_setup import Expression, RetargetSetup
from usdface.rigs import Mesh
from usdface.rule_design.design import design_system
from usdface.rule_design.marker_roles import known_roles

__all__ = [
    "Character",
    "Expressed",
    "adopt",
    "design",
    "express",
    "expression_poses",
    "parts_of",
]


@dataclass(frozen=True, eq=False, slots=True)
class Character:
    """What a correction respects on a character besides its weights.

    Attributes
    ----------
    mesh : Mesh or None
        None: contact is not looked at.
    parts : FaceParts
    gains : Gains or None
        None: those of the system and of the expressions, at all times.
    """

    mesh: Mesh | None = None
    parts: FaceParts = field(default_factory=FaceParts)
    gains: Gains | None = None


@dataclass(frozen=True, eq=False, slots=True)
class Expressed:
    """What the expression layer made of solved weights.

    Attributes
    ----------
    weights : (F, T) float64 in [0, 1]
        Corrected.
    emotions : mapping of str to (F,) float64
        Of the whole face.
    firing : (F, R) float64
        How far each rule fires, of the whole face.
    findings : list of Finding
    """

    weights: FloatArray
    emotions: dict[str, FloatArray]
    firing: FloatArray
    findings: list[Finding]


def design(
    mesh: Mesh,
    setup: RetargetSetup,
    expressions: Sequence[Expression],
    correction: CorrectionOptions,
) -> tuple[ExpressionSystem | None, RetargetSetup, list[Finding]]:
    """Design the default system from the expression poses, on the bound markers.

    Returns
    -------
    ExpressionSystem or None
        None without markers or expressions.
    RetargetSetup
        With the roles that the system's variables name; those it has already win.
    list of Finding
        EXPRESS_SKIPPED where there is no system.
    """
    points = setup.binding.points
    if not len(points) or not expressions:
        reason = "the rig's shapes make no expression" if len(points) else "no marker is bound"
        message = f"{reason}, so there are no rules and no express layer"
        return None, setup, [finding("EXPRESS_SKIPPED", mesh.path, message)]
    system, roles, findings = design_system(
        setup.binding.markers,
        mesh.points[points],
        mesh.offsets_at(points),
        mesh.shape_names,
        expressions,
        setup.nose_tip,
        MARKER_NOISE,
    )
    system = replace(system, mode=correction.mode, gain=correction.gain, ease=correction.ease)
    return system, replace(setup, roles=roles | dict(setup.roles)), findings


def adopt(
    system: ExpressionSystem, setup: RetargetSetup, expressions: Sequence[Expression], where: str
) -> tuple[RetargetSetup, list[Finding]]:
    """Give the roles that a system names to bound markers: those of the setup, or by label.

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
    # A marker may play several roles that are given; its label is one more for those without any.
    given = {role: name for role, name in setup.roles.items() if name in names}
    known = known_roles(names, setup.roles) | given
    asked = dict.fromkeys(feature.role for feature in system.features)
    missing = [role for role in asked if role not in known]
    if missing:
        roles = f"role{'s' if len(missing) > 1 else ''} {', '.join(map(repr, missing))}"
        said = ", ".join(f'"{role}": "..."' for role in missing)
        raise InputError(
            f"{where}: the fuzzy system reads the marker {roles}, which no bound marker has; "
            f'name markers for them in the binding, "roles": {{{said}}}'
        )
    posed = {expression.name for expression in expressions}
    findings = [
        finding("EXPRESSION_UNKNOWN", name, f"no expression pose for {name!r}; it moves nothing")
        for name in system.emotions
        if name not in posed
    ]
    setup = replace(setup, roles=dict(setup.roles) | {role: known[role] for role in asked})
    return setup, findings


def parts_of(mesh: Mesh, setup: RetargetSetup, expressions: Sequence[Expression]) -> FaceParts:
    """Find the parts of a bound face; the nose tip is on its midline."""
    place = dict(zip(setup.binding.markers, setup.binding.points.tolist(), strict=True))
    nose = place.get(setup.nose_tip)
    return find_parts(mesh, expressions, 0.0 if nose is None else float(mesh.points[nose, 0]))


def express(
    system: ExpressionSystem,
    inputs: Mapping[Side, FloatArray],
    names: tuple[str, ...],
    weights: FloatArray,
    expressions: Sequence[Expression],
    character: Character = Character(),
    times: FloatArray | None = None,
) -> Expressed:
    """Correct weights (F, T) of shapes `names` by what the system reads off a face.

    The `inputs` (F, I) are those of "both" sides (`usdface.correction.feature_extraction`). Shapes
    of the left and the right half follow the inputs of theirs, if there are any. What is raised is
    blended in over the system's blend time if the frames have `times` (F,) [s]; otherwise each
    frame is corrected on its own.
    """
    parts = character.parts
    poses, findings = expression_poses(system, names, expressions)
    findings += [
        finding("SHAPE_UNKNOWN", name, "a side, region or antagonist of the shot names it")
        for name in parts.shapes
        if name not in names
    ]
    answers = {side: evaluate(system.fuzzy, read) for side, read in inputs.items()}
    gains = character.gains or Gains.constant(system.gain, expressions)
    asked = _asked(system, answers, poses, names, parts, gains)
    how = (system.mode, gains.system, system.response)
    begun = weights
    if system.ease > 0:
        raised = correct(np.zeros(weights.shape), *asked, *how)
        begun = eased(weights, raised, names, parts.antagonists, system.ease)
    corrected = correct(begun, *asked, *how)
    over = 0
    if system.mode == "raise" and times is not None:
        over = blend_frames(times, system.blend_time)
        corrected = blended_in(begun, corrected, over)
    if character.mesh is not None:
        gaps = gaps_of(character.mesh, parts, names, poses)
        corrected, more = _in_contact(weights, corrected, gaps, over)
        findings += more
    heard = answers["both"]
    emotions = dict(zip(system.emotions, heard.outputs.T, strict=True))
    return Expressed(corrected, emotions, heard.firing, check_rules(system) + findings)


def _asked(
    system: ExpressionSystem,
    answers: Mapping[Side, Evaluation],
    poses: FloatArray,
    names: tuple[str, ...],
    parts: FaceParts,
    gains: Gains,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return how strong each part of a pose is asked for (F, P), it (P, T), and its gain (F, P)."""
    cut = pose_parts(poses, names, parts)
    drive = {side: answer.outputs for side, answer in answers.items()}
    heard = drive["both"]
    if len(drive) > 1:
        # What belongs to no side follows what both say, so that left is as right.
        drive["both"] = np.minimum(drive["left"], drive["right"])
    strengths = np.array([drive.get(side, heard)[:, row] for row, side, _, _ in cut])
    driven = [(system.emotions[row], region) for row, _, region, _ in cut]
    return (
        strengths.reshape(len(cut), len(heard)).T,
        np.array([pose for *_, pose in cut]).reshape(len(cut), len(names)),
        gains.of(driven, len(heard)),
    )


def expression_poses(
    system: ExpressionSystem, names: tuple[str, ...], expressions: Sequence[Expression]
) -> tuple[FloatArray, list[Finding]]:
    """Return the pose of each emotion (E, T) in shapes `names`; zeros where the rig has none."""
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
            findings.append(finding("SHAPE_UNKNOWN", shape, f"{emotion!r} names it"))
    return poses, findings


def _in_contact(
    weights: FloatArray, corrected: FloatArray, gaps: Gaps, blend: int
) -> tuple[FloatArray, list[Finding]]:
    held, limited, excess = hold(weights, corrected, gaps)
    if limited.any() and blend:
        # Of a sum of motions, less of each may be more in all; then it is held once more.
        held = hold(weights, blended_out(weights, corrected, held, blend), gaps)[0]
    findings = []
    for seam in dict.fromkeys(gaps.seam):
        own = np.array([name == seam for name in gaps.seam])
        frames = np.flatnonzero(limited[:, own].any(axis=1))
        if len(frames):
            message = (
                f"the correction was taken back in {len(frames)} frames ({frames[0]} to "
                f"{frames[-1]}); it would have moved what touches by up to "
                f"{1000 * excess[:, own].max():.1f} mm more"
            )
            findings.append(finding("CONTACT_KEPT", seam, message))
    return held, findings
