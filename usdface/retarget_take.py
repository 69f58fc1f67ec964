"""Clean-up and solve of a take on a bound face: retarget without correction."""

from dataclasses import replace

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.blas_threads import one_blas_thread
from usdface.blend_shapes.combined_weights import with_combinations
from usdface.cleanup.clean import Cleaned, clean_take
from usdface.errors import InputError
from usdface.face.bound_face import BoundFace
from usdface.face.curve_mapping import rename_weights
from usdface.face.dot_skin import DotSkin
from usdface.face.fitted_setup import fit_setup
from usdface.face.marker_surface import MarkerSurface
from usdface.face.weights_from_neutral import weights_from_neutral
from usdface.findings import Finding, finding
from usdface.geometry.marker_spread import rms_radius
from usdface.progress import Progress
from usdface.retarget.calibrated_shapes import as_large
from usdface.retarget.calibration import Calibrated, calibrate_take
from usdface.retarget.film.dot_radii import dot_radii
from usdface.retarget.film.film_head import FilmedFace, film_head
from usdface.retarget.film.filmed_head import FilmedHead
from usdface.retarget.film.views import Views
from usdface.retarget.markers_beside import markers_beside
from usdface.retarget.neutral_weights import neutral_weight_findings
from usdface.retarget.pins import with_pins
from usdface.retarget.solution import Solution
from usdface.retarget.solve_take import solve_take
from usdface.retarget.solver.backend import compile_kernels
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake, WeightsTake

__all__ = [
    "calibrate",
    "clean",
    "clean_and_solve",
    "clean_inputs",
    "recorded_weights",
    "solve",
    "solver_input",
]


@one_blas_thread()
def clean_and_solve(
    take: MarkerTake | WeightsTake, face: BoundFace, setup: RetargetSetup
) -> tuple[MarkerTake | WeightsTake, WeightsTake, Solution | None, list[Finding]]:
    """Clean a take and solve its weights on the bound mesh.

    Parameters
    ----------
    take : MarkerTake or WeightsTake
    face : BoundFace
        Of the setup's binding.
    setup : RetargetSetup

    Returns
    -------
    take : MarkerTake or WeightsTake
        Its markers cleaned.
    weights : WeightsTake
    solution : Solution or None
        None for a take of weights.
    findings : list of Finding
    """
    take, cleaned, findings = clean(take, setup)
    weights, solution, new_findings = solve(take, face, setup, cleaned=cleaned)
    return take, weights, solution, findings + new_findings


@one_blas_thread()
def clean(
    take: MarkerTake | WeightsTake, setup: RetargetSetup
) -> tuple[MarkerTake | WeightsTake, Cleaned | None, list[Finding]]:
    """Clean the markers of a take as its setup says; a take of weights is not changed.

    Returns
    -------
    take : MarkerTake or WeightsTake
    cleaned : Cleaned or None
        The clean-up; None for a take of weights.
    findings : list of Finding
    """
    if isinstance(take, WeightsTake):
        return take, None, []
    face_markers = (*setup.binding.markers, *setup.head_markers)
    moving = setup.head != "stabilised"
    cleaned, findings = clean_take(take, face_markers, setup.clean, moving=moving)
    return cleaned.take, cleaned, findings


@one_blas_thread()
def clean_inputs(take: MarkerTake, setup: RetargetSetup) -> object:
    """Return all that `clean` depends on: the labels that are bound, and nothing else of the rig.

    In the order of the take, in which the clean-up processes them.
    """
    face_markers = {*setup.binding.markers, *setup.head_markers}
    chosen = tuple(name in face_markers for name in take.names)
    return take, chosen, setup.clean, setup.head != "stabilised"


@one_blas_thread()
def solve(
    take: MarkerTake | WeightsTake,
    face: BoundFace,
    setup: RetargetSetup,
    *,
    cleaned: Cleaned | None,
    progress: Progress | None = None,
) -> tuple[WeightsTake, Solution | None, list[Finding]]:
    """Solve the weights of a take that `clean` returned, on the mesh that it is bound to.

    `progress` gets a separate step if the solver must be compiled first.

    Returns
    -------
    weights : WeightsTake
    solution : Solution or None
        None for a take of weights; those are renamed, and get their pins and combinations.
    findings : list of Finding
    """
    if isinstance(take, WeightsTake):
        weights, findings = recorded_weights(take, face, setup)
        return weights, None, findings
    take, setup, surface, findings = solver_input(take, face, setup, cleaned, progress)
    solution, new_findings = _solved(take, face, setup, surface, progress)
    if solution.filmed and solution.neutral_weights:
        # The head was solved from a neutral that shows these weights, its depths were found there.
        own = replace(setup, neutral_weights=solution.neutral_weights)
        solution, new_findings = _solved(take, face, own, surface, progress, solution.filmed)
        if not setup.neutral_weights:
            model = surface.skin.marker_evaluator
            findings += neutral_weight_findings(own, model, face.shape_names, take.source)
    return solution.weights, solution, findings + new_findings


def _solved(
    take: MarkerTake,
    face: BoundFace,
    setup: RetargetSetup,
    surface: MarkerSurface,
    progress: Progress | None,
    before: FilmedHead | None = None,
) -> tuple[Solution, list[Finding]]:
    """Solve a take; `before` is a filmed head without the neutral weights of the setup."""
    filmed, findings = _film(take, face, setup, surface, progress, before)
    projected, views = filmed.head.projected(take) if filmed else (take, None)
    skin = filmed.skin if filmed else surface.skin
    solution, new_findings = solve_take(
        projected,
        skin.rest,
        skin.offsets,
        face.shape_names,
        setup,
        skin.marker_evaluator,
        surface=surface,
        views=views,
        progress=progress,
    )
    if filmed:
        own = [face.markers.index(name) for name in solution.markers]
        shifts = filmed.shifts[own]
        new_findings += markers_beside(shifts, skin.rest[own], solution.markers, take.source)
        head = filmed.head
        solution = replace(
            solution, filmed=head, pose=head.motion, shifts=shifts,
            errors=head.errors[[head.markers.index(name) for name in solution.markers]],
        )  # fmt: skip
    return solution, findings + new_findings


@one_blas_thread()
def recorded_weights(
    take: WeightsTake, face: BoundFace, setup: RetargetSetup
) -> tuple[WeightsTake, list[Finding]]:
    """Return a take of weights on the rig's blend shapes, with its pins and combination shapes."""
    take, findings = weights_from_neutral(take, setup)
    weights, new_findings = rename_weights(take, face.rig_shapes, setup.curves)
    findings += new_findings
    pinned = with_pins(setup.pins, weights.names, weights.times, weights.weights)
    combined = with_combinations(face.mesh.shapes, weights.names, pinned)
    return replace(weights, weights=combined), findings


@one_blas_thread()
def calibrate(
    take: MarkerTake | WeightsTake,
    face: BoundFace,
    setup: RetargetSetup,
    *,
    extremes: bool = False,
    progress: Progress | None = None,
) -> tuple[Calibrated, list[Finding]]:
    """Clean a take and find its performer's gains and offsets.

    Parameters
    ----------
    take : MarkerTake
    face : BoundFace
        Of the setup's binding.
    setup : RetargetSetup
    extremes : bool
        The take goes through the whole range of motion, each movement to its extreme.
    progress : Progress, optional
        Gets a separate step if the solver must be compiled first.

    Raises
    ------
    InputError
        If the take is of weights, or too short.
    """
    if isinstance(take, WeightsTake):
        raise InputError(
            f"{take.source} is a take of weights; a calibration needs markers, which show how "
            "large a movement is",
            "TAKE_KIND_WRONG",
        )
    _, cleaned, findings = clean(take, setup)
    take = cleaned.take if cleaned else take
    take, setup, surface, new_findings = solver_input(take, face, setup, cleaned, progress)
    filmed, camera_findings = _film(take, face, setup, surface, progress)
    skin = filmed.skin if filmed else surface.skin
    calibrated, calibration_findings = calibrate_take(
        filmed.head.still(take) if filmed else take,
        skin.rest,
        skin.offsets,
        face.shape_names,
        setup,
        skin.marker_evaluator,
        extremes,
        surface,
    )
    return calibrated, findings + new_findings + camera_findings + calibration_findings


def _film(
    take: MarkerTake,
    face: BoundFace,
    setup: RetargetSetup,
    surface: MarkerSurface,
    progress: Progress | None,
    before: FilmedHead | None = None,
) -> tuple[FilmedFace | None, list[Finding]]:
    """Solve the head motion of a 2D take, if requested; None for other takes.

    `before` is the head, solved without the neutral weights of the setup.
    """
    # The paper's map goes from the image to the character, the head's motion included.
    flat = take.dimension == 2 and setup.head == "solve" and setup.map.form != "paper"
    if not flat or setup.neutral is None:
        return None, []

    def weights(
        skin: DotSkin, projected: MarkerTake, views: Views, neutral: tuple[int, int]
    ) -> FloatArray:
        # Weights of the neutral and errors of the markers are found at last.
        given = replace(setup.solve, neutral="given", errors="alike")
        # Pins are frames of the whole take.
        own = replace(setup, neutral=neutral, pins=(), solve=given)
        solution, _ = solve_take(
            projected, skin.rest, skin.offsets, face.shape_names, own, skin.marker_evaluator,
            views=views, progress=progress,
        )  # fmt: skip
        return solution.weights.weights

    shown: FloatArray | float = 0.0
    if before is not None:
        named = np.array([[setup.neutral_weights.get(name, 0.0) for name in face.shape_names]])
        model = surface.skin.marker_evaluator
        moved = model.displacements(model.combined(named)).reshape(-1, 3)
        shown = before.in_neutral_image(
            moved[[face.markers.index(name) for name in before.markers]]
        )
    return film_head(
        take, setup.binding.markers, surface, setup.neutral, weights,
        sized=lambda shapes: as_large(shapes, face.shape_names, setup),
        refined=setup.solve.places == "found", weighted=setup.solve.errors == "found", shown=shown,
    )  # fmt: skip


@one_blas_thread()
def solver_input(
    take: MarkerTake,
    face: BoundFace,
    setup: RetargetSetup,
    cleaned: Cleaned | None,
    progress: Progress | None,
) -> tuple[MarkerTake, RetargetSetup, MarkerSurface, list[Finding]]:
    """Return the take as observed, the setup fitted to the mesh, the skin around its markers."""
    setup, findings = fit_setup(setup, face.mesh, take)
    if cleaned is not None:
        take = _observed(take, cleaned.measured, setup.head_markers)
    radii = dot_radii(take, face.markers, face.neutral)
    _check_dots(radii, face)
    known = setup.solve.limits == "known"
    surface, names = MarkerSurface(face.mesh, face.vertices, radii, known), face.shape_names
    combined = {names[combination.shape] for combination in surface.skin.evaluator.combinations}
    findings += face.findings
    findings += [
        finding(
            "PIN_IGNORED",
            pin.shape,
            "a combination shape follows the blend shapes it combines; pin those",
        )
        for pin in setup.pins
        if pin.shape in combined
    ]
    findings += compile_kernels(len(take.times), len(face.mesh.shapes), progress or Progress())
    return take, setup, surface, findings


def _observed(take: MarkerTake, measured: BoolArray, head_markers: tuple[str, ...]) -> MarkerTake:
    """Return a take without its filled gaps: the rig predicts hidden markers better.

    Not those of the head markers where fewer than three were measured (F, M): no blend shape moves
    them, and without them the head's pose is unknown.
    """
    on_head = np.isin(take.names, head_markers)
    few = measured[:, on_head].sum(axis=1) < 3
    used = measured | (few[:, None] & on_head)
    return replace(take, positions=np.where(used[..., None], take.positions, np.nan))


def _check_dots(radii: FloatArray, face: BoundFace) -> None:
    """Raise InputError where a dot (B,) [m] is as large as the face."""
    face_radius = rms_radius(face.neutral)
    large = np.flatnonzero(radii >= face_radius)
    if len(large):
        raise InputError(
            f"the dot of marker {face.markers[large[0]]!r} has a diameter of "
            f"{2.0 * radii[large[0]]:.3g} m on the character, whose markers are spread over "
            f"{2.0 * face_radius:.3g} m; expected that of a painted dot",
            "VALUES_WRONG",
        )
