"""The default fuzzy system of a face, and the markers that a system reads."""

from collections.abc import Sequence
from dataclasses import replace

from usdface.errors import InputError
from usdface.expression_system import ExpressionSystem
from usdface.face.bound_face import BoundFace
from usdface.findings import Finding, finding
from usdface.options import LIKENESS, CorrectionOptions
from usdface.rule_design.design import design_system
from usdface.rule_design.marker_roles import known_roles
from usdface.setup.expression import Expression
from usdface.setup.retarget_setup import RetargetSetup

__all__ = ["assign_roles", "design"]


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
        why, missing = "no marker is bound", "markers"
        if face.markers:
            why, missing = "the rig's shapes make no expression", "expressions"
        message = f"{why}, so there are no rules and no express layer"
        return None, roles, [finding("EXPRESS_SKIPPED", face.mesh.path, message, missing=missing)]
    system, read, findings = design_system(face, expressions)
    system = replace(system, mode=correction.mode, gain=correction.gain, ease=correction.ease)
    system = replace(system, likeness=LIKENESS)
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
        finding(
            "EXPRESSION_UNKNOWN",
            name,
            "no expression pose for {expression!r}; it moves nothing",
            name,
        )
        for name in system.emotions
        if name not in posed
    ]
    setup = replace(setup, roles=dict(setup.roles) | {role: known[role] for role in required})
    return setup, findings
