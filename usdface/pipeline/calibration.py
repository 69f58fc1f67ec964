"""How large a performer's movements are against the character's: `usdface calibrate`."""

from pathlib import Path

from usdface.blas_threads import one_blas_thread
from usdface.io.atomic import write_text
from usdface.io.calibration_file import calibration_json
from usdface.io.inputs import check_outputs, files_read
from usdface.io.usd.layers import open_shot
from usdface.io.usd.shot import read_shot
from usdface.pipeline.schemas import register_schemas
from usdface.result import OnStep, Result, Steps
from usdface.retarget_take import calibrate as calibrate_face

__all__ = ["calibrate"]


@one_blas_thread()
def calibrate(
    path: Path, output: Path, extremes: bool = False, on_step: OnStep | None = None
) -> Result:
    """Find how large a performer's movements are against the character's, and write it as JSON.

    `path` is a shot of an expressive take; with `extremes` one that goes through the whole range of
    motion, each movement to its extreme.

    Raises
    ------
    UsdFaceError
        One clear line; nothing is written.
    """
    register_schemas()
    steps = Steps(on_step)
    with steps("read"):
        stage = open_shot(path)
        check_outputs([output], files_read(path))
        shot, findings = read_shot(stage, str(path))
    with steps("calibrate"):
        mesh = shot.rig.mesh(shot.setup.binding.mesh)
        found, more = calibrate_face(shot.take, shot.setup, mesh, extremes, steps)
    with steps("write"):
        text = calibration_json(found.calibration, found.deviations, found.peaks)
        write_text(output, text)
    summary = {
        "frames": len(shot.take.times),
        "blend shapes": len(found.calibration.shapes),
        "gains known": len(found.known),
        **found.summary(),
    }
    return Result((output,), tuple(findings + more), summary, steps.seconds)
