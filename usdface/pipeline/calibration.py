"""The calibration of a performer: `usdface calibrate`."""

from collections.abc import Sequence
from pathlib import Path

from usdface.arguments import checked
from usdface.blas_threads import one_blas_thread
from usdface.hooks import run_hooks
from usdface.io.atomic import StrPath, write_text
from usdface.io.calibration_file import calibration_json
from usdface.io.inputs import check_outputs, files_read
from usdface.io.overwrite_protection import check_replaced
from usdface.io.plugins import hook_report, installed_hooks
from usdface.io.usd.layers import open_shot
from usdface.io.usd.shot import read_shot
from usdface.pipeline.schemas import register_schemas
from usdface.progress import OnProgress, Progress
from usdface.result import Result
from usdface.retarget_take.calibrate import calibrate as calibrate_face
from usdface.setup.calibration import Calibration

__all__ = ["calibrate"]


@checked
@one_blas_thread()
def calibrate(
    shot: StrPath,
    output: StrPath,
    *,
    extremes: bool = False,
    overwrite: bool = False,
    skip_hooks: Sequence[str] = (),
    on_progress: OnProgress | None = None,
) -> Result[Calibration]:
    """Measure a performer's gains, the size of their movements relative to the character's.

    Parameters
    ----------
    shot : path
        A shot of an expressive take.
    output : path
        The calibration, .json, for `make_shot`.
    extremes : bool
        The take is a range of motion: each movement goes to its extreme.
    overwrite : bool
        Replace `output` also where it was edited since usdface wrote it, or is of another origin.
    skip_hooks : sequence of str, optional
        Hooks of other packages that do not run: distributions, or "distribution:entry point".
    on_progress : callable, optional

    Returns
    -------
    Result of Calibration
        Keys of the summary: ``frames``, ``blend_shapes``, ``gains_known`` (how many), ``gains``
        (of the known ones those that differ most from 1, by blend shape).

    Raises
    ------
    UsdFaceError
        One clear line; nothing is written.

    Examples
    --------
    >>> result = usdface.calibrate("examples/shot.usda", "performer.json")
    >>> result.summary["blend_shapes"] == len(result.value.shapes)
    True
    """
    path, output = Path(shot), Path(output)
    register_schemas()
    progress = Progress.of(on_progress)
    with progress.step("read"):
        hooks, findings = installed_hooks(skip_hooks)
        stage = open_shot(path)
        check_outputs([output], files_read(path))
        check_replaced([(output, "calibration")], overwrite)
        staged, new_findings = read_shot(stage, str(path))
        shot_read = staged.shot
        findings += new_findings
        take, new_findings = run_hooks(hooks, "take_read", shot_read.take, shot_read)
        findings += new_findings
    with progress.step("calibrate"):
        calibrated, new_findings = calibrate_face(
            take,
            shot_read.face,
            shot_read.setup,
            extremes=extremes,
            progress=progress,
        )
    with progress.step("write"):
        text = calibration_json(calibrated.calibration, calibrated.deviations, calibrated.peaks)
        write_text(output, text)
    summary = {
        "frames": len(shot_read.take.times),
        "blend_shapes": len(calibrated.calibration.shapes),
        "gains_known": len(calibrated.known),
        **calibrated.summary(),
    }
    return Result(
        calibrated.calibration,
        (output,),
        tuple(findings + new_findings),
        summary,
        hook_report(hooks),
        seconds=progress.seconds,
    )
