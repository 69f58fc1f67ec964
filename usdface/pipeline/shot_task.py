"""One shot of a sequence, in a worker: made if it must be, processed, recorded."""

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np

from usdface.errors import InputError, OutputError
from usdface.findings import Finding, finding
from usdface.io.atomic import check_place
from usdface.io.inputs import files_read
from usdface.io.layer_paths import layer_paths
from usdface.io.overwrite_protection import check_replaced
from usdface.io.usd.named_files import named_files
from usdface.options import BindOptions, DeliverOptions, ProcessOptions
from usdface.pipeline.processing import process
from usdface.pipeline.schemas import register_schemas
from usdface.pipeline.shot import make_shot
from usdface.result import Result, peak_memory
from usdface.shot.shot import ShotResult
from usdface.show.making_record import (
    is_made,
    making_findings,
    note_kept,
    note_making,
    read_making,
)
from usdface.show.plan import Making, ShotPlan, plan_of
from usdface.show.record import Record, read_record, record_of, record_path, write_record
from usdface.show.table import Row

__all__ = ["FileRole", "file_role", "run_shot"]

FileRole = Literal["shot", "over result", "other"]


def file_role(path: Path) -> FileRole:
    """Return whether a USD file has the setup of a shot; "shot" also where it cannot be opened.

    A layer over a result, as an animator's, is none: another result would hide its edits. A
    shot may have layers of a result in itself (`process --in-place`), its own, or those of the
    version that it was copied from.

    Returns
    -------
    {"shot", "over result", "other"}
        "over result" for a layer over a shot that has its result in itself: unlike one over the
        root layer of a result, it does not name the result. "other" for results, too.
    """
    from usdface.io.usd.generation import stage_generations
    from usdface.io.usd.played_shot import defines_setup, has_setup
    from usdface.io.usd.stage import open_stage

    register_schemas()
    try:
        stage = open_stage(path)
        own = {layer.resolve() for layer in layer_paths(path).layers}
        results = {layer.resolve() for layer in stage_generations(stage)}
        if not has_setup(stage):
            return "other"
        if results <= own or defines_setup(stage):
            return "shot"
        # The root layer of a result, whatever its name, is beside the folder of the others.
        has_root = any(not layer.parent.name.endswith(".usdface") for layer in results)
        return "other" if has_root else "over result"
    except InputError:
        return "shot"  # the table says why it is not processed


def run_shot(task: Mapping[str, Any]) -> dict[str, Any]:
    """Make and process a shot; return its row of the table, and record the result.

    Parameters
    ----------
    task : mapping
        ``plan``, from `ShotPlan.as_dict`, ``cache``, a folder or "", and ``overwrite``, of
        `process_sequence`.

    Raises
    ------
    UsdFaceError
        If it cannot be made or processed.
    """
    register_schemas()
    plan = plan_of(task["plan"])
    check_place(plan.file)
    plan.file.parent.mkdir(parents=True, exist_ok=True)
    findings, made = _made(plan, plan.making) if plan.making else ([], ())
    if plan.making and plan.making.performer and plan.making.calibration is None:
        findings.append(finding("PERFORMER_UNCALIBRATED", plan.making.performer))
    folder, options = plan.file.parent, plan.options
    before = _record(plan, options)
    result = process(
        plan.file,
        gltf=plan.gltf_path if plan.gltf else None,
        deliver=plan.deliver_path if plan.deliver is not None else None,
        delivery=DeliverOptions(**(plan.deliver or {})),
        overwrite=bool(task.get("overwrite")) or _are_recorded(plan),
        cache=task.get("cache") or None,
        skip_hooks=plan.skip_hooks,
        options=ProcessOptions(**plan.process),
    )
    written = [*result.written]
    if plan.page:
        from usdface.pipeline.viewing import view

        written += view(plan.paths.root, plan.page_path).written
    row = _row(plan, result, findings, [*made, *written])
    if before.key_now(folder, options) == before.key:  # else the next run does it again
        done = record_of(
            folder,
            read=[folder / name for name in before.files],
            absent=[folder / name for name in before.absent],
            options=options,
            written=written,
            row=row.as_dict(),
        )
        write_record(record_path(plan.file), done)
    return row.as_dict()


def _are_recorded(plan: ShotPlan) -> bool:
    """Return whether the results that exist are as the last run of a sequence wrote them.

    Then nobody edited them, whatever their form: older versions wrote no fingerprint.
    """
    known = read_record(record_path(plan.file))
    wanted = (
        (plan.paths.root, True),
        *((layer, True) for layer in plan.paths.layers),
        (plan.gltf_path, plan.gltf),
        (plan.deliver_path, plan.deliver is not None),
    )
    there = [path for path, wants in wanted if wants and path.is_file()]
    return known is not None and all(known.wrote(path, plan.file.parent) for path in there)


def _record(plan: ShotPlan, options: object) -> Record:
    """Return the record of the files that a shot reads."""
    read = files_read(plan.file, apart=plan.paths.layers)
    named, missing = named_files(plan.file)
    others = dict.fromkeys((*read, *named))
    return record_of(plan.file.parent, read=others, absent=missing, options=options)


def _made(plan: ShotPlan, making: Making) -> tuple[list[Finding], Sequence[Path]]:
    """Make the shot if it is missing or out of date; an edited one is kept.

    Returns findings and the files that were written. The findings are those of the run that made
    it: they concern the shot as long as it is that one.
    """
    folder, known = plan.file.parent, read_making(plan.file)
    there = all(path.is_file() for path in (plan.file, *making.layers))
    if there and is_made(known, making, folder):
        return making_findings(known, plan.name), ()
    read = files_read(*making.files)
    missing = [path for file in (making.rig, making.take) for path in named_files(file)[1]]
    before = record_of(folder, read=read, absent=missing, options=making.options)
    try:
        check_replaced([(plan.file, "shot")])
    except OutputError:
        edited = [*read, plan.file]
        kept = record_of(folder, read=edited, absent=missing, options=making.options)
        note_kept(plan, making, kept)
        message = "its rig, take or binding changed, but it was edited since: it is kept as it is"
        return [*making_findings(known, plan.name), finding("SHOT_KEPT", plan.name, message)], ()
    result = make_shot(
        making.rig,
        making.take,
        plan.file,
        bind=making.bind,
        binding=BindOptions(neutral=making.neutral),
        calibration=making.calibration,
        expressions=making.expressions,
        fuzzy=making.fuzzy,
        correction=making.correction,
        performer_layer=making.performer_layer,
        character_layer=making.character_layer,
    )
    if before.key_now(folder, making.options) == before.key:
        note_making(plan, making, before, result.findings)
    return list(result.findings), result.written


def _row(
    plan: ShotPlan, result: Result[ShotResult], made: list[Finding], written: Sequence[Path]
) -> Row:
    summary, verdict = result.summary, result.verdict
    findings = (*made, *result.findings)
    alarming = [found for found in findings if found.severity != "info"]
    return Row(
        name=plan.name,
        verdict=verdict.level if verdict else "",
        reasons=tuple(reason.criterion.code for reason in verdict.reasons) if verdict else (),
        frames=int(summary["frames"]),
        residual_mean_mm=summary.get("residual_mean_mm"),
        residual_max_mm=summary.get("residual_max_mm"),
        occluded_share=_occluded_share(result.value),
        correction_max=summary.get("correction_max"),
        findings=dict(Counter(found.code for found in alarming)),
        notes=len(findings) - len(alarming),
        stages=summary.get("stages", {}),
        seconds=round(sum(result.seconds.values()), 3),
        peak_memory_mb=round(peak_memory() / 1e6, 1),
        root=str(plan.paths.root),
        page=str(plan.page_path) if plan.page else "",
        written=tuple(str(path) for path in written),
    )


def _occluded_share(result: ShotResult) -> float | None:
    if result.solution is None or not result.solution.distances.size:
        return None
    return round(float(np.isnan(result.solution.distances).mean()), 4)
