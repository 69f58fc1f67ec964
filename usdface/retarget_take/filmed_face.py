"""The head of a 2D take: its motion is solved before the weights."""

from dataclasses import replace

import numpy as np

from usdface.arrays import FloatArray
from usdface.blas_threads import one_blas_thread
from usdface.face.bound_face import BoundFace
from usdface.face.dot_skin import DotSkin
from usdface.face.marker_surface import MarkerSurface
from usdface.findings import Finding
from usdface.progress import Progress
from usdface.retarget.bound_points import BoundPoints
from usdface.retarget.calibrated_shapes import as_large
from usdface.retarget.film.film_head import FilmedFace, film_head
from usdface.retarget.film.filmed_head import FilmedHead
from usdface.retarget.film.views import Views
from usdface.retarget.solve_take import solve_take
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake

__all__ = ["filmed_face"]


@one_blas_thread()
def filmed_face(
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
            projected, BoundPoints.on_skin(skin, face.shape_names), own,
            views=views, progress=progress,
        )  # fmt: skip
        return solution.weights.weights

    known = setup.calibration is not None and setup.calibration.face is not None
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
        refined=setup.solve.places == "found", transferred=setup.map.choice == "auto" and not known,
        weighted=setup.solve.errors == "found", shown=shown,
    )  # fmt: skip
