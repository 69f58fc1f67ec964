"""The most informative vertices for markers: `usdface markers`."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from usdface.arguments import checked
from usdface.binding.marker_places import marker_places
from usdface.blas_threads import one_blas_thread
from usdface.face.fitted_setup import fit_setup
from usdface.figures.picture import check_picture
from usdface.io.atomic import StrPath, all_or_none, write_text
from usdface.io.bind_file import bind_json, read_bind, setup_of_json
from usdface.io.inputs import check_outputs, files_read
from usdface.io.overwrite_protection import check_replaced
from usdface.io.usd.front_facing_rig import front_facing_rig
from usdface.io.usd.stage import open_stage
from usdface.options import MarkerOptions
from usdface.progress import OnProgress, Progress
from usdface.result import Result
from usdface.setup.assumed_mesh import assumed_mesh_findings
from usdface.setup.binding import Binding

__all__ = ["make_markers"]


@checked
@one_blas_thread()
def make_markers(
    rig: StrPath,
    *,
    bind: StrPath | None = None,
    output: StrPath | None = None,
    figure: StrPath | None = None,
    overwrite: bool = False,
    options: MarkerOptions = MarkerOptions(),
    on_progress: OnProgress | None = None,
) -> Result[Binding]:
    """Find the vertices at which new markers determine the blend shapes of a face best.

    Parameters
    ----------
    rig : path
        A USD file with one character.
    bind : path, optional
        The binding of the markers that are there, JSON.
    output : path, optional
        Write the binding with the new markers, JSON.
    figure : path, optional
        Draw the markers on the face: .png, .svg or .pdf.
    overwrite : bool
        Replace `output` also where it was edited since usdface wrote it, or is of another origin.
    options : MarkerOptions
    on_progress : callable, optional

    Returns
    -------
    Result of Binding
        With the new markers. Keys of the summary: ``markers_bound``, ``shapes_undetermined``, and
        ``new_markers``, each with its place and how many shapes are undetermined with it.

    Raises
    ------
    UsdFaceError
        One clear line; nothing is written.

    Examples
    --------
    >>> result = usdface.make_markers("examples/head.usdc", bind="examples/bind.json")
    >>> len(result.summary["new_markers"])
    5
    """
    rig = Path(rig)
    bind, output, figure = (Path(p) if p else None for p in (bind, output, figure))
    progress = Progress.of(on_progress)
    written = tuple(path for path in (output, figure) if path)
    check_outputs(written, files_read(rig, bind))
    check_replaced([(output, "binding")], overwrite)
    check_picture(figure)
    with progress.step("read"):
        character, _, findings = front_facing_rig(open_stage(rig))
        if bind:
            setup, new_findings = read_bind(bind)
            findings += new_findings
            findings += assumed_mesh_findings(character, setup.binding, str(bind))
            mesh = character.mesh(setup.binding.mesh)
        else:
            mesh = character.face()
            setup = setup_of_json({"markers": {}, "mesh": mesh.path}, str(rig))
        setup, new_findings = fit_setup(setup, mesh)
        findings += new_findings
    with progress.step("place"):
        found = marker_places(mesh, setup.binding, count=options.count, noise=options.noise)
    binding = found.binding(setup.binding)
    with progress.step("write"), all_or_none():
        if output:
            write_text(output, bind_json(replace(setup, binding=binding)))
        if figure:
            from usdface.figures.binding import write_bind_figure

            write_bind_figure(mesh, binding, figure)
    rows = zip(binding.markers[-len(found.where) :], found.where, found.undetermined, strict=True)
    summary: dict[str, Any] = {
        "markers_bound": len(setup.binding.markers),
        "shapes_undetermined": len(found.undetermined_before),
        "new_markers": {
            name: {"place": where, "shapes_undetermined": len(rest)} for name, where, rest in rows
        },
    }
    details = {
        "vertices": found.vertices.tolist(),
        "undetermined": {"before": found.undetermined_before, "after": found.undetermined[-1]},
    }
    return Result(binding, written, tuple(findings), summary, details, progress.seconds)
