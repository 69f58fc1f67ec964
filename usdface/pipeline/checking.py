"""Checks of blend shapes: `usdface check`."""

from collections.abc import Iterable
from os import PathLike
from pathlib import Path

from usdface.blas_threads import one_blas_thread
from usdface.errors import UsdFaceError
from usdface.findings import Finding, finding
from usdface.io.atomic import StrPath
from usdface.io.check import check_file
from usdface.io.check_generation import check_generations
from usdface.pipeline.schemas import register_schemas
from usdface.progress import OnProgress, Progress, Step
from usdface.result import Result

__all__ = ["check"]


@one_blas_thread()
def check(
    paths: StrPath | Iterable[StrPath], *, on_progress: OnProgress | None = None
) -> Result[None]:
    """Check blend shapes and their animation for faults that the standard validators miss.

    Parameters
    ----------
    paths : path or paths
        USD or glTF files.
    on_progress : callable, optional

    Returns
    -------
    Result of None
        Keys of the summary: ``files``, ``findings``.

    Raises
    ------
    InputError
        If the file cannot be read. Of several files each that cannot is the finding
        FILE_UNREADABLE, and the others are checked.

    Examples
    --------
    >>> usdface.check("examples/head.usdc").findings
    ()
    """
    files = [Path(p) for p in ([paths] if isinstance(paths, str | PathLike) else paths)]
    register_schemas()
    progress = Progress.of(on_progress)
    findings: list[Finding] = []
    for done, path in enumerate(files):
        progress(Step("check", done / len(files)))
        with progress.step(f"check {path.name}"):
            findings += check_file(path) if len(files) == 1 else _checked(path)
    findings += check_generations(files)
    summary = {"files": len(files), "findings": len(findings)}
    return Result(None, (), tuple(findings), summary, seconds=progress.seconds)


def _checked(path: Path) -> list[Finding]:
    try:
        return check_file(path)
    except UsdFaceError as error:
        return [finding("FILE_UNREADABLE", str(path), "{error}", error)]
