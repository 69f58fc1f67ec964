"""The solution of a clean take of markers on a bound face."""

from dataclasses import replace

from usdface.blas_threads import one_blas_thread
from usdface.cleanup.clean import Cleaned
from usdface.face.bound_face import BoundFace
from usdface.face.marker_surface import MarkerSurface
from usdface.findings import Finding
from usdface.progress import Progress
from usdface.retarget.bound_points import BoundPoints
from usdface.retarget.face_fit import TRANSFER
from usdface.retarget.film.filmed_head import FilmedHead
from usdface.retarget.markers_beside import markers_beside
from usdface.retarget.neutral_weights import neutral_weight_findings
from usdface.retarget.solution import Solution
from usdface.retarget.solve_take import solve_take
from usdface.retarget_take.filmed_face import filmed_face
from usdface.retarget_take.solver_input import solver_input
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake

__all__ = ["solve"]


@one_blas_thread()
def solve(
    take: MarkerTake,
    face: BoundFace,
    setup: RetargetSetup,
    *,
    cleaned: Cleaned | None,
    progress: Progress | None = None,
) -> tuple[Solution, list[Finding]]:
    """Solve a take that `clean` returned, on the mesh that it is bound to.

    `progress` gets a separate step if the solver must be compiled first.
    """
    take, setup, surface, findings = solver_input(take, face, setup, cleaned, progress)
    solution, new_findings = _solved(take, face, setup, surface, progress)
    if solution.filmed and solution.neutral_weights:
        # The head was solved from a neutral that shows these weights, its depths were found there.
        own = replace(setup, neutral_weights=solution.neutral_weights)
        solution, new_findings = _solved(take, face, own, surface, progress, solution.filmed)
        if not setup.neutral_weights:
            model = surface.skin.marker_evaluator
            findings += neutral_weight_findings(own, model, face.shape_names, take.source)
    return solution, findings + new_findings


def _solved(
    take: MarkerTake,
    face: BoundFace,
    setup: RetargetSetup,
    surface: MarkerSurface,
    progress: Progress | None,
    before: FilmedHead | None = None,
) -> tuple[Solution, list[Finding]]:
    """Solve a take; `before` is a filmed head without the neutral weights of the setup."""
    filmed, findings = filmed_face(take, face, setup, surface, progress, before)
    projected, views = filmed.head.projected(take) if filmed else (take, None)
    skin = filmed.skin if filmed else surface.skin
    solution, new_findings = solve_take(
        projected,
        BoundPoints.on_skin(skin, face.shape_names),
        setup,
        surface=surface,
        views=views,
        progress=progress,
    )
    if filmed:
        own = [face.markers.index(name) for name in solution.markers]
        shifts = filmed.shifts[own]
        new_findings += markers_beside(shifts, skin.rest[own], solution.markers, take.source)
        head, choice = filmed.head, solution.choice
        if not head.mapped:
            choice = replace(choice, name=TRANSFER, unexplained={})
        solution = replace(
            solution, filmed=head, pose=head.motion, shifts=shifts, choice=choice,
            errors=head.errors[[head.markers.index(name) for name in solution.markers]],
        )  # fmt: skip
    return solution, findings + new_findings
