"""The binding of a shot: read from a file, proposed, or completed by a proposal."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from usdface.binding.bound_neutral import bound_neutral
from usdface.binding.neutral_frames import check_frames, neutral_frames, peak_frames, shows_poses
from usdface.binding.proposal import Proposal, proposal_findings
from usdface.binding.propose import propose
from usdface.binding.propose_film import propose_film
from usdface.binding.resolved_binding import ResolvedBinding, UnsureBindingError
from usdface.cleanup.clean import clean_take
from usdface.errors import InputError
from usdface.face.bound_face import bound_face
from usdface.face.curve_mapping import driving_curves, rename_weights, undecided
from usdface.face.curves_by_unit import curves_by_unit
from usdface.face.fitted_setup import check_vertices
from usdface.face.weights_from_neutral import resting_frames
from usdface.options import BindOptions, CleanOptions
from usdface.plain_text import listed
from usdface.rigs import Mesh, Rig
from usdface.setup.assumed_mesh import is_mesh_assumed
from usdface.setup.binding import Binding
from usdface.setup.binding_origin import check_mesh, origin_of, take_differs
from usdface.setup.performer_face import PerformerFace
from usdface.setup.retarget_setup import RetargetSetup, unbound
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["resolve_binding"]

# Findings that explain why most places are unsure.
_REASONS = ("SIDES_EXCHANGED", "NAMES_UNUSED")


def resolve_binding(
    character: Rig,
    take: MarkerTake | WeightsTake,
    given: RetargetSetup | None,
    *,
    options: BindOptions,
    performer: PerformerFace | None = None,
    source: str = "",
) -> ResolvedBinding:
    """Complete a binding: vertices, neutral and peak frames.

    Parameters
    ----------
    character : Rig
    take : MarkerTake or WeightsTake
    given : RetargetSetup or None
        As the binding file has it; without one all vertices are proposed.
    options : BindOptions
    performer : PerformerFace, optional
        Its resting markers help to find the neutral frames of a take whose markers are bound.
    source : str
        File of the binding, if it is known.

    Raises
    ------
    InputError
        If no vertices can be proposed, no curve of a take of weights has a shape's name, or the
        binding was made for another mesh, or names a vertex that the mesh does not have.
    UnsureBindingError
        If more of them are unsure than markers are bound.
    """
    mesh = _bound_mesh(character, take, given)
    assumed = given is not None and is_mesh_assumed(character, given.binding)
    if isinstance(take, MarkerTake):
        resolved = _of_markers(take, mesh, given, options, performer)
        return replace(resolved, mesh_assumed=assumed)
    named = given is not None and not given.neutral_assumed
    setup = _requested(given or unbound(take), options)
    check_frames(take, None if options.neutral == "auto" else setup.neutral, setup.peaks)
    try:
        resolved = _of_weights(take, character.shape_names, mesh, setup, named, options)
    except InputError as error:
        raise InputError(f"{source}: {error}" if source else str(error), error.code) from error
    return replace(resolved, mesh_assumed=assumed)


def _bound_mesh(
    character: Rig, take: MarkerTake | WeightsTake, given: RetargetSetup | None
) -> Mesh:
    """Return the mesh of a binding, checked; the face of a rig if none is named.

    Raises
    ------
    InputError
    """
    if given is None:
        return character.face()
    binding, of_markers = given.binding, isinstance(take, MarkerTake)
    mesh = character.mesh(binding.mesh) if binding.mesh or of_markers else character.face()
    if of_markers and given.curves and not binding.markers:
        raise InputError(
            f"the binding names curves and no markers, but the take {take.source} has markers; "
            "give one that binds them, or none",
            "TAKE_KIND_WRONG",
        )
    if given.origin is not None:
        check_mesh(given.origin, mesh)
    check_vertices(binding, mesh)
    check_vertices(given.unsure, mesh)
    return mesh


def _of_markers(
    take: MarkerTake,
    mesh: Mesh,
    given: RetargetSetup | None,
    options: BindOptions,
    performer: PerformerFace | None,
) -> ResolvedBinding:
    """Return the binding of a take of markers: vertices proposed, or given with their frames."""
    other_take = ""
    if given is not None and given.origin is not None and take_differs(given.origin, take):
        # Frames that the options name, or want detected, replace those of the binding anyway.
        other_take = _names_frames(given) if options.neutral is None else ""
        given = _without_frames(given)
    proposing = given is None or options.propose
    find_neutral = _neutral_is_missing(take, given, options)
    setup = _requested(given or RetargetSetup(Binding((), np.zeros(0, dtype=np.int64))), options)
    # Those that the binding names do not count where others are found.
    check_frames(take, None if find_neutral else setup.neutral, setup.peaks)
    resolved = ResolvedBinding(mesh, setup, neutral_found=find_neutral, other_take=other_take)
    resolved = _compared(resolved, take)
    looking = proposing or find_neutral or options.peaks == "auto"
    named = None if find_neutral or setup.neutral_assumed else setup.neutral
    labelled = _labelled(take, setup, named) if looking else take
    if proposing:
        proposal = _proposed(labelled, mesh, setup, find_neutral)
        if find_neutral:  # whose labels are right, as the solve will have it
            again = _labelled(take, setup, proposal.setup.neutral)
            if not np.array_equal(again.positions, labelled.positions, equal_nan=True):
                proposal = _proposed(again, mesh, setup, find_neutral)
        _check_sure(proposal, mesh, take)
        setup, resolved = proposal.setup, replace(resolved, proposal=proposal)
    else:
        if find_neutral:
            face = bound_face(mesh, setup)
            setup = replace(setup, neutral=bound_neutral(labelled, face, performer))
        if options.peaks == "auto":
            neutral = setup.neutral or neutral_frames(labelled)
            setup = replace(setup, peaks=peak_frames(labelled, neutral))
    if find_neutral:
        setup = replace(setup, neutral_assumed=False, neutral_weights={})
    return replace(resolved, setup=replace(setup, origin=origin_of(mesh, take)))


def _neutral_is_missing(
    take: MarkerTake, given: RetargetSetup | None, options: BindOptions
) -> bool:
    """Return whether the neutral frames are to be detected: requested, or named nowhere."""
    if options.neutral is not None:
        return options.neutral == "auto"
    if given is None:
        return True
    return given.neutral_assumed and (options.propose or shows_poses(take, given.binding.markers))


def _proposed(take: MarkerTake, mesh: Mesh, setup: RetargetSetup, find_neutral: bool) -> Proposal:
    if find_neutral and take.dimension == 2:
        return propose_film(take, mesh, setup)
    return propose(take, mesh, setup, find_neutral=find_neutral)


def _of_weights(
    take: WeightsTake,
    names: tuple[str, ...],
    mesh: Mesh,
    setup: RetargetSetup,
    named: bool,
    options: BindOptions,
) -> ResolvedBinding:
    """Return the binding of a take of weights to blend shapes, by map, name or action unit.

    Its neutral frames are detected only where the options say so. The weights of neutral frames
    that are named or detected are subtracted.
    """
    by_unit = curves_by_unit(*undecided(take.names, names, setup.curves), setup.curves)
    setup = replace(setup, curves={**setup.curves, **by_unit})
    rename_weights(take, names, setup.curves)  # refused now, and not when it is played
    driving, found = driving_curves(take, names, setup.curves), options.neutral == "auto"
    if found:
        setup = replace(setup, neutral=resting_frames(driving), neutral_assumed=False)
    if setup.neutral_removed is None:
        named = (named or options.neutral is not None) and setup.neutral is not None
        setup = replace(setup, neutral_removed=named)
    if not setup.binding.markers and take.head is None:
        setup = replace(setup, neutral_assumed=False)  # nothing is measured from it
    return ResolvedBinding(
        mesh, setup, neutral_found=found, by_unit=tuple(by_unit), driving=driving
    )


def _labelled(
    take: MarkerTake, setup: RetargetSetup, neutral: tuple[int, int] | None
) -> MarkerTake:
    """Return the take with labels corrected and without jumps, as the solve has it.

    Those of the `neutral` frames are right, if given. Of a film labels are as its dots were
    followed.
    """
    film, clean = take.dimension == 2, setup.clean
    only = CleanOptions(
        blinks=film and clean.blinks,
        swaps=not film and clean.swaps,
        spikes=clean.spikes,
        gaps=False,
    )
    cleaned, _ = clean_take(
        take, take.names, only, moving=setup.head != "stabilised", neutral=neutral
    )
    return cleaned.take


def _names_frames(setup: RetargetSetup) -> str:
    """Return the take whose frames a binding names; "" if it names none."""
    named = (not setup.neutral_assumed and setup.neutral is not None) or setup.peaks
    return (setup.origin.take or "another take") if named and setup.origin else ""


def _without_frames(setup: RetargetSetup) -> RetargetSetup:
    """Return a setup without the frames of its take; a neutral of the rig stays."""
    setup = replace(setup, peaks=())
    if setup.neutral is None:
        return setup
    return replace(setup, neutral=(0, 0), neutral_assumed=True, neutral_weights={})


def _check_sure(proposal: Proposal, mesh: Mesh, take: MarkerTake) -> None:
    """Refuse a proposal that leaves out more markers than it binds."""
    setup = proposal.setup
    unsure, bound = len(setup.unsure.markers), len(setup.binding.markers)
    if unsure <= bound:
        return
    reasons = [f.message for f in proposal_findings(proposal, take.source) if f.code in _REASONS]
    if len(subjects := _subjects(take.names)) > 1:
        reasons = [f"they are of several performers, {listed(subjects, 5)}: export those of one"]
    reason = f" ({reasons[0].split(';')[0]})" if reasons else ""
    raise UnsureBindingError(
        f"the places of {unsure} markers of {take.source} on mesh {mesh.name!r} are unsure{reason},"
        f" {bound} of {len(take.names)} are sure; place them on the page of `usdface bind`, or "
        "check the proposal of --write-bind bind.json and --bind-figure bind.png and give a few "
        "places in --bind bind.json, with --propose for the others",
        mesh,
        setup,
    )


def _subjects(names: Sequence[str]) -> list[str]:
    """Return the subjects of `subject:label` whose labels are mostly those of another, too."""
    pairs = [name.rpartition(":")[::2] for name in names if ":" in name]
    uses = Counter(label for _, label in pairs)
    labels = Counter(subject for subject, _ in pairs)
    shared = Counter(subject for subject, label in pairs if uses[label] > 1)
    return [subject for subject, count in labels.items() if 2 * shared[subject] > count]


def _requested(setup: RetargetSetup, options: BindOptions) -> RetargetSetup:
    """Return the setup with the neutral and peak frames that the options name."""
    if isinstance(options.neutral, tuple):
        setup = replace(setup, neutral=options.neutral, neutral_weights={}, neutral_assumed=False)
    if options.peaks is not None:
        setup = replace(setup, peaks=() if options.peaks == "auto" else options.peaks)
    return setup


def _compared(resolved: ResolvedBinding, take: MarkerTake) -> ResolvedBinding:
    """Compare the markers of binding and take."""
    bound, head = resolved.setup.binding.markers, resolved.setup.head_markers
    return replace(
        resolved,
        missing=tuple(name for name in bound if name not in take.names),
        unbound=tuple(name for name in take.names if name not in {*bound, *head}),
    )
