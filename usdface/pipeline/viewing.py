"""Pages that show a shot, or any face with blend shapes: `usdface view`."""

import base64
from pathlib import Path
from typing import Any

from usdface.arguments import checked
from usdface.blas_threads import one_blas_thread
from usdface.clips import Clip
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.asset_folder import asset_folder
from usdface.io.atomic import StrPath, write_text
from usdface.io.gltf.external_files import may_be_gltf
from usdface.io.images.footage_files import read_confidence
from usdface.io.inputs import check_outputs, files_read
from usdface.options import ViewOptions
from usdface.page.character import JOINTS_SHOWN, character_data, page_meshes
from usdface.page.clip_data import clip_data
from usdface.page.document import finding_lines, page_html
from usdface.page.footage_data import face_box, footage_data, images_of_frames, shown_frames
from usdface.pipeline.schemas import register_schemas
from usdface.progress import OnProgress, Progress
from usdface.result import Result
from usdface.rigs import Mesh, Rig
from usdface.show.page import check_page_name
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["view"]


@checked
@one_blas_thread()
def view(
    source: StrPath,
    output: StrPath,
    *,
    options: ViewOptions = ViewOptions(),
    on_progress: OnProgress | None = None,
) -> Result[None]:
    """Write a page that shows a processed shot, or any face with blend shapes.

    The page is one HTML file that makes no request: it can be mailed, archived and opened from a
    folder, by any browser with WebGL 2.

    Parameters
    ----------
    source : path
        The result of `process`; or USD or glTF with blend shapes, with its clips and a slider for
        each blend shape.
    output : path
        The page, .html.
    options : ViewOptions
    on_progress : callable, optional
        Called with each `Step`; an exception from it ends the job before anything is written.

    Returns
    -------
    Result of None
        Keys of the summary: ``meshes``, ``vertices``, ``blend_shapes``, ``frames``, ``size_mb``.

    Raises
    ------
    InputError
        If the source cannot be read, or has no mesh.
    OutputError
        If the page is not named as one, or cannot be written.

    Examples
    --------
    >>> _ = usdface.process("examples/shot.usda")
    >>> result = usdface.view("examples/shot.usdface.usda", "shot.html")
    >>> result.summary["frames"], result.summary["size_mb"] < 3
    (720, True)
    """
    path, page = Path(source), Path(output)
    check_page_name(page)
    progress = Progress.of(on_progress)
    beside = [Path(each) for each in (options.footage, options.tracks) if each]
    check_outputs([page], files_read(path, *beside))
    with progress.step("read"):
        rig, data, findings = _read(path, options)
    with progress.step("page"):
        meshes = page_meshes(rig, options.face_only)
        findings += _left_out(rig, len(meshes))
        images, new_findings = images_of(rig, meshes) if options.textures else ({}, [])
        findings += new_findings
        character = character_data(rig, meshes, images)
        data |= {"character": character, "findings": finding_lines(findings)}
        summary: dict[str, Any] = {
            "meshes": len(meshes),
            "vertices": sum(len(mesh.points) for mesh in meshes),
            "blend_shapes": len(character["shapes"]),
            "frames": max((len(c["ticks"]) for c in data["clips"]), default=0),
        }
        data["facts"] |= summary | {"clips": len(data["clips"])}
        text = page_html("view", path.name, _about(summary), data)
    with progress.step("write"):
        write_text(page, text)
    summary["size_mb"] = round(len(text) / 1e6, 2)
    return Result(None, (page,), tuple(findings), summary, seconds=progress.seconds)


def images_of(rig: Rig, meshes: tuple[Mesh, ...]) -> tuple[dict[str, str], list[Finding]]:
    """Return the images of the base colours of materials, as ``data:`` addresses.

    Returns
    -------
    dict of str to str
        Of each textured material of the meshes whose image can be read.
    list of Finding
    """
    used = {name for mesh in meshes for name in mesh.materials}
    textured = {
        material.name: material.base_color_texture
        for material in rig.materials
        if material.name in used and material.base_color_texture is not None
    }
    if not textured:
        return {}, []
    from usdface.io.page_image import page_image  # loads OpenImageIO

    addresses: dict[str, str] = {}
    found: list[Finding] = []
    read: dict[Any, str] = {}
    for name, texture in textured.items():
        if texture.image not in read:
            image, new_findings = page_image(texture)
            found += new_findings
            read[texture.image] = ""
            if image is not None:
                encoded = base64.b64encode(image[0]).decode("ascii")
                read[texture.image] = f"data:{image[1]};base64,{encoded}"
        if read[texture.image]:
            addresses[name] = read[texture.image]
    return addresses, found


def _about(summary: dict[str, Any]) -> str:
    return (
        f"{summary['frames']} frames, {summary['blend_shapes']} blend shapes, "
        f"{summary['vertices']} vertices"
    )


def _left_out(rig: Rig, shown: int) -> list[Finding]:
    """Report the parts of the rig that the page does not show."""
    found = []
    others = [m.name for m in rig.materials if set(m.textures) - {"base_color_texture"}]
    if others:
        message = (
            "the page shows base colours alone: {material_count} materials have other textures"
        )
        found.append(
            finding("FEATURE_DROPPED", others[0], message, len(others), feature="textures")
        )
    many = [m for m in rig.meshes if m.skin is not None and m.skin.joints.shape[1] > JOINTS_SHOWN]
    if many:
        message = "the page moves a point by the {influence_count} joints that move it most"
        found.append(
            finding("INFLUENCES_MANY", many[0].path or many[0].name, message, JOINTS_SHOWN)
        )
    if shown < len(rig.meshes):
        message = "{mesh_count} meshes that no blend shape moves"
        found.append(
            finding("FEATURE_DROPPED", rig.name, message, len(rig.meshes) - shown, feature="meshes")
        )
    return found


def _read(path: Path, options: ViewOptions) -> tuple[Rig, dict[str, Any], list[Finding]]:
    """Return a rig, the data of its clips or of its shot, and findings."""
    register_schemas()
    if not path.exists():
        raise InputError(f"no such file: {path}", "FILE_UNREADABLE")
    if options.tracks is not None and options.footage is None:
        raise InputError("the report of a take is for its images; give --footage", "SETTING_WRONG")
    if may_be_gltf(path):
        from usdface.io.gltf.read import read_gltf

        _refuse_footage(path, options)
        rig, clips, findings = read_gltf(path, asset_folder(options.asset_root))
        return rig, _clips(rig, clips, options, findings), findings
    from usdface.io.usd.clips import animated_rig
    from usdface.io.usd.played_shot import has_setup, read_played_shot
    from usdface.io.usd.stage import open_stage
    from usdface.io.usd.unprocessed import report_unprocessed

    stage, folder = open_stage(path), asset_folder(options.asset_root)
    if not has_setup(stage):
        _refuse_footage(path, options)
        rig, clips, findings = animated_rig(stage, folder)
        return rig, _clips(rig, clips, options, findings), findings
    from usdface.page.shot_data import shot_data

    played, findings = read_played_shot(stage, str(path), folder)
    findings = report_unprocessed(stage, path) + findings
    shapes = _shapes(played.rig, options)
    data = shot_data(played, shapes, page_meshes(played.rig, options.face_only))
    facts = {"take": played.shot.take.source or "", "rig": played.rig.name}
    facts["rate"] = f"{played.shot.take.rate:g} Hz"
    if options.footage is not None:
        data["footage"] = _footage(played.shot.take, Path(options.footage), options)
    return played.rig, data | {"facts": facts}, findings


def _refuse_footage(path: Path, options: ViewOptions) -> None:
    if options.footage is not None:
        raise InputError(f"{path} has no take; leave out --footage", "SETTING_WRONG")


def _footage(take: MarkerTake | WeightsTake, footage: Path, options: ViewOptions) -> dict[str, Any]:
    """Return the images that a take was made of, with its dots."""
    from usdface.io.images.page_frames import read_page_frames  # loads OpenImageIO

    if not isinstance(take, MarkerTake) or take.dimension != 2:
        raise InputError(
            f"{take.source} is no take of images; leave out --footage", "SETTING_WRONG"
        )
    box = face_box(take)
    shown = shown_frames(take)
    numbers = images_of_frames(take)[shown].tolist()
    found = read_page_frames(footage, numbers, box, take.image_size)
    images = {k: found[n] for k, n in zip(shown, numbers, strict=True) if n in found}
    confidence = {}
    if options.tracks is not None:
        confidence = read_confidence(Path(options.tracks), len(take.times))
    return footage_data(take, images, box, confidence)


def _shapes(rig: Rig, options: ViewOptions) -> tuple[str, ...]:
    meshes = page_meshes(rig, options.face_only)
    return tuple(dict.fromkeys(name for mesh in meshes for name in mesh.shape_names))


def _clips(
    rig: Rig, clips: tuple[Clip, ...], options: ViewOptions, findings: list[Finding]
) -> dict[str, Any]:
    """Return the clips of a rig without a shot; a clip that is too long is cut: `findings`."""
    shapes, shown = _shapes(rig, options), []
    for clip in clips:
        data, cut = clip_data(clip, shapes, rig.skeleton)
        shown.append(data)
        if cut:
            findings.append(finding("ANIMATION_DROPPED", clip.name, "the page shows its beginning"))
    return {"clips": shown, "start_timecode": "", "facts": {"rig": rig.name}}
