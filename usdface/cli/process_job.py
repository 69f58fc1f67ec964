"""`process --openjd`: the pieces of a long take as a job of a farm."""

import argparse
from collections.abc import Collection

from usdface.cli.command import report
from usdface.cli.progress import progress

__all__ = ["job_words", "write_job"]

# Options that no step repeats: those of the job, which each step has in its own way, and those of
# what this command prints. Any other, also one that is new, is repeated.
_OF_JOB = frozenset(
    ("openjd", "chunk", "pieces", "piece", "workers", "format", "report", "progress", "debug")
)


def write_job(parsed: argparse.Namespace, of_result: Collection[str]) -> int:
    """Write the job, with the options that its steps repeat; print the report.

    Parameters
    ----------
    parsed : argparse.Namespace
    of_result : collection of str
        Options that only the last step repeats, as it writes the result.
    """
    from usdface.pipeline.farm_jobs import write_pieces_job

    with progress(parsed) as step:
        result = write_pieces_job(
            parsed.shot,
            parsed.pieces,
            parsed.openjd,
            chunk=1 if parsed.chunk is None else parsed.chunk,
            words=job_words(parsed, apart=of_result),
            last=job_words(parsed, only=of_result),
            asset_root=parsed.asset_root,
            on_progress=step,
        )
    return report(parsed, result)


def job_words(
    parsed: argparse.Namespace,
    *,
    only: Collection[str] | None = None,
    apart: Collection[str] = (),
) -> list[str]:
    """Return the options that were given, as words of the command line; without those of the job.

    Parameters
    ----------
    parsed : argparse.Namespace
    only : collection of str, optional
        Names of options in `parsed`; all, if left out.
    apart : collection of str
        Names of options to leave out.
    """
    words: list[str] = []
    for action in parsed.command._actions:
        name = action.dest
        if name not in parsed or not action.option_strings or name in (*_OF_JOB, *apart):
            continue
        value, option = getattr(parsed, name), action.option_strings[-1]
        if value == parsed.command.get_default(name) or (only is not None and name not in only):
            continue
        if isinstance(value, bool):
            words.append(option)
        elif isinstance(value, list):
            words += [word for each in value for word in (option, str(each))]
        else:
            # A number may be negative, so it must not look like an option.
            words.append(f"{option}={value}")
    return words
