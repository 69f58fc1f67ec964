"""Processing a sequence of shots in worker processes: `usdface sequence`."""

import os
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from usdface.arguments import checked
from usdface.blas_threads import one_blas_thread
from usdface.findings import Finding, finding
from usdface.io.atomic import StrPath, write_text
from usdface.io.inputs import check_outputs, files_read
from usdface.io.plugins import check_skipped
from usdface.progress import OnProgress, Progress, Step
from usdface.result import Result
from usdface.show.discovery import find_shots
from usdface.show.making_record import is_settled
from usdface.show.page import table_page
from usdface.show.places import places
from usdface.show.plan import ShotPlan, same_outputs
from usdface.show.record import note_failure, read_failure, read_record, record_path
from usdface.show.table import Row, by_trouble, findings_of, row_from, summary_of
from usdface.show.watch import files_of
from usdface.show.workers import Outcome, cores, run_in_workers

__all__ = ["check_unread", "plans_of", "process_sequence"]

TIME_LIMIT = 3600.0  # s for a shot: two orders above the longest take that was measured


@checked
@one_blas_thread()
def process_sequence(
    sources: StrPath | Sequence[StrPath],
    *,
    index: str = "",
    workers: int | None = None,
    time_limit: float = TIME_LIMIT,
    pages: bool = False,
    table: StrPath | None = None,
    root: StrPath | None = None,
    gather: bool = False,
    cache: StrPath | bool = True,
    overwrite: bool = False,
    skip_hooks: Sequence[str] = (),
    on_progress: OnProgress | None = None,
) -> Result[tuple[Row, ...]]:
    """Make the shots of a sequence that are missing, and process those that are out of date.

    Each shot is processed as `process` does, in one of some worker processes. A shot that fails, or
    ends or hangs its worker, fails alone. An existing result is kept if it is up to date with the
    content of all files that it depends on, the options and the program.

    Parameters
    ----------
    sources : path or sequence of path
        Show files (.toml, .json), folders, lists of shots (.txt), shots.
    index : str
        ``"N"`` or ``"N-M"``: only these shots, counted from 0 in the order of the sources.
    workers : int, optional
        Number of processes; as many as this process may use cores if left out.
    time_limit : float [s]
        For a shot.
    pages : bool
        Also write a page for each shot, as `view` does.
    table : path, optional
        Also write the table as a page, .html, with links to those of the shots.
    root : path, optional
        Folder that names in show files and lists are relative to, in place of theirs.
    gather : bool
        Process nothing: only the table of the results that are there.
    cache : path or bool
        A folder for the arrays of each stage, as of `process`; True: beside each result, False:
        nowhere.
    overwrite : bool
        Replace results as `process` does with it. A shot that was edited is kept all the same.
    skip_hooks : sequence of str, optional
        Hooks of other packages that do not run, as of `process`, beside those that a show file
        names. A result with other hooks skipped is out of date.
    on_progress : callable, optional
        Called with a `Step` for each shot; an exception from it ends the workers.

    Returns
    -------
    Result of tuple of Row
        Sorted by trouble, and as plain values in ``details["shots"]``. Keys of the summary:
        ``shots``, ``processed``, ``kept``, ``failed``, ``missing``, ``workers``, ``verdicts``,
        ``peak_memory_mb``. A shot that failed is a finding (`SHOT_FAILED`), and so is a layer of a
        folder that is left out although it has a shot (`SHOT_LEFT_OUT`).

    Raises
    ------
    InputError
        If a source cannot be read, there are no shots, the index is outside of them, or a hook that
        is to be skipped is not installed.

    Examples
    --------
    >>> result = usdface.process_sequence("examples/shot.usda")
    >>> result.summary["processed"], result.value[0].verdict
    (1, 'good')
    >>> usdface.process_sequence("examples/shot.usda").summary["kept"]
    1
    """
    place = _page_place(table)
    progress = Progress.of(on_progress)
    given = [sources] if isinstance(sources, str | os.PathLike) else list(sources)
    with progress.step("find shots"):
        left_out: list[Finding] = []
        plans = plans_of(given, root, pages=pages, skip_hooks=skip_hooks, left_out=left_out)
        check_skipped({name for plan in plans for name in plan.skip_hooks})
        clashing = same_outputs(plans)
        check_unread([place], given, plans)
        numbers = places(index, len(plans), "--index", "shots")
        rows, due = _known(plans, numbers, clashing)
    team = max(1, min(workers or cores(), len(due)))
    if gather:
        rows |= {number: _lacking(plans[number]) for number in due}
    else:
        with progress.step("process"):
            done = _processed(
                [_task(plans[number], cache, overwrite) for number in due],
                team,
                time_limit,
                progress,
            )
            for number, row in done:
                rows[due[number]] = row
                failed = row.as_dict() if row.state == "failed" else None
                note_failure(plans[due[number]].file, failed)
    table_rows = by_trouble(rows.values())
    written = [Path(path) for number in due for path in rows[number].written]
    if place is not None:
        with progress.step("write"):
            write_text(place, table_page(table_rows, " ".join(map(str, given)), place))
        written.insert(0, place)
    return Result(
        tuple(table_rows),
        tuple(written),
        (*findings_of(table_rows), *left_out),
        summary_of(table_rows, team),
        {"shots": [row.as_dict() for row in table_rows]},
        progress.seconds,
    )


def plans_of(
    sources: Iterable[StrPath],
    root: StrPath | None = None,
    *,
    pages: bool = False,
    skip_hooks: Sequence[str] = (),
    left_out: list[Finding] | None = None,
) -> list[ShotPlan]:
    """Return the plans of the shots of a sequence, with the settings that all of them get.

    SHOT_LEFT_OUT is appended to `left_out` for each layer of a folder over a result in a shot.
    """
    skipped: list[Path] = []
    plans = find_shots(map(Path, sources), _shot_test(skipped), Path(root) if root else None)
    if left_out is not None:  # one that another source names is a shot all the same
        named = {plan.file.resolve() for plan in plans}
        distinct = {path.resolve(): path for path in skipped if path.resolve() not in named}
        left_out += [finding("SHOT_LEFT_OUT", str(path)) for path in distinct.values()]
    return [
        replace(plan, page=plan.page or pages, skip_hooks=(*plan.skip_hooks, *skip_hooks))
        for plan in plans
    ]


def check_unread(
    places: Iterable[Path | None], sources: Iterable[StrPath], plans: Iterable[ShotPlan]
) -> None:
    """Refuse outputs that the sequence reads.

    Raises
    ------
    OutputError
        If an output is one of the files that the shots are made of.
    """
    there = [place for place in places if place is not None and place.exists()]
    if not there:
        return
    plans = list(plans)
    read = {file: file for file in files_of(map(Path, sources), plans)}
    # The files of a shot without a record are not known yet.
    new = [plan for plan in plans if not record_path(plan.file, "record").exists()]
    for plan in new:
        read |= files_read(plan.file, *(plan.making.files if plan.making else ()))
    check_outputs(there, read)


def _page_place(table: StrPath | None) -> Path | None:
    if table is None or not str(table):
        return None
    from usdface.io.atomic import check_place
    from usdface.show.page import check_page_name

    check_page_name(Path(table))
    check_place(Path(table))
    return Path(table)


def _shot_test(skipped: list[Path]) -> Callable[[Path], bool]:
    """Return a function that tells whether a file is a shot, and appends layers over results."""

    def is_shot(path: Path) -> bool:
        from usdface.pipeline.shot_task import file_role  # loads USD: a second run needs none

        role = file_role(path)
        if role == "over result":
            skipped.append(path)
        return role == "shot"

    return is_shot


def _known(
    plans: Sequence[ShotPlan], numbers: Iterable[int], clashing: Mapping[int, tuple[Path, str]]
) -> tuple[dict[int, Row], list[int]]:
    """Return the rows of shots that cannot be made or are up to date, and the others' numbers."""
    rows: dict[int, Row] = {}
    due: list[int] = []
    for number in numbers:
        if number in clashing:
            rows[number] = _clash(plans[number], *clashing[number])
        elif kept := _kept(plans[number]):
            rows[number] = kept
        else:
            due.append(number)
    return rows, due


def _kept(plan: ShotPlan) -> Row | None:
    """Return the row of a result that is up to date."""
    if not is_settled(plan):
        return None
    record = read_record(record_path(plan.file))
    if record is None or not record.is_current(plan.file.parent, plan.options):
        return None
    row = row_from(record.row)
    if row is None:
        return None
    page = str(plan.page_path) if plan.page else ""
    return replace(row, name=plan.name, state="kept", root=str(plan.paths.root), page=page)


def _task(plan: ShotPlan, cache: StrPath | bool, overwrite: bool) -> dict[str, Any]:
    """Return the task of a worker."""
    if isinstance(cache, bool):
        folder = str(plan.paths.folder / "cache") if cache else ""
    else:
        folder = os.fspath(cache)
    return {"plan": plan.as_dict(), "cache": folder, "overwrite": overwrite}


def _processed(
    tasks: Sequence[dict[str, Any]], team: int, time_limit: float, progress: Progress
) -> Iterable[tuple[int, Row]]:
    """Yield the row of each shot as it is done."""
    names = [task["plan"]["name"] for task in tasks]
    done = 0

    def begin(number: int) -> None:
        progress(Step(names[number], done / len(names)))

    begun = time.monotonic()
    outcomes = run_in_workers(
        "usdface.pipeline.shot_task:run_shot",
        tasks,
        workers=team,
        time_limit=time_limit,
        on_begin=begin,
    )
    for outcome in outcomes:
        done += 1
        row = row_from(outcome.value) if isinstance(outcome.value, dict) else None
        yield outcome.number, row or _failed(names[outcome.number], outcome)
    progress.seconds["workers"] = time.monotonic() - begun


def _failed(name: str, outcome: Outcome) -> Row:
    return Row(name=name, state="failed", error=outcome.error, code=outcome.code)


def _lacking(plan: ShotPlan) -> Row:
    """Return the row of a shot without a result: why it failed, where it was tried."""
    row = row_from(read_failure(plan.file) or {})
    if row is not None and row.state == "failed":
        return replace(row, name=plan.name)
    error = "the result is missing or out of date"
    return Row(name=plan.name, state="missing", error=error, code="SHOT_MISSING")


def _clash(plan: ShotPlan, path: Path, other: str) -> Row:
    error = f"{path} would be written by {other}, too; give each shot a file of its own"
    return Row(name=plan.name, state="failed", error=error, code="OUTPUT_UNWRITABLE")
