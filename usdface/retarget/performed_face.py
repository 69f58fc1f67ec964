"""A performer's face in a take: learned from its solution, and fitted to the character again."""

from dataclasses import dataclass, replace

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.face.marker_surface import MarkerSurface
from usdface.findings import Finding, finding
from usdface.geometry.marker_spread import rms_radius
from usdface.geometry.rigid_fit import similarity_fit
from usdface.geometry.rigid_modes import motion_basis
from usdface.retarget.face_fit import FaceFit
from usdface.retarget.map_choice import MapChoice
from usdface.retarget.performed_directions import PerformedDirections, learn_directions
from usdface.retarget.performer_check import OTHER_PERSON, shared_difference
from usdface.retarget.places import MOST_MARKERS, PlaceGuess, guess_at_rest
from usdface.retarget.rbf import SpaceMap
from usdface.retarget.solution import Solution
from usdface.setup.performer_face import PerformerFace

__all__ = ["MatchedFace", "face_of_solution", "fit_known_face", "known_places", "match_face"]

# A marker is where it was if its neutral moved by at most this share of the face's size, 0.25 mm on
# the ICT face: a neutral of five frames with 0.3 mm of noise is within half of it. Set by hand.
_SAME = 0.004
# Fewer known markers than this do not determine a similarity between two takes.
_FEWEST = 4
# Deviation of a known place along an axis, as a share of the face's size: 1 mm on the ICT face. So
# far off are places of takes whose markers are bound 4 mm beside them, of the performers that the
# solve was built with.
_PLACE = 0.017
# Neutral frames that an exact neutral counts as: their mean is known to a thousandth of the noise.
_EXACT = 1_000_000
_NAME = "similarity, the performer's own shapes"
# Places spread by less than this share of a known place's deviation are on their vertices.
_ROUNDING = 1e-5


def face_of_solution(
    solution: Solution,
    vertices: IntArray,
    frames: int,
    *,
    gains: FloatArray,
) -> tuple[PerformerFace, PerformedDirections]:
    """Return the performer's face, learned from a solved take.

    Parameters
    ----------
    solution : Solution
        Of a 3D take.
    vertices : (M,) int64
        That its markers are bound to.
    frames : int
        Neutral frames; 0 = the neutral is known exactly.
    gains : (S,) float64
        That the take was solved with: the face has them at 1.
    """
    back = np.linalg.pinv(solution.marker_maps)
    offsets = solution.model.offsets.reshape(len(gains), -1, 3) / gains[:, None, None]
    weights = solution.weights.weights
    left = np.einsum("fmi,mij->fmj", solution.leftover(slice(None)), back)
    left[np.isnan(solution.distances)] = np.nan
    rest = solution.neutral
    size = rms_radius(rest) / rms_radius(solution.rest)
    rigid = motion_basis(rest, 3) if solution.head == "solve" else np.zeros((rest.size, 0))
    found = learn_directions(
        np.einsum("smi,mij->smj", offsets, back),
        rest,
        weights * gains,
        left,
        rigid,
        noise=size * solution.noise,
        misfit=size * solution.misfit,
    )
    face = PerformerFace(
        solution.markers,
        vertices,
        solution.shifts,
        rest,
        frames,
        solution.weights.names,
        found.displacements,
    )
    return face, found


@dataclass(frozen=True, eq=False, slots=True)
class MatchedFace:
    """A performer's face with the markers of a take.

    Attributes
    ----------
    face : PerformerFace
    surface : MarkerSurface
        The skin around the take's markers.
    known : (K,) int64
        The take's markers that the face knows, as places among its used ones.
    own : (K,) int64
        The same as places in the face.
    neutral : (M, 3) float64
        The take's resting markers, with the face's where they sit as they did.
    moved : (K, 3) float64
        Where they rest now, less where they did, in the take's space; 0 where they sit as they did.
    frames : (M,) int64 or None
        That `neutral` is the mean of; None = exact.
    """

    face: PerformerFace
    surface: MarkerSurface
    known: IntArray
    own: IntArray
    neutral: FloatArray
    moved: FloatArray
    frames: IntArray | None


def match_face(
    face: PerformerFace,
    names: tuple[str, ...],
    surface: MarkerSurface,
    neutral: FloatArray,
    frames: IntArray | None,
    source: str,
) -> tuple[MatchedFace | None, list[Finding]]:
    """Compare a performer's face with the resting markers of a take.

    Parameters
    ----------
    face : PerformerFace
    names : tuple of str, length M
        Markers of the take that are used.
    surface : MarkerSurface
        The skin around them.
    neutral : (M, 3) float64
    frames : (M,) int64 or None
        That `neutral` is the mean of; None = exact.
    source : str
        Of the take.

    Returns
    -------
    MatchedFace or None
        None where fewer than four markers are those of the face.
    list of Finding
    """
    there = zip(face.markers, face.vertices.tolist(), strict=True)
    place = {marker: k for k, marker in enumerate(there)}
    here = zip(names, surface.vertices.tolist(), strict=True)
    own = np.array([place.get(marker, -1) for marker in here])
    known = np.flatnonzero(own >= 0)
    own, others = own[known], [names[i] for i in np.flatnonzero(own < 0)]
    findings = []
    if others:
        message = "not in the performer's file, or bound to another vertex there: {markers}"
        findings.append(finding("PERFORMER_UNMATCHED", source, message, others))
    if len(known) < _FEWEST:
        return None, findings
    linear, offset = similarity_fit(face.rest[own], neutral[known])
    before = face.rest[own] @ linear + offset
    moved = neutral[known] - before
    away = np.linalg.norm(moved, axis=1) / rms_radius(neutral[known])
    shared = shared_difference(face.rest[own], neutral[known], face.displacements[:, own])
    if shared > OTHER_PERSON:
        message = (
            "the resting face differs from that of the performer's file as another person's does: "
            "markers together by {shared_percent:.1f} % of its size, {limit_percent:.1f} % at most "
            "in takes of one person"
        )
        limit = 100 * OTHER_PERSON
        findings.append(finding("PERFORMER_OTHER", source, message, 100 * shared, limit))
    if float(np.sqrt((away**2).mean() / 3.0)) > _SAME:
        message = (
            "markers rest {median_percent:.1f} % of the face's size from where they did in "
            "the performer's file, {marker} {largest_percent:.1f} %; their places follow"
        )
        findings.append(
            finding(
                "PERFORMER_MARKERS_MOVED",
                source,
                message,
                100 * np.median(away),
                names[known[away.argmax()]],
                100 * away.max(),
            )
        )
        return MatchedFace(face, surface, known, own, neutral, moved, frames), findings
    mean = neutral.copy()
    if frames is not None:
        total, earlier = frames.copy(), face.frames or _EXACT
        total[known] += earlier
        mean[known] -= (earlier / np.maximum(total[known], 1))[:, None] * moved
        frames = total
    return MatchedFace(face, surface, known, own, mean, np.zeros_like(moved), frames), findings


def known_places(matched: MatchedFace, points: FloatArray) -> PlaceGuess | None:
    """Return where the markers of a take sit, as their performer's face has it.

    Those that it does not know sit on their vertices (`points` (M, 3) [m]), give or take as much as
    their neutral suggests. None where that is no distribution of places: there are too many
    markers, or the performer rests as the character does.
    """
    if len(points) > MOST_MARKERS:
        return None
    spread = guess_at_rest(matched.neutral, points).spread
    known = _PLACE * rms_radius(points)
    if spread <= _ROUNDING * known:
        return None
    variance = np.full(len(points), spread**2)
    variance[matched.known] = min(known, spread) ** 2
    shifts = _known_shifts(matched, points)
    return PlaceGuess(shifts, np.diag(np.repeat(variance, 3)), spread)


def _known_shifts(matched: MatchedFace, points: FloatArray) -> FloatArray:
    """Return the shifts (M, 3) [m] of a face, changed as its neutral has."""
    shifts = np.zeros_like(matched.neutral)
    shifts[matched.known] = matched.face.shifts[matched.own]
    linear, _ = similarity_fit(matched.neutral, points + shifts)
    shifts[matched.known] += matched.moved @ linear
    return shifts


def fit_known_face(matched: MatchedFace, shape_names: tuple[str, ...]) -> FaceFit:
    """Lay a performer whose face is known over the character.

    Markers keep their learned places, shifted by the change of their neutral. Displacements are
    mapped by the similarity, and shapes are the performer's; markers and shapes that the face
    does not know are the character's.
    """
    face, surface, neutral = matched.face, matched.surface, matched.neutral
    learned = np.zeros_like(neutral)
    learned[matched.known] = face.shifts[matched.own]
    before = surface.at(learned)
    shifts = surface.within_reach(_known_shifts(matched, surface.mesh.points[surface.vertices]))
    placed = surface.at(shifts)
    linear, offset = similarity_fit(neutral, placed.points)
    turned, _ = similarity_fit(face.rest[matched.own], neutral[matched.known])
    shapes = np.array([k for k, name in enumerate(face.shapes) if name in shape_names], np.int64)
    columns = np.array([shape_names.index(face.shapes[k]) for k in shapes], np.int64)
    mapped = face.displacements[np.ix_(shapes, matched.own)] @ turned @ linear
    expected = before.evaluator.offsets.reshape(len(shape_names), -1, 3)
    deviations = np.zeros_like(expected)
    deviations[np.ix_(columns, matched.known)] = mapped - expected[np.ix_(columns, matched.known)]
    evaluator = placed.evaluator
    others = deviations.reshape(len(expected), -1)
    paths = tuple(
        replace(p, displacements=p.displacements + np.outer(p.weights, others[p.shape]))
        for p in evaluator.inbetweens
    )
    evaluator = replace(evaluator, offsets=evaluator.offsets + others, inbetweens=paths)
    space = SpaceMap(neutral, np.zeros_like(neutral), linear, offset, "gaussian", 1.0, local=True)
    return FaceFit(placed.points, evaluator, space, MapChoice(_NAME), shifts)
