"""The main job, retarget and correct: `usdface process`, and on a host's open stage."""

from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from usdface.arguments import checked
from usdface.blas_threads import one_blas_thread
from usdface.face.head_size import report_size
from usdface.face.stray_vertices import report_stray
from usdface.findings import Finding
from usdface.io.asset_folder import asset_folder
from usdface.io.atomic import StrPath, all_or_none
from usdface.io.generation import generation_of, outdated_gltf
from usdface.io.plugins import hook_report, installed_hooks
from usdface.io.usd.animation import closure_animation, express_animation, solve_animation
from usdface.io.usd.animation_write import animation_path, apply_animation
from usdface.io.usd.detached_meshes import report_detached
from usdface.io.usd.layers import open_shot
from usdface.io.usd.own_motion import report_hidden_weights, report_replaced
from usdface.io.usd.shot import StagedShot, read_shot
from usdface.io.usd.stage import Stage
from usdface.io.usd.stronger_opinions import edits_hidden
from usdface.io.usd.undriven_meshes import report_undriven
from usdface.options import DeliverOptions, ProcessOptions
from usdface.pipeline.earlier_result import correct_earlier
from usdface.pipeline.process_outputs import process_outputs, weight_deviations
from usdface.pipeline.schemas import register_schemas
from usdface.progress import OnProgress, Progress
from usdface.result import Result
from usdface.shot.report import report_of
from usdface.shot.retarget import retarget_run
from usdface.shot.run import RetargetRun
from usdface.shot.shot import ShotResult
from usdface.verdict.judge import refuse_unusable

if TYPE_CHECKING:
    from usdface.pipeline.long_take import PiecedStages
    from usdface.show.stage_cache import StageCache

__all__ = ["apply", "process"]


@checked
@one_blas_thread()
def process(
    shot: StrPath,
    *,
    output: StrPath | None = None,
    gltf: StrPath | None = None,
    figure: StrPath | None = None,
    sheet: StrPath | None = None,
    deliver: StrPath | None = None,
    delivery: DeliverOptions = DeliverOptions(),
    in_place: bool = False,
    overwrite: bool = False,
    asset_root: StrPath | None = None,
    strict: bool = False,
    cache: StrPath | None = None,
    pieces: StrPath | None = None,
    skip_hooks: Sequence[str] = (),
    solved: ShotResult | None = None,
    options: ProcessOptions = ProcessOptions(),
    on_progress: OnProgress | None = None,
) -> Result[ShotResult]:
    """Retarget a shot, correct it and write the layers: the main job.

    Parameters
    ----------
    shot : path
        A USD file with a setup, as `make_shot` writes it. It is not changed, unless `in_place`.
    output : path, optional
        The root layer of the result; ``SHOT.usdface.usda`` beside the shot if left out.
    gltf : path, optional
        Also write the character and its final weights, .glb or .gltf.
    figure : path, optional
        Also draw the take: .png, .svg or .pdf.
    sheet : path, optional
        Also draw the face, solved above corrected, in the frames most worth a look: likewise.
    deliver : path, optional
        Also write a deliverable: the SkelAnimation alone, flattened, a sample on each frame.
    delivery : DeliverOptions
        Its range and rate.
    in_place : bool
        Add the layers to the shot's own subLayers, in place of a root layer of the result.
    overwrite : bool
        Replace the layers and the deliverable also where they were edited since usdface wrote them,
        or are of another origin, and the glTF also where another program wrote it.
    asset_root : path, optional
        A folder that textures may come from beside those of the layers that name them.
    strict : bool
        Refuse a result whose verdict is "not usable", or unknown: write nothing.
    cache : path, optional
        A folder that caches the arrays of clean-up, solve and correction, keyed by all that they
        depend on. The result is the same without it. Nothing is cached where hooks run.
    pieces : path, optional
        A folder for the pieces of a long take: each is solved on its own, with the estimates of a
        sample of the take, unless `solve_pieces` has done so. Not where hooks run.
    skip_hooks : sequence of str, optional
        Hooks of other packages that do not run: distributions, or "distribution:entry point".
    solved : ShotResult, optional
        Of an earlier run of the same shot, which is not solved again: the result is the same.
    options : ProcessOptions
    on_progress : callable, optional
        Called with each `Step`; an exception from it ends the job before anything is written.

    Returns
    -------
    Result of ShotResult
        `written` begins with the file to open; docs/reports.md has the keys of `summary` and
        `details`.

    Raises
    ------
    UsdFaceError
        One clear line; nothing is half-written.
    SolveError
        If the result is refused.

    Examples
    --------
    >>> result = usdface.process("examples/shot.usda", gltf="face.glb")
    >>> result.written[0].name
    'shot.usdface.usda'
    >>> result.summary["residual_mean_mm"] < 1.0
    True
    >>> result.verdict.level
    'good'
    """
    path = Path(shot)
    outputs = process_outputs(
        output=output, gltf=gltf, figure=figure, sheet=sheet, deliver=deliver, in_place=in_place
    )
    folder = asset_folder(asset_root)
    register_schemas()
    progress = Progress.of(on_progress)
    with progress.step("read"):
        hooks, skipped = installed_hooks(skip_hooks)
        stage = open_shot(path, outputs.root)
        read = outputs.check(path, overwrite)
        staged, findings = read_shot(stage, str(path), folder)
        outputs.check_shown(staged)
        outputs.check_delivery(staged, delivery)
    run = RetargetRun(options=options, hooks=hooks, progress=progress)
    kept = _stage_cache(cache, path)
    if pieces:
        run = replace(run, stages=_pieced_stages(Path(pieces), path, run, asset_root, kept))
    elif kept is not None:
        run = replace(run, stages=kept)
    retargeted, reported = _retarget(staged, skipped + findings, run, earlier=solved)
    if strict:
        refuse_unusable(reported.verdict)
    generation = generation_of(retargeted, outputs.root_of(path))
    joints = retargeted.head_motion is not None or bool(retargeted.eye_motions)
    hidden = edits_hidden(stage, animation_path(staged.prims), joints)  # before layers are moved
    with all_or_none():
        with progress.step("gltf") if gltf else nullcontext():
            lost = outputs.write_gltf(staged, retargeted, hooks, read, generation)
        with progress.step("draw") if figure or sheet else nullcontext():
            outputs.draw(retargeted, reported)
        with progress.step("write"):
            written = outputs.write_layers(path, staged, reported, generation)
    with progress.step("deliver") if deliver else nullcontext():
        lost += outputs.write_deliverable(written[0], staged, delivery)
    written += outputs.others(read)
    lost += hidden
    lost += outdated_gltf(written[0].parent, generation, written)
    found = (*reported.findings, *lost)
    return replace(reported, written=tuple(written), findings=found, seconds=progress.seconds)


@checked
@one_blas_thread()
def apply(
    stage: Stage,
    *,
    skip_hooks: Sequence[str] = (),
    solved: ShotResult | None = None,
    options: ProcessOptions = ProcessOptions(),
    on_progress: OnProgress | None = None,
) -> Result[ShotResult]:
    """Do the main job on a stage that a host holds open, and author on its edit target.

    The final weights, emotion curves and residual go onto the edit target, inside its variant if
    it has one, all of them or nothing; those of an earlier run are replaced. Nothing is saved.

    Parameters
    ----------
    stage : Usd.Stage
        With a setup, as `make_shot` or `set_up` authors it.
    skip_hooks : sequence of str, optional
        Hooks of other packages that do not run: distributions, or "distribution:entry point".
    solved : ShotResult, optional
        Of an earlier run of the same shot, which is not solved again: the result is the same.
    options : ProcessOptions
    on_progress : callable, optional
        Called with each `Step`; an exception from it ends the job before anything is authored.

    Returns
    -------
    Result of ShotResult
        As that of `process`, without files.

    Raises
    ------
    UsdFaceError
        One clear line; nothing is authored.

    Examples
    --------
    >>> stage = Usd.Stage.Open("examples/shot.usda")
    >>> stage.SetEditTarget(stage.GetSessionLayer())
    >>> usdface.apply(stage).summary["frames"]
    720
    """
    progress = Progress.of(on_progress)
    with progress.step("read"):
        hooks, skipped = installed_hooks(skip_hooks)
        staged, findings = read_shot(stage, stage.GetRootLayer().identifier)
    run = RetargetRun(options=options, hooks=hooks, progress=progress)
    retargeted, reported = _retarget(staged, skipped + findings, run, earlier=solved)
    with progress.step("write"):
        content = solve_animation(retargeted, weight_deviations(reported), reported.verdict)
        expressed, closed = express_animation(retargeted), closure_animation(retargeted)
        if expressed is not None:
            content = replace(
                content,
                emotions=expressed.emotions,
                firing=expressed.firing,
                inputs=expressed.inputs,
            )
        if closed is not None:
            content = replace(content, closure=closed.closure)
        content = replace(content, weights=retargeted.weights.weights)
        found = apply_animation(staged, content)
    return replace(reported, findings=(*reported.findings, *found), seconds=progress.seconds)


def _stage_cache(folder: StrPath | None, shot: Path) -> "StageCache | None":
    if folder is None or not str(folder):
        return None
    from usdface.show.stage_cache import StageCache  # only here: most runs have none

    return StageCache(Path(folder), shot.stem)


def _pieced_stages(
    folder: Path,
    shot: Path,
    run: RetargetRun,
    asset_root: StrPath | None,
    others: "StageCache | None",
) -> "PiecedStages":
    from usdface.pipeline.long_take import PiecedStages, check_no_hooks  # only for long takes

    check_no_hooks(run.hooks)
    return PiecedStages(shot, folder, run.options, asset_root, others)


def _retarget(
    staged: StagedShot,
    findings: list[Finding],
    run: RetargetRun,
    earlier: ShotResult | None,
) -> tuple[ShotResult, Result[ShotResult]]:
    """Retarget a shot that was read from a stage; return it, and the result without files."""
    if earlier is None:
        retargeted = retarget_run(staged.shot, run)
    else:
        retargeted = correct_earlier(staged.shot, earlier, run)
    with run.progress.step("report"):
        report = report_of(retargeted)
    summary = dict(report.summary)
    if retargeted.head_motion is not None and staged.prims.head is not None:
        summary["head_carrier"] = staged.prims.head.name
    if run.stages.used is not None:
        summary["stages"] = dict(run.stages.used)
    details = report.details | hook_report(run.hooks)
    rig = staged.shot.rig
    unusual = (*report_size(rig), *report_stray(rig))
    lost = (
        *report_undriven(staged),
        *report_replaced(staged, retargeted),
        *report_hidden_weights(staged),
        *report_detached(staged, retargeted),
    )
    found = (
        *findings,
        *unusual,
        *retargeted.findings,
        *report.findings,
        *lost,
        *run.stages.not_kept,
    )
    return retargeted, Result(retargeted, (), found, summary, details, verdict=report.verdict)
