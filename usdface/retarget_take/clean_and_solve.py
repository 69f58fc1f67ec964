"""Clean-up and solve of a take on a bound face: retarget without correction."""

from usdface.blas_threads import one_blas_thread
from usdface.face.bound_face import BoundFace
from usdface.findings import Finding
from usdface.retarget.solution import Solution
from usdface.retarget_take.clean import clean
from usdface.retarget_take.recorded_weights import recorded_weights
from usdface.retarget_take.solve import solve
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["clean_and_solve"]


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
    if isinstance(take, WeightsTake):
        weights, findings = recorded_weights(take, face, setup)
        return take, weights, None, findings
    cleaned, findings = clean(take, setup)
    solution, new_findings = solve(cleaned.take, face, setup, cleaned=cleaned)
    return cleaned.take, solution.weights, solution, findings + new_findings
