"""Scenes from USD to glTF or USDZ and from glTF to USD: `usdface export` and `import`.

Each function imports its own readers and writers: USDZ needs no glTF, and reading glTF other
libraries than writing it.
"""

from pathlib import Path
from typing import Any

from usdface.certificate.certificate import Certificate
from usdface.clips import Clip, chosen_clips
from usdface.findings import Finding
from usdface.io.asset_folder import asset_root
from usdface.io.atomic import check_place
from usdface.options import ExportOptions, ImportOptions
from usdface.pipeline.schemas import register_schemas
from usdface.result import OnStep, Result, Steps
from usdface.rigs import Rig

__all__ = ["export_scene", "import_scene"]


def export_scene(
    source: Path,
    output: Path,
    on_step: OnStep | None = None,
    every_frame: bool = False,
    options: ExportOptions = ExportOptions(),
) -> Result:
    """Write the face of a USD scene, with all of its clips, as glTF or USDZ.

    A certificate says by how much the glTF is off; its vertices are compared in as many frames
    as take a fraction of a second, or in every frame.
    """
    steps = Steps(on_step)
    check_place(output, source)
    if output.suffix.lower() == ".usdz":
        from usdface.io.usd.usdz import write_usdz

        with steps("write"):
            findings = write_usdz(source, output, options)
        return Result((output,), tuple(findings), {}, steps.seconds)
    from usdface.io.compare_conversion import certified
    from usdface.io.gltf.write import write_gltf
    from usdface.io.usd.clips import animated_rig
    from usdface.io.usd.stage import open_stage

    register_schemas()
    with steps("read"):
        stage = open_stage(source)
        rig, clips, findings = animated_rig(stage, asset_root(options.asset_root))
        clips = chosen_clips(clips, options.clip)
    summary = _summary(rig, clips, "morph targets")
    with steps("write"):
        findings += write_gltf(rig, output, clips, options.pointer, options.quantize)
    del rig, clips  # their memory, for the certificate
    with steps("certify"):
        certificate, more = certified(
            stage, output, exported=True, every_frame=every_frame, clip=options.clip
        )
    return _certified((output,), findings + more, summary, steps, certificate)


def import_scene(
    source: Path,
    output: Path,
    on_step: OnStep | None = None,
    every_frame: bool = False,
    options: ImportOptions = ImportOptions(),
) -> Result:
    """Write a glTF as USD: meshes, blend shapes, skin, materials and all of its animations.

    A certificate says by how much the USD is off (see `export_scene`).
    """
    from usdface.io.compare_conversion import certified
    from usdface.io.gltf.read import read_gltf
    from usdface.io.usd.rig_write import write_rig
    from usdface.io.usd.stage import open_stage

    steps = Steps(on_step)
    check_place(output, source)
    root = asset_root(options.asset_root)
    with steps("read"):
        rig, clips, findings = read_gltf(source, root)
    summary = _summary(rig, clips, "blend shapes")
    with steps("write"):
        findings += write_rig(rig, output, clips)
    del rig, clips  # their memory, for the certificate
    with steps("certify"):
        stage = open_stage(output)
        certificate, more = certified(
            stage, source, exported=False, every_frame=every_frame, asset_root=root
        )
    return _certified((output,), findings + more, summary, steps, certificate)


def _summary(rig: Rig, clips: tuple[Clip, ...], shapes: str) -> dict[str, Any]:
    return {
        "meshes": len(rig.meshes),
        shapes: len(rig.shape_names),
        "clips": len(clips),
        "frames": sum(len(clip.times) for clip in clips),
    }


def _certified(
    written: tuple[Path, ...],
    findings: list[Finding],
    summary: dict[str, Any],
    steps: Steps,
    certificate: Certificate | None,
) -> Result:
    details = {}
    if certificate is not None:
        summary["off by"] = certificate.line()
        details["certificate"] = certificate.as_dict()
    return Result(written, tuple(findings), summary, steps.seconds, details)
