"""Where markers on a face would tell most: `usdface markers`."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from usdface.binding.marker_places import marker_places
from usdface.blas_threads import one_blas_thread
from usdface.io.atomic import write_text
from usdface.io.bind_file import bind_json, read_bind, setup_of_json
from usdface.io.inputs import check_outputs, files_read
from usdface.io.usd.rig import read_rig
from usdface.options import MarkerOptions
from usdface.result import OnStep, Result, Steps
from usdface.retarget_setup import Binding, fit_setup

__all__ = ["make_markers"]


@one_blas_thread()
def make_markers(
    rig: Path,
    bind: Path | None = None,
    output: Path | None = None,
    options: MarkerOptions = MarkerOptions(),
    on_step: OnStep | None = None,
) -> tuple[Result, Binding]:
    """Find where the next markers on a face, or the first, would tell most of its blend shapes.

    `bind` has the markers that are there; the binding with the new ones goes to `output`, if that
    is given, and is returned.

    Raises
    ------
    UsdFaceError
        One clear line; nothing is written.
    """
    steps = Steps(on_step)
    check_outputs([output], files_read(rig, bind))
    with steps("read"):
        character, findings = read_rig(rig)
        setup = read_bind(bind)[0] if bind else setup_of_json({"markers": {}}, str(rig))
        mesh = character.mesh(setup.binding.mesh)
        setup = fit_setup(setup, mesh)[0]
    with steps("place"):
        found = marker_places(mesh, setup.binding, options.count, options.noise)
    binding = found.binding(setup.binding)
    if output:
        write_text(output, bind_json(replace(setup, binding=binding)))
    rows = zip(binding.markers[-len(found.where) :], found.where, found.unseen, strict=True)
    summary: dict[str, Any] = {
        "markers there": len(setup.binding.markers),
        "blend shapes hardly seen": len(found.unseen_before),
    }
    summary |= {name: f"{where}; then {len(rest)} hardly seen" for name, where, rest in rows}
    details = {
        "vertices": found.vertices.tolist(),
        "hardly seen": {"before": found.unseen_before, "after": found.unseen[-1]},
    }
    written = (output,) if output else ()
    return Result(written, tuple(findings), summary, steps.seconds, details), binding
