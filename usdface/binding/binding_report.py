"""The findings of a resolved binding: markers and curves left over, frames detected."""

from usdface.binding.proposal import proposal_findings
from usdface.binding.resolved_binding import ResolvedBinding
from usdface.face.curve_mapping import unknown_curves
from usdface.face.weights_from_neutral import rest_kept
from usdface.findings import Finding, finding, timed
from usdface.retarget.usable_markers import unknown_marker
from usdface.setup.assumed_mesh import assumed_mesh
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["binding_findings"]


def binding_findings(
    resolved: ResolvedBinding, take: MarkerTake | WeightsTake, source: str = ""
) -> list[Finding]:
    """Report the completion of a binding for a take; `source` is the file of the binding."""
    unbound = resolved.unbound
    findings = []
    if resolved.mesh_assumed:
        findings.append(assumed_mesh(resolved.mesh, source or take.source))
    findings += [unknown_marker(name, unbound, source) for name in resolved.missing]
    if isinstance(take, WeightsTake):
        findings += unknown_curves(take, resolved.setup.curves, source or take.source)
        findings += rest_kept(resolved.driving or take, resolved.setup)
    elif resolved.setup.curves:
        message = "{attribute} of the binding are for a take of weights; this one has markers"
        findings.append(finding("SETTING_UNREAD", source or take.source, message, "curves"))
    if unbound and not resolved.proposal:  # intended, or an unfinished file
        message = (
            "{unbound_count} of {marker_count} markers are bound to no vertex: {markers}; "
            "--propose finds vertices for them"
        )
        counts = len(unbound), len(take.names)
        findings.append(finding("MARKER_UNBOUND", take.source, message, *counts, unbound))
    if resolved.proposal:
        findings += proposal_findings(resolved.proposal, take.source)
    if resolved.other_take:
        message = (
            "neutral and peak frames of the binding are those of {other_take}; they are left out, "
            "and detected here where they are needed"
        )
        findings.append(finding("FRAMES_NOT_CARRIED", take.source, message, resolved.other_take))
    if resolved.by_unit:
        message = (
            "{curve_count} curves have no blend shape of their name: those of the same FACS action "
            'units follow ({curves}); --write-bind bind.json shows them as "curves", to edit'
        )
        driving = resolved.by_unit
        findings.append(finding("CURVES_BY_UNIT", take.source, message, len(driving), driving))
    if resolved.neutral_found:
        message = "the face rests in frames {first_frame} to {last_frame}: taken as neutral"
        frames = resolved.setup.neutral or (0, 0)
        found = finding("NEUTRAL_FOUND", take.source, message, *frames)
        findings += timed([found], take.times.tolist())
    return findings
