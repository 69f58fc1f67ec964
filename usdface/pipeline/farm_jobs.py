"""Jobs of Open Job Description: of a sequence, and of a very long take in pieces."""

import os
from collections.abc import Iterable, Sequence
from pathlib import Path

from usdface.errors import InputError
from usdface.findings import Finding
from usdface.io.atomic import StrPath
from usdface.io.inputs import files_read
from usdface.io.layer_paths import layer_paths
from usdface.options import ProcessOptions
from usdface.pipeline.kept_pieces import KeptPieces
from usdface.pipeline.schemas import register_schemas
from usdface.pipeline.sequence import plans_of
from usdface.progress import OnProgress, Progress
from usdface.result import Result
from usdface.show.openjd import common_folder, write_bundle
from usdface.show.openjd_pieces import write_pieces_bundle
from usdface.show.plan import ShotPlan

__all__ = ["write_pieces_job", "write_sequence_job"]


def write_sequence_job(
    sources: StrPath | Sequence[StrPath],
    folder: StrPath,
    *,
    chunk: int = 1,
    pages: bool = False,
    skip_hooks: Sequence[str] = (),
    root: StrPath | None = None,
    on_progress: OnProgress | None = None,
) -> Result[None]:
    """Write a sequence as a job of Open Job Description: a bundle of four files.

    Its first step processes the shots, some in a task; its second gathers the table.

    Parameters
    ----------
    sources : path or sequence of path
        As of `process_sequence`.
    folder : path
        Of the bundle; existing files of these names are replaced.
    chunk : int
        Shots in a task.
    pages : bool
        Also write a page for each shot.
    skip_hooks : sequence of str, optional
        Hooks of other packages that do not run; they need to be installed on the workers alone.
    root : path, optional
        The folder that holds all files of the show; the deepest that does, if left out.
    on_progress : callable, optional
        Called with each `Step`.

    Returns
    -------
    Result of None
        `written` begins with the template. Keys of the summary: ``shots``, ``tasks``, ``inputs``,
        ``root``. A layer of a folder that is left out although it has a shot is a finding
        (`SHOT_LEFT_OUT`).

    Raises
    ------
    InputError
        If a source cannot be read, or a file lies outside of `root`.
    """
    if chunk < 1:
        raise InputError(f"a task of {chunk} shots; expected 1 or more", "SETTING_WRONG")
    progress = Progress.of(on_progress)
    given = [sources] if isinstance(sources, str | os.PathLike) else list(sources)
    with progress.step("find shots"):
        left_out: list[Finding] = []
        plans = plans_of(given, pages=pages, skip_hooks=skip_hooks, left_out=left_out)
        inputs = _inputs(plans)
    with progress.step("write"):
        base = Path(root) if root else common_folder([*inputs, *(plan.file for plan in plans)])
        name = f"usdface {Path(given[0]).stem}"
        written = write_bundle(
            Path(folder), plans, root=base, inputs=inputs, name=name, chunk=chunk
        )
    tasks = -(-len(plans) // chunk)
    summary = {"shots": len(plans), "tasks": tasks, "inputs": len(inputs), "root": str(base)}
    return Result(None, written, tuple(left_out), summary, seconds=progress.seconds)


def write_pieces_job(
    shot: StrPath,
    pieces: StrPath,
    folder: StrPath,
    *,
    chunk: int,
    words: Sequence[str],
    last: Sequence[str],
    asset_root: StrPath | None,
    on_progress: OnProgress | None,
) -> Result[None]:
    """Write a long take as a job of Open Job Description: estimates, pieces as tasks, join.

    Parameters
    ----------
    shot : path
    pieces : path
        The folder that the pieces are kept in.
    folder : path
        Of the bundle; existing files of these names are replaced.
    chunk : int
        Pieces in a task.
    words : sequence of str
        Options of the command line, of all steps.
    last : sequence of str
        Those of the last step, which writes the result.
    asset_root : path, optional
    on_progress : callable, optional
        Called with each `Step`.

    Returns
    -------
    Result of None
        `written` begins with the template. Keys of the summary: ``frames``, ``pieces``, ``tasks``,
        ``inputs``.

    Raises
    ------
    InputError
        If the shot cannot be read.
    """
    if chunk < 1:
        raise InputError(f"a task of {chunk} pieces; expected 1 or more", "SETTING_WRONG")
    register_schemas()
    progress, path = Progress.of(on_progress), Path(shot)
    with progress.step("read"):
        cuts = KeptPieces(path, Path(pieces), ProcessOptions(), asset_root).cuts
        own = layer_paths(path, None)
        inputs = [file for file in files_read(path, apart=own.layers) if file.is_file()]
    with progress.step("write"):
        written = write_pieces_bundle(
            *(Path(folder), path, Path(pieces)),
            count=len(cuts),
            chunk=chunk,
            options=words,
            last=last,
            inputs=inputs,
            outputs=[path.parent],
        )
    tasks = -(-len(cuts) // chunk) + 2
    summary = {
        "frames": cuts.frames,
        "pieces": len(cuts),
        "tasks": tasks,
        "inputs": len(inputs),
    }
    return Result(None, written, (), summary, seconds=progress.seconds)


def _inputs(plans: Iterable[ShotPlan]) -> list[Path]:
    """Return all files that the shots read: their sources, or those that they are composed of."""
    sources: dict[Path, None] = {}
    for plan in plans:
        sources |= dict.fromkeys(plan.making.files if plan.making else (plan.file,))
        if plan.making and plan.file.is_file():  # it may have been edited
            sources[plan.file] = None
    return [file for file in files_read(*sources) if file.is_file()]
