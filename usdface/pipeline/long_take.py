"""Long takes in pieces, as tasks of a farm or of worker processes: `usdface process --pieces`."""

import json
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import fields
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar, cast

from usdface.arguments import checked
from usdface.blas_threads import one_blas_thread
from usdface.errors import ERROR_CODES, InputError, SolveError
from usdface.findings import Finding
from usdface.hooks import Hook
from usdface.io.atomic import StrPath
from usdface.io.mapped_arrays import MappedArrays
from usdface.io.plugins import installed_hooks
from usdface.options import ProcessOptions
from usdface.pipeline.kept_pieces import KeptPieces
from usdface.pipeline.schemas import register_schemas
from usdface.progress import OnProgress, Progress, Step
from usdface.result import Result
from usdface.shot.join_pieces import join
from usdface.shot.retarget_pieces import EstimatedTake, SolvedPiece
from usdface.shot.shot import SolvedShot
from usdface.show.places import places
from usdface.show.stage_cache import StageCache
from usdface.show.workers import cores, run_in_workers

__all__ = ["PiecedStages", "check_no_hooks", "run_piece", "solve_pieces"]

_TIME_LIMIT = 3600.0  # s for a piece: two orders above the measured time

ValueT = TypeVar("ValueT")


@checked
@one_blas_thread()
def solve_pieces(
    shot: StrPath,
    folder: StrPath,
    *,
    index: str = "",
    workers: int | None = None,
    asset_root: StrPath | None = None,
    skip_hooks: Sequence[str] = (),
    options: ProcessOptions = ProcessOptions(),
    on_progress: OnProgress | None = None,
) -> Result[None]:
    """Solve a long take in pieces, each a file in a folder; `process` joins them.

    Parameters
    ----------
    shot : path
    folder : path
        Of the estimates and the pieces. Files that are up to date are kept.
    index : str
        ``"N"`` or ``"N-M"``: only these pieces, from 0 on; ``"estimates"``: none of them.
    workers : int, optional
        Processes; as many as this one may use cores, if left out.
    asset_root : path, optional
    skip_hooks : sequence of str
    options : ProcessOptions
        These and the asset root are as of `process`.
    on_progress : callable, optional

    Returns
    -------
    Result of None
        Keys of the summary: ``frames``, ``pieces``, ``overlap_frames``, ``computed``, ``cached``.

    Raises
    ------
    InputError
        If the index is outside of the pieces, or the take is one of weights.
    OutputError
        If the folder is a file, or cannot be written to.
    SolveError
        If a piece cannot be solved.

    Examples
    --------
    >>> usdface.solve_pieces("examples/shot.usda", "pieces", index="estimates").summary["pieces"]
    1
    """
    register_schemas()
    progress = Progress.of(on_progress)
    path, place = Path(shot), Path(folder)
    with progress.step("read"):
        check_no_hooks(installed_hooks(skip_hooks)[0])
        pieces = KeptPieces(path, place, options, asset_root)
        numbers = _chosen(index, len(pieces.cuts))
    with progress.step("estimate"):
        known = pieces.estimates()
    used = dict(pieces.used)
    tasks = [
        {
            "shot": str(path),
            "folder": str(place),
            "number": number,
            "options": _plain(options),
            "asset_root": os.fspath(asset_root) if asset_root else None,
        }
        for number in numbers
    ]
    with progress.step("pieces"):
        for done, (number, how) in enumerate(_each(pieces, known, tasks, workers)):
            used[f"piece {number}"] = how
            progress(Step("pieces", (done + 1) / len(tasks)))
    states = list(used.values())
    summary = {
        "frames": pieces.cuts.frames,
        "pieces": len(pieces.cuts),
        "overlap_frames": known.overlap,
        "computed": states.count("computed"),
        "cached": states.count("cached"),
    }
    return Result(None, (), known.findings, summary, seconds=progress.seconds)


def _plain(options: ProcessOptions) -> dict[str, Any]:
    """Return options as plain values, which JSON can hold."""
    values = {part.name: getattr(options, part.name) for part in fields(options)}
    return {key: dict(v) if isinstance(v, Mapping) else v for key, v in values.items()}


def _each(
    pieces: KeptPieces, known: EstimatedTake, tasks: Sequence[dict[str, Any]], workers: int | None
) -> Any:
    """Yield number and state of each piece as it is done."""
    team = min(workers or cores(), len(tasks))
    if team <= 1:
        for task in tasks:
            number = task["number"]
            pieces.piece(number, known)
            yield number, pieces.used[f"piece{number:05}"]
        return
    for outcome in run_in_workers(
        "usdface.pipeline.long_take:run_piece", tasks, workers=team, time_limit=_TIME_LIMIT
    ):
        number = tasks[outcome.number]["number"]
        if outcome.error:
            code = outcome.code if outcome.code in ERROR_CODES else ""
            raise SolveError(f"piece {number} of the take: {outcome.error}", code)
        yield number, outcome.value


def run_piece(task: Mapping[str, Any]) -> str:
    """Solve a piece, in a worker; return "cached" or "computed"."""
    register_schemas()
    pieces, known = _opened(
        task["shot"], task["folder"], json.dumps(task["options"]), task["asset_root"]
    )
    number = task["number"]
    pieces.piece(number, known)
    return pieces.used[f"piece{number:05}"]


@lru_cache(maxsize=1)
def _opened(
    shot: str, folder: str, options: str, asset_root: str | None
) -> tuple[KeptPieces, EstimatedTake]:
    """Return the pieces of a shot and their estimates, which a worker reads once."""
    given = ProcessOptions(**json.loads(options))
    pieces = KeptPieces(Path(shot), Path(folder), given, asset_root)
    return pieces, pieces.estimates()


def check_no_hooks(hooks: Sequence[Hook]) -> None:
    """Refuse hooks, which expect a take as a whole.

    Raises
    ------
    InputError
        If there are any.
    """
    if hooks:
        names = ", ".join(hook.name for hook in hooks)
        raise InputError(
            f"a take is not solved in pieces with hooks ({names}); leave them out (--skip-hook), "
            "or process it as a whole",
            "SETTING_WRONG",
        )


def _chosen(index: str, count: int) -> range:
    if index == "estimates":
        return range(0)
    return places(index, count, "--piece", "pieces")


class PiecedStages:
    """Stages of a shot whose solve is joined from pieces.

    Parameters
    ----------
    shot : Path
    folder : Path
        Of the pieces.
    options : ProcessOptions
    asset_root : path, optional
    others : StageCache, optional
        Of the other stages.

    Attributes
    ----------
    used : dict of str to {"cached", "computed", "joined"}
        The origin of the value of each stage.
    """

    def __init__(
        self,
        shot: Path,
        folder: Path,
        options: ProcessOptions,
        asset_root: StrPath | None,
        others: StageCache | None,
    ) -> None:
        self.used: dict[str, str] = {}
        self._pieces = KeptPieces(shot, folder, options, asset_root)
        self._others = others
        self._folder = folder

    @property
    def not_kept(self) -> list[Finding]:
        """CACHE_NOT_KEPT for stages other than the solve; a piece that is not kept is an error."""
        return [] if self._others is None else self._others.not_kept

    def stage(
        self,
        name: str,
        inputs: object,
        given: Mapping[str, object],
        compute: Callable[[], ValueT],
    ) -> ValueT:
        """Return the joined solve; another stage from its cache."""
        if name == "solve":
            known, cuts = self._pieces.estimates(), self._pieces.cuts
            each = (self._pieces.piece(number, known) for number in range(len(cuts)))
            self.used[name] = "joined"
            return cast(ValueT, self._joined(each, known))
        if self._others is None:
            self.used[name] = "computed"
            return compute()
        value = self._others.stage(name, inputs, given, compute)
        self.used |= self._others.used
        return value

    def _joined(self, pieces: Iterable[SolvedPiece], known: EstimatedTake) -> SolvedShot:
        arrays = MappedArrays(self._folder)
        try:
            return join(pieces, known, arrays)
        finally:
            arrays.close()
