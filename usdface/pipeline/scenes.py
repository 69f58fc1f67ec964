"""Scenes from USD to glTF or USDZ and from glTF to USD: `usdface export` and `import`.

Each function imports its own readers and writers: USDZ needs no glTF library, and reading glTF
needs others than writing it.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from usdface.arguments import checked
from usdface.blas_threads import one_blas_thread
from usdface.certificate.certificate import Certificate
from usdface.clips import Clip, chosen_clips
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.formats import ExportTarget
from usdface.hooks import Hook, run_hooks
from usdface.io.asset_folder import asset_folder
from usdface.io.atomic import StrPath
from usdface.io.export_targets import EXPORT_TARGETS, GLTF, pack_stage, write_scene
from usdface.io.format_table import Registered
from usdface.io.inputs import check_outputs, files_read, files_written
from usdface.io.overwrite_protection import check_replaced
from usdface.io.plugins import hook_report, installed_hooks
from usdface.options import ExportOptions, ImportOptions
from usdface.pipeline.schemas import register_schemas
from usdface.progress import OnProgress, Progress
from usdface.result import Result
from usdface.rigs import Rig

__all__ = ["export_scene", "import_scene"]

_USD = (".usd", ".usda", ".usdc", ".usdz")


@checked
@one_blas_thread()
def export_scene(
    source: StrPath,
    output: StrPath,
    *,
    every_frame: bool = False,
    overwrite: bool = False,
    skip_hooks: Sequence[str] = (),
    options: ExportOptions = ExportOptions(),
    on_progress: OnProgress | None = None,
) -> Result[Certificate | None]:
    """Write the face of a USD scene, with all of its clips, as glTF, USDZ or another format.

    Parameters
    ----------
    source : path
        A USD file.
    output : path
        .glb, .gltf, .usdz, or a suffix that `list_formats` names.
    every_frame : bool
        Compare the vertices in every frame, not in as many as take a fraction of a second.
    overwrite : bool
        Replace a glTF also where usdface did not write it.
    skip_hooks : sequence of str, optional
        Hooks of other packages that do not run: distributions, or "distribution:entry point".
    options : ExportOptions
    on_progress : callable, optional

    Returns
    -------
    Result of Certificate or None
        By how much the glTF is off; None of other formats. Keys of the summary: ``meshes``,
        ``morph_targets`` (else ``blend_shapes``), ``clips``, ``frames``; of the certificate
        ``frames_compared``, ``vertex_error_max_mm``, ``normal_error_max_degrees``,
        ``weight_error_max``, ``time_drift_s``.

    Raises
    ------
    UsdFaceError
        One clear line; nothing is half-written.

    Examples
    --------
    >>> usdface.export_scene("examples/head.usdc", "head.glb").summary["meshes"]
    9
    """
    source, output = Path(source), Path(output)
    progress = Progress.of(on_progress)
    read = files_read(source)
    check_outputs([output], read)
    hooks, skipped = installed_hooks(skip_hooks)
    target, problems = _target(output)
    check_replaced([(output, "glTF")] if target.format is GLTF else [], overwrite)
    problems += skipped
    target.format.check_options(output, options)
    if target.format.pack:
        with progress.step("write"):
            problems += pack_stage(target, source, output, options) + _unused(hooks)
        return Result(None, (output,), tuple(problems), seconds=progress.seconds)
    from usdface.io.usd.clips import animated_rig
    from usdface.io.usd.generation import generation_of_stage
    from usdface.io.usd.stage import open_stage
    from usdface.io.usd.unprocessed import report_unprocessed

    register_schemas()
    with progress.step("read"):
        stage = open_stage(source)
        rig, clips, findings = animated_rig(
            stage, asset_folder(options.asset_root), options.purpose
        )
        findings = report_unprocessed(stage, source) + findings
        clips = chosen_clips(clips, options.clip)
        (rig, clips), new_findings = run_hooks(hooks, "before_export", (rig, clips))
        problems += new_findings
    details = hook_report(hooks)
    summary = _summary(rig, clips, "morph_targets" if target.format is GLTF else "blend_shapes")
    with progress.step("write"):
        made = generation_of_stage(stage, source)
        findings += problems + write_scene(target, rig, clips, output, options, read, made)
        written = files_written(output, read) if target.format is GLTF else (output,)
    if target.format is not GLTF:
        return Result(None, written, tuple(findings), summary, details, progress.seconds)
    del rig, clips  # their memory, for the certificate
    from usdface.io.compare_conversion import certify_conversion

    with progress.step("certify"):
        certificate, new_findings = certify_conversion(
            stage, output, exported=True, every_frame=every_frame, options=options
        )
    found = findings + new_findings
    return _certified(written, found, summary, progress, certificate, details)


@checked
@one_blas_thread()
def import_scene(
    source: StrPath,
    output: StrPath,
    *,
    rig: StrPath | None = None,
    every_frame: bool = False,
    overwrite: bool = False,
    options: ImportOptions = ImportOptions(),
    on_progress: OnProgress | None = None,
) -> Result[Certificate | None]:
    """Write a glTF as USD: meshes, blend shapes, skin, materials and all of its animations.

    Parameters
    ----------
    source : path
        .glb or .gltf.
    output : path
        .usda or .usdc.
    rig : path, optional
        USD or glTF: the result is this rig with the animations of `source`, whose meshes, if it
        has any, do not count. Joints and blend shapes are matched by name.
    every_frame : bool
        As of `export_scene`.
    overwrite : bool
        Replace `output` also where it is no rig that usdface wrote.
    options : ImportOptions
    on_progress : callable, optional

    Returns
    -------
    Result of Certificate or None
        By how much the USD is off; None where nothing can be compared. Keys of the summary:
        ``meshes``, ``blend_shapes``, ``clips``, ``frames``, with clips ``rate_hz``, and those of
        the certificate, as of `export_scene`.

    Raises
    ------
    UsdFaceError
        One clear line; nothing is half-written.

    Examples
    --------
    >>> _ = usdface.export_scene("examples/head.usdc", "head.glb")
    >>> usdface.import_scene("head.glb", "head.usdc").summary["clips"]
    0
    """
    from usdface.io.compare_conversion import certify_conversion
    from usdface.io.gltf.read import read_gltf
    from usdface.io.usd.clips_write import clock_of
    from usdface.io.usd.rig_write import write_rig
    from usdface.io.usd.save_layers import check_usd_name
    from usdface.io.usd.stage import open_stage

    source, output = Path(source), Path(output)
    progress = Progress.of(on_progress)
    folder = asset_folder(options.asset_root)
    of = Path(rig) if rig is not None else None
    if source.is_file() and source.suffix.lower() in _USD:
        raise InputError(
            f"{source} is USD; `usdface import` reads glTF (.glb .gltf .vrm), `usdface export` "
            "writes it",
            "FILE_KIND_UNKNOWN",
        )
    check_usd_name(output)
    read = files_read(source, of)
    check_outputs([output], read)
    check_replaced([(output, "rig")], overwrite)
    with progress.step("read"):
        if of is None:
            character, clips, findings = read_gltf(source, folder)
        else:
            character, clips, findings = _rig_with_clips(source, of, folder)
    summary = _summary(character, clips, "blend_shapes")
    if summary["clips"]:
        summary["rate_hz"] = round(clock_of(clips), 3)
    with progress.step("write"):
        findings += write_rig(character, output, clips, read)
        written = files_written(output, read)
    if of is not None:
        message = "clips for a rig are not compared with their source"
        findings.append(finding("CONVERSION_UNCERTIFIED", source.name, message))
        return Result(None, written, tuple(findings), summary, {}, progress.seconds)
    del character, clips  # their memory, for the certificate
    with progress.step("certify"):
        stage = open_stage(output)
        certificate, new_findings = certify_conversion(
            stage, source, exported=False, every_frame=every_frame, asset_root=folder
        )
    return _certified(written, findings + new_findings, summary, progress, certificate)


def _rig_with_clips(
    source: Path, rig: Path, folder: Path | None
) -> tuple[Rig, tuple[Clip, ...], list[Finding]]:
    from usdface.io.clips_for_rig import rig_with_clips
    from usdface.io.gltf.external_files import may_be_gltf
    from usdface.io.gltf.read import read_gltf
    from usdface.io.usd.clips import animated_rig
    from usdface.io.usd.stage import open_stage

    register_schemas()
    if may_be_gltf(rig):
        character, own, findings = read_gltf(rig, folder)
    else:
        character, own, findings = animated_rig(open_stage(rig), folder)
    character, clips, new_findings = rig_with_clips(source, character, own, folder)
    return character, clips, findings + new_findings


def _target(output: Path) -> tuple[Registered[ExportTarget], list[Finding]]:
    try:
        return EXPORT_TARGETS.find(output)
    except InputError as error:
        if output.suffix.lower() not in _USD:
            raise
        message = f"{error}; `usdface import` makes USD of a glTF"
        raise InputError(message, error.code) from error


def _unused(hooks: Sequence[Hook]) -> list[Finding]:
    """Report the hooks that are not called for a scene that is packed as it is."""
    message = "the scene is packed as it is, without hooks"
    return [
        finding("HOOK_SKIPPED", hook.name, message)
        for hook in hooks
        if hook.point == "before_export"
    ]


def _summary(rig: Rig, clips: tuple[Clip, ...], shapes: str) -> dict[str, Any]:
    return {
        "meshes": len(rig.meshes),
        shapes: len(rig.shape_names),
        "clips": sum(not clip.still for clip in clips),
        "frames": sum(len(clip.times) for clip in clips if not clip.still),
    }


def _certified(
    written: tuple[Path, ...],
    findings: list[Finding],
    summary: dict[str, Any],
    progress: Progress,
    certificate: Certificate | None,
    details: dict[str, Any] | None = None,
) -> Result[Certificate | None]:
    details = dict(details or {})
    if certificate is not None:
        summary |= certificate.summary
        details["certificate"] = certificate.as_dict()
    return Result(certificate, written, tuple(findings), summary, details, progress.seconds)
