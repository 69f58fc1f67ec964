"""Pages to place markers on: `usdface bind`."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from usdface.arguments import checked
from usdface.binding.binding_report import binding_findings
from usdface.binding.resolve_binding import resolve_binding
from usdface.binding.resolved_binding import UnsureBindingError
from usdface.blas_threads import one_blas_thread
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.atomic import StrPath, write_text
from usdface.io.bind_file import bind_json, read_bind
from usdface.io.inputs import check_outputs, files_read
from usdface.io.takes.usd_take import read_usd_take
from usdface.io.usd.front_facing_rig import front_facing_rig
from usdface.io.usd.played_shot import has_setup
from usdface.io.usd.shot import read_shot
from usdface.io.usd.stage import open_stage
from usdface.options import BindOptions, TakeOptions
from usdface.page.bind_data import bind_data
from usdface.page.character import character_data
from usdface.page.document import finding_lines, page_html
from usdface.pipeline.schemas import register_schemas
from usdface.pipeline.viewing import images_of
from usdface.progress import OnProgress, Progress
from usdface.result import Result
from usdface.rigs import Mesh, Rig
from usdface.setup.assumed_mesh import assumed_mesh_findings
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup
from usdface.setup.setup_summary import bound_count
from usdface.show.page import check_page_name
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["make_bind_page"]

_NOTHING = RetargetSetup(Binding((), np.zeros(0, dtype=np.int64)))
# Takes for which no vertex can be proposed; a person can place their markers.
_UNPROPOSED = ("MARKERS_TOO_FEW", "TAKE_STILL", "TAKE_KIND_WRONG")


@checked
@one_blas_thread()
def make_bind_page(
    source: StrPath,
    output: StrPath,
    *,
    take: StrPath | None = None,
    bind: StrPath | None = None,
    binding: BindOptions = BindOptions(),
    on_progress: OnProgress | None = None,
) -> Result[RetargetSetup]:
    """Write a page on which a person checks and moves the places of markers.

    It shows the proposed vertices on the face with their confidence, and saves ``bind.json`` for
    `make_shot`. The page is one HTML file that makes no request.

    Parameters
    ----------
    source : path
        A rig, as `make_rig` writes it, or a shot.
    output : path
        The page, .html.
    take : path, optional
        The take, as `make_take` writes it; of a shot it is its own.
    bind : path, optional
        A binding to begin with, JSON; without one vertices are proposed, or those of the shot are
        taken.
    binding : BindOptions
    on_progress : callable, optional
        Called with each `Step`; an exception from it ends the job before anything is written.

    Returns
    -------
    Result of RetargetSetup
        As the page shows it. Keys of the summary: ``markers``, ``markers_bound``,
        ``markers_unsure``, ``size_mb``.

    Raises
    ------
    InputError
        If rig and take cannot be read, or the take has no markers.
    OutputError
        If the page is not named as one, or cannot be written.

    Examples
    --------
    >>> result = usdface.make_bind_page(
    ...     "examples/head.usdc",
    ...     "bind.html",
    ...     take="examples/take.usdc",
    ...     bind="examples/bind.json",
    ... )
    >>> result.summary["markers"], result.summary["markers_unsure"]
    (42, 0)
    """
    path, page = Path(source), Path(output)
    check_page_name(page)
    register_schemas()
    progress = Progress.of(on_progress)
    others = [Path(other) for other in (take, bind) if other]
    check_outputs([page], files_read(path, *others))
    with progress.step("read"):
        rig, recorded, setup, findings = _read(path, Path(take) if take else None)
        if bind:
            setup, new_findings = read_bind(Path(bind))
            setup = _on_shot(rig, setup)
            findings += new_findings
    with progress.step("bind"):
        mesh, setup, new_findings = _bound(rig, recorded, setup, binding, str(bind or ""))
        findings += new_findings
    with progress.step("page"):
        setup = replace(setup, binding=replace(setup.binding, mesh=_mesh_name(rig, mesh)))
        data = bind_data(recorded, mesh, setup, bind_json(setup))
        meshes = rig.meshes
        images, new_findings = images_of(rig, meshes)
        findings += new_findings
        data |= {
            "character": character_data(replace(rig, skeleton=None), meshes, images),
            "mesh": next(i for i, each in enumerate(meshes) if each is mesh),
            "findings": finding_lines(findings),
        }
        about = f"{len(recorded.names)} markers on {mesh.name}"
        text = page_html("bind", f"{path.name}: places of the markers", about, data)
    with progress.step("write"):
        write_text(page, text)
    summary = {
        "markers": len(recorded.names),
        "markers_bound": bound_count(setup, recorded),
        "markers_unsure": len(setup.unsure.markers),
        "size_mb": round(len(text) / 1e6, 2),
    }
    return Result(setup, (page,), tuple(findings), summary, seconds=progress.seconds)


def _mesh_name(rig: Rig, mesh: Mesh) -> str:
    """Return a mesh's name, which rig and shot share; its path where another has that name."""
    alike = [each for each in rig.meshes if each.name == mesh.name]
    return mesh.name if len(alike) == 1 else mesh.path


def _on_shot(rig: Rig, setup: RetargetSetup) -> RetargetSetup:
    """Return a setup that names its mesh as the shot does, where it has its path in the rig."""
    mesh = setup.binding.mesh
    name = mesh.rpartition("/")[2]
    if mesh == name or any(each.path == mesh for each in rig.meshes):
        return setup
    alike = sum(each.name == name for each in rig.meshes)
    return replace(setup, binding=replace(setup.binding, mesh=name)) if alike == 1 else setup


def _read(
    path: Path, take: Path | None
) -> tuple[Rig, MarkerTake, RetargetSetup | None, list[Finding]]:
    """Return rig, take and setup, if there is one."""
    stage = open_stage(path)
    recorded: MarkerTake | WeightsTake | None = None
    setup = None
    if has_setup(stage):
        staged, findings = read_shot(stage, str(path))
        rig, recorded, setup = staged.shot.rig, staged.shot.take, staged.shot.setup
    else:
        rig, _, findings = front_facing_rig(stage)
    if take is not None:
        recorded, _ = read_usd_take(take, TakeOptions())
    if recorded is None:
        raise InputError(f"{path} is no shot and has no take; name one: --take take.usdc")
    if not isinstance(recorded, MarkerTake):
        raise InputError(
            f"the take {recorded.source} has weights and no markers to place; the binding of "
            '`usdface shot` may say under "curves" which blend shapes they drive',
            "TAKE_KIND_WRONG",
        )
    return rig, recorded, setup, findings


def _bound(
    rig: Rig, take: MarkerTake, given: RetargetSetup | None, options: BindOptions, source: str
) -> tuple[Mesh, RetargetSetup, list[Finding]]:
    """Return the mesh and the setup as given or proposed, also where no place is sure.

    `source` is the file of the given setup.
    """
    try:
        resolved = resolve_binding(rig, take, given, options=options)
    except UnsureBindingError as error:
        message = "more places are unsure than sure; look at each"
        unsure = finding("BIND_UNSURE", take.source, message)
        return error.mesh, error.setup, [*_assumed(rig, given, source), unsure]
    except InputError as error:
        if error.code not in _UNPROPOSED:
            raise
        mesh = rig.mesh(given.binding.mesh) if given else rig.face()
        message = "place them by hand: {error}"
        by_hand = finding("PLACES_NOT_PROPOSED", take.source, message, error)
        return mesh, given or _NOTHING, [*_assumed(rig, given, source), by_hand]
    return resolved.mesh, resolved.setup, binding_findings(resolved, take, source)


def _assumed(rig: Rig, given: RetargetSetup | None, source: str) -> list[Finding]:
    return assumed_mesh_findings(rig, given.binding, source) if given is not None else []
