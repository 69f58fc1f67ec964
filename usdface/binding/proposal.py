"""A proposal of vertices for markers, and its report."""

from dataclasses import dataclass

from usdface.binding.anchor_check import DoubtedAnchor
from usdface.findings import Finding, finding
from usdface.setup.retarget_setup import RetargetSetup

__all__ = ["ContradictedName", "DuplicateMarker", "Proposal", "proposal_findings"]


@dataclass(frozen=True, slots=True)
class DuplicateMarker:
    """A marker that is always at the position of another and is left out."""

    marker: str
    original: str


@dataclass(frozen=True, slots=True)
class ContradictedName:
    """A marker that lies elsewhere than its name says.

    Attributes
    ----------
    marker : str
    named, found : str
        Descriptions of both places.
    """

    marker: str
    named: str
    found: str


@dataclass(frozen=True, eq=False, slots=True)
class Proposal:
    """A proposed binding.

    Attributes
    ----------
    setup : RetargetSetup
        The given one with the proposed vertices, their confidence, neutral and peak frames; those
        that are more likely wrong than right are not bound but in `unsure`.
    placed : tuple of str
        Markers with a proposed vertex, bound or unsure; the others of the binding were given.
    never_seen : tuple of str
        Markers that are occluded in all frames, and left out.
    duplicates : tuple of DuplicateMarker
    doubted : tuple of (str, DoubtedAnchor)
        Markers whose given vertex does not fit the others. It is kept with a confidence of 0.
    off_face : tuple of str
        Markers off the face, which are left out; of those without a given vertex.
    contradicted : tuple of ContradictedName
        Their vertices are unsure.
    exchanged : tuple of str
        Markers whose names have left and right exchanged, as all do. Their vertices are unsure.
    names_unused : bool
        The names have known places, but as a whole fit no face.
    placeless : tuple of str
        Markers of an image whose names tell no place, which are left out.
    failed : tuple of Finding
        ADVICE_FAILED where the confidence is unknown (NaN).
    """

    setup: RetargetSetup
    placed: tuple[str, ...]
    never_seen: tuple[str, ...] = ()
    duplicates: tuple[DuplicateMarker, ...] = ()
    doubted: tuple[tuple[str, DoubtedAnchor], ...] = ()
    off_face: tuple[str, ...] = ()
    contradicted: tuple[ContradictedName, ...] = ()
    exchanged: tuple[str, ...] = ()
    names_unused: bool = False
    placeless: tuple[str, ...] = ()
    failed: tuple[Finding, ...] = ()


def proposal_findings(proposal: Proposal, source: str) -> list[Finding]:
    """Report a proposal for the take `source`."""
    findings = [*_left_out_findings(proposal), *_name_findings(proposal, source)]
    if proposal.placeless:
        message = "the names of {marker_count} markers are no known places on a face; left out"
        names = list(proposal.placeless)
        findings.append(finding("PLACE_UNKNOWN", source, message, len(names), markers=names))
    findings += proposal.failed
    message = "the vertices of {marker_count} markers are proposed; check them before use"
    findings.append(finding("BIND_PROPOSED", source, message, len(proposal.placed)))
    return findings + _unsure_findings(proposal, source)


def _left_out_findings(proposal: Proposal) -> list[Finding]:
    """Report markers that take no part in the proposal."""
    findings = [finding("MARKER_NEVER_SEEN", name) for name in proposal.never_seen]
    findings += [
        finding(
            "MARKER_DUPLICATE",
            one.marker,
            "always at the position of {same_as!r}; left out",
            one.original,
        )
        for one in proposal.duplicates
    ]
    findings += [
        finding(
            "PLACE_DOUBTED",
            name,
            "given at vertex {vertex}, but it fits vertex {fitting_vertex}, "
            "{distance_mm:.0f} mm away along the skin; kept there, and not used to place "
            "the others",
            anchor.given,
            anchor.better,
            1000.0 * anchor.distance,
        )
        for name, anchor in proposal.doubted
    ]
    findings += [
        finding("MARKER_OFF_FACE", name, "it is off the face and is left out")
        for name in proposal.off_face
    ]
    return findings


def _unsure_findings(proposal: Proposal, source: str) -> list[Finding]:
    """Report vertices of low confidence, and whether they are most."""
    unsure, count = proposal.setup.unsure, len(proposal.placed)
    assert unsure.confidence is not None
    findings = [
        finding(
            "PLACE_UNSURE",
            name,
            "vertex {vertex} is proposed with a confidence of {confidence:.2f}; left out",
            vertex,
            share,
        )
        for name, vertex, share in zip(
            unsure.markers, unsure.points, unsure.confidence, strict=True
        )
    ]
    if 2 * len(unsure.markers) > count:
        message = (
            "{unsure_count} of {marker_count} proposed vertices have a low confidence and "
            "are left out; give a few of them in --bind bind.json, with --propose for the "
            "others"
        )
        findings.append(finding("BIND_UNSURE", source, message, len(unsure.markers), count))
    return findings


def _name_findings(proposal: Proposal, source: str) -> list[Finding]:
    """Report contradictions between the names of markers and where they lie."""
    findings = [
        finding(
            "NAME_CONTRADICTED",
            one.marker,
            "named as {named}, but at {found}",
            one.named,
            one.found,
        )
        for one in proposal.contradicted
        if not proposal.names_unused
    ]
    if proposal.names_unused:
        message = (
            "the places of the names do not fit the face: {contradicted_count} markers lie "
            "elsewhere; places are proposed without names"
        )
        findings.append(finding("NAMES_UNUSED", source, message, len(proposal.contradicted)))
    if proposal.exchanged:
        message = (
            "left and right are exchanged in {exchanged_count} marker names: named from the "
            "camera's side, or the take is mirrored; give the vertex of one of them in --bind "
            "bind.json, with --propose for the others"
        )
        findings.append(finding("SIDES_EXCHANGED", source, message, len(proposal.exchanged)))
    return findings
