"""Conversion of a rig to UsdSkel: `usdface rig`."""

from pathlib import Path

from usdface.arguments import checked
from usdface.blas_threads import one_blas_thread
from usdface.face.head_size import report_size
from usdface.face.stray_vertices import report_stray
from usdface.io.atomic import StrPath
from usdface.io.inputs import check_outputs, files_read, files_written
from usdface.io.overwrite_protection import check_replaced
from usdface.io.rigs.files import read_rig_file
from usdface.io.usd.rig_write import write_rig
from usdface.io.usd.save_layers import check_usd_name
from usdface.options import RigOptions
from usdface.progress import OnProgress, Progress
from usdface.result import Result
from usdface.rigs import Rig

__all__ = ["make_rig"]


@checked
@one_blas_thread()
def make_rig(
    source: StrPath,
    output: StrPath,
    *,
    overwrite: bool = False,
    options: RigOptions = RigOptions(),
    on_progress: OnProgress | None = None,
) -> Result[Rig]:
    """Convert a rig of any format that `list_formats` names to UsdSkel.

    Parameters
    ----------
    source : path
    output : path
        .usda or .usdc.
    overwrite : bool
        Replace `output` also where it is no rig that usdface wrote.
    options : RigOptions
        Unit, up axis and neutral mesh, where the source does not name them.
    on_progress : callable, optional

    Returns
    -------
    Result of Rig
        Keys of the summary: ``meshes``, ``vertices``, ``blend_shapes``, ``joints``.

    Raises
    ------
    InputError
        If the source is no rig, or has no blend shapes.
    OutputError
        If the file cannot be written.

    Examples
    --------
    >>> usdface.make_rig("examples/head.usdc", "rig.usdc").summary["meshes"]
    9
    """
    source, output = Path(source), Path(output)
    progress = Progress.of(on_progress)
    check_usd_name(output)
    read = files_read(source)
    check_outputs([output], read)
    check_replaced([(output, "rig")], overwrite)
    with progress.step("read"):
        rig, findings = read_rig_file(source, options)
        findings += report_size(rig) + report_stray(rig)
    with progress.step("write"):
        findings += write_rig(rig, output, read=read)
        written = files_written(output, read)
    summary = {
        "meshes": len(rig.meshes),
        "vertices": sum(len(mesh.points) for mesh in rig.meshes),
        "blend_shapes": len(rig.shape_names),
        "joints": len(rig.skeleton.joints) if rig.skeleton else 0,
    }
    return Result(rig, written, tuple(findings), summary, seconds=progress.seconds)
