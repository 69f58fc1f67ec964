"""A character becomes UsdSkel: `usdface rig`."""

from pathlib import Path

from usdface.blas_threads import one_blas_thread
from usdface.io.inputs import check_outputs, files_read, files_written
from usdface.io.rigs.files import read_rig_file
from usdface.io.usd.rig_write import write_rig
from usdface.options import RigOptions
from usdface.result import OnStep, Result, Steps

__all__ = ["make_rig"]


@one_blas_thread()
def make_rig(
    source: Path, output: Path, options: RigOptions = RigOptions(), on_step: OnStep | None = None
) -> Result:
    """Convert a rig to UsdSkel: glTF, a folder of meshes, MakeHuman targets, or UsdSkel."""
    steps = Steps(on_step)
    read = files_read(source)
    check_outputs([output], read)
    with steps("read"):
        rig, findings = read_rig_file(source, options)
    with steps("write"):
        findings += write_rig(rig, output, read=read)
        written = files_written(output, read)
    summary = {
        "meshes": len(rig.meshes),
        "vertices": sum(len(mesh.points) for mesh in rig.meshes),
        "blend shapes": len(rig.shape_names),
        "joints": len(rig.skeleton.joints) if rig.skeleton else 0,
    }
    return Result(written, tuple(findings), summary, steps.seconds)
