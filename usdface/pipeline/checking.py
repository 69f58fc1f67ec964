"""Checks of blend shapes: `usdface check`."""

from collections.abc import Iterable
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any

from usdface.arguments import checked
from usdface.blas_threads import one_blas_thread
from usdface.errors import InputError, UsdFaceError
from usdface.figures.picture import check_picture
from usdface.findings import Finding, finding
from usdface.io.atomic import StrPath
from usdface.io.check import check_file
from usdface.io.check_generation import check_generations
from usdface.io.inputs import check_outputs, files_read
from usdface.pipeline.schemas import register_schemas
from usdface.progress import OnProgress, Progress, Step
from usdface.result import Result

__all__ = ["check"]


@checked
@one_blas_thread()
def check(
    paths: StrPath | Iterable[StrPath],
    *,
    facs: bool = False,
    figure: StrPath | None = None,
    on_progress: OnProgress | None = None,
) -> Result[None]:
    """Check blend shapes and their animation for faults that the standard validators miss.

    Parameters
    ----------
    paths : path or paths
        USD or glTF files. Of several, the place of a finding begins with its file.
    facs : bool
        Also judge each face by action units: blend shapes, expression poses, and of a processed
        shot the peaks of its emotions.
    figure : path, optional
        Draw the verdicts on one file: .png, .svg or .pdf; with `facs`.
    on_progress : callable, optional

    Returns
    -------
    Result of None
        Keys of the summary: ``files``, ``findings``. With `facs`, `details` has ``facs``: the
        verdicts on each file.

    Raises
    ------
    InputError
        If the file cannot be read. Of several files each that cannot is the finding
        FILE_UNREADABLE, and the others are checked. If a figure of several files is requested, or
        one without `facs`.

    Examples
    --------
    >>> usdface.check("examples/head.usdc").findings
    ()
    >>> result = usdface.check("examples/head.usdc", facs=True)
    >>> result.details["facs"][0]["counts"]
    {'done': 51, 'unnamed': 1}
    """
    files = [Path(p) for p in ([paths] if isinstance(paths, str | PathLike) else paths)]
    picture = _picture(figure, files, facs)
    register_schemas()
    progress = Progress.of(on_progress)
    findings: list[Finding] = []
    judged: list[dict[str, Any]] = []
    for done, path in enumerate(files):
        progress(Step("check", done / len(files)))
        with progress.step(f"check {path.name}"):
            found = check_file(path) if len(files) == 1 else _checked(path)
            findings += found if len(files) == 1 else _placed(found, path)
        if facs and all(one.code != "FILE_UNREADABLE" for one in found):
            from usdface.pipeline.facs import judge_file  # loads the geometry of faces

            with progress.step(f"judge {path.name}"):
                verdicts, found = judge_file(path, picture)
            findings += found if len(files) == 1 else _placed(found, path)
            judged.append({"file": str(path), **verdicts})
    findings += check_generations(files)
    summary = {"files": len(files), "findings": len(findings)}
    drawn = picture is not None and any("shapes" in verdicts for verdicts in judged)
    written = (picture,) if picture and drawn else ()
    details = {"facs": judged} if facs else {}
    return Result(None, written, tuple(findings), summary, details, progress.seconds)


def _picture(figure: StrPath | None, files: list[Path], facs: bool) -> Path | None:
    """Return the figure's file, validated."""
    if not figure:
        return None
    if not facs or len(files) != 1:
        raise InputError(
            f"cannot draw {figure}: a figure is of the action units of one file; name one, with "
            "--facs"
        )
    picture = Path(figure)
    check_picture(picture)
    check_outputs([picture], files_read(*files))
    return picture


def _checked(path: Path) -> list[Finding]:
    try:
        return check_file(path)
    except UsdFaceError as error:
        return [finding("FILE_UNREADABLE", str(path), "{error}", error)]


def _placed(findings: Iterable[Finding], path: Path) -> list[Finding]:
    """Return findings whose places begin with their file: "mesh 0" is in each of several."""
    file = str(path)
    return [
        f
        if f.where.startswith(file)
        else replace(f, where=f"{file}: {f.where}" if f.where else file)
        for f in findings
    ]
