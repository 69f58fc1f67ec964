"""The gains and offsets of the performer of a take."""

from usdface.blas_threads import one_blas_thread
from usdface.errors import InputError
from usdface.face.bound_face import BoundFace
from usdface.findings import Finding
from usdface.progress import Progress
from usdface.retarget.bound_points import BoundPoints
from usdface.retarget.calibration import TakeCalibration, calibrate_take
from usdface.retarget_take.clean import clean
from usdface.retarget_take.filmed_face import filmed_face
from usdface.retarget_take.solver_input import solver_input
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["calibrate"]


@one_blas_thread()
def calibrate(
    take: MarkerTake | WeightsTake,
    face: BoundFace,
    setup: RetargetSetup,
    *,
    extremes: bool = False,
    progress: Progress | None = None,
) -> tuple[TakeCalibration, list[Finding]]:
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
    cleaned, findings = clean(take, setup)
    take, setup, surface, new_findings = solver_input(cleaned.take, face, setup, cleaned, progress)
    filmed, camera_findings = filmed_face(take, face, setup, surface, progress)
    skin = filmed.skin if filmed else surface.skin
    calibrated, calibration_findings = calibrate_take(
        filmed.head.still(take) if filmed else take,
        BoundPoints.on_skin(skin, face.shape_names),
        setup,
        extremes=extremes,
        surface=surface,
    )
    return calibrated, findings + new_findings + camera_findings + calibration_findings
