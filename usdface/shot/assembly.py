"""Assembly of a shot in memory: vertices of the markers, expression poses, a fuzzy system."""

from collections.abc import Collection, Mapping
from dataclasses import asdict, fields, replace
from typing import Any

from usdface.arguments import checked
from usdface.binding.binding_report import binding_findings
from usdface.binding.resolve_binding import resolve_binding
from usdface.blas_threads import one_blas_thread
from usdface.correction.default_system import assign_roles, design
from usdface.correction.rule_check import check_rules
from usdface.errors import InputError, did_you_mean
from usdface.expression_system import ExpressionSystem
from usdface.face.bound_face import bound_face
from usdface.face.expression_poses import ActionPose, expressions_for
from usdface.face.fitted_setup import fit_setup
from usdface.findings import Finding, finding
from usdface.numerics.solve_errors import solve_errors
from usdface.options import BindOptions, CorrectionOptions
from usdface.retarget.head_joint import face_joint
from usdface.retarget.usable_markers import check_bound_markers
from usdface.rigs import Mesh, Rig
from usdface.rule_design.marker_roles import known_roles
from usdface.setup.calibration import Calibration
from usdface.setup.expression import Expression
from usdface.setup.retarget_setup import RetargetSetup
from usdface.shot.shot import Shot
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["assemble_shot"]


@checked
@one_blas_thread()
@solve_errors()
def assemble_shot(
    rig: Rig,
    take: MarkerTake | WeightsTake,
    *,
    setup: RetargetSetup | None = None,
    setup_source: str = "",
    binding: BindOptions = BindOptions(),
    calibration: Calibration | None = None,
    poses: Mapping[str, Expression | ActionPose | None] | None = None,
    system: ExpressionSystem | None = None,
    system_source: str = "",
    correction: CorrectionOptions | Mapping[str, Any] | None = None,
) -> tuple[Shot, list[Finding]]:
    """Bring a rig and a take together, with expression poses and a fuzzy system for the rig.

    Parameters
    ----------
    rig : Rig
    take : MarkerTake or WeightsTake
    setup : RetargetSetup, optional
        Where the markers sit, as `usdface.read_bind` gives it; without one places are proposed.
    setup_source : str
        Names its file in findings.
    binding : BindOptions
    calibration : Calibration, optional
        Of the performer.
    poses : mapping of str to Expression or ActionPose, optional
        Expressions that override those known for the rig's blend shape names.
    system : ExpressionSystem, optional
        In place of one designed for the rig.
    system_source : str
        Names it in errors.
    correction : CorrectionOptions or mapping, optional
        In place of the settings of the system; a mapping of some of the fields overrides these.

    Returns
    -------
    Shot
    list of Finding

    Raises
    ------
    InputError
        If the binding does not fit rig and take, or no places can be proposed.

    Examples
    --------
    >>> rig, _ = usdface.read_rig("examples/head.usdc")
    >>> take, _ = usdface.read_take("examples/take.usdc")
    >>> bind, _ = usdface.read_bind("examples/bind.json")
    >>> shot, findings = usdface.assemble_shot(rig, take, setup=bind)
    >>> [expression.name for expression in shot.expressions][:3]
    ['joy', 'sadness', 'anger']
    """
    performer = calibration.face if calibration else None
    resolved = resolve_binding(
        rig, take, setup, options=binding, performer=performer, source=setup_source
    )
    findings = binding_findings(resolved, take, setup_source)
    mesh, bound = resolved.mesh, resolved.setup
    if calibration is not None:
        bound = replace(bound, calibration=calibration)
    if isinstance(take, MarkerTake):
        check_bound_markers(bound, take)
    elif calibration is not None:
        findings.append(finding("CALIBRATION_UNUSED", take.source))
    if bound.head_joint:  # one that the rig lacks is refused now, and not when it is to move
        face_joint(rig.skeleton, mesh, bound)
    bound, new_findings = fit_setup(bound, mesh, take)
    findings += new_findings
    expressions, new_findings = expressions_for(rig.shape_names, poses or {})
    findings += new_findings
    roles, designed = bound.roles, system is None
    overrides = asdict(correction) if isinstance(correction, CorrectionOptions) else correction
    system, bound, new_findings = _expression_system(
        mesh, bound, expressions, system, system_source, overrides or {}
    )
    findings += new_findings
    if isinstance(take, MarkerTake):
        # A system that is designed here chooses among the markers: any role may name one.
        read = known_roles(bound.binding.markers, roles) if designed else _roles_read(system)
        findings += _unread_roles(roles, read, bound, setup_source or take.source)
    face = bound_face(mesh, bound)
    layout = face.with_layout(expressions).layout if system else face.layout
    return Shot(rig, take, bound, system, expressions, layout), findings


def _roles_read(system: ExpressionSystem | None) -> set[str]:
    return {feature.role for feature in system.features} if system else set()


def _unread_roles(
    roles: Mapping[str, str], read: Collection[str], setup: RetargetSetup, source: str
) -> list[Finding]:
    """Report roles of a binding that no rule reads, or whose marker is not bound."""
    bound = setup.binding.markers
    unread = [role for role, name in roles.items() if role not in read or name not in bound]
    if not unread:
        return []
    message = "{roles}: no rule reads these roles of the binding, or their markers are not bound"
    return [finding("SETTING_UNREAD", source, message, unread)]


def _expression_system(
    mesh: Mesh,
    setup: RetargetSetup,
    expressions: tuple[Expression, ...],
    system: ExpressionSystem | None,
    source: str,
    overrides: Mapping[str, Any],
) -> tuple[ExpressionSystem | None, RetargetSetup, list[Finding]]:
    """Return the given fuzzy system, or one designed for the rig, and the setup with its roles."""
    settings = [field.name for field in fields(CorrectionOptions)]
    for name in overrides:
        if name not in settings:
            raise InputError(
                f"there is no setting {name!r} of the correction; expected {', '.join(settings)}"
                f"{did_you_mean(name, settings)}",
                "SETTING_WRONG",
            )
    correction = CorrectionOptions(**overrides)  # raises InputError for illegal values
    if system is None:
        designed, roles, findings = design(bound_face(mesh, setup), expressions, correction)
        return designed, replace(setup, roles=roles), findings
    findings = check_rules(system)
    setup, new_findings = assign_roles(system, setup, expressions, source)
    return replace(system, **overrides), setup, findings + new_findings
