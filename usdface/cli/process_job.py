"""`process --openjd`: the pieces of a long take as a job of a farm."""

import argparse
from collections.abc import Sequence

from usdface.cli.command import report
from usdface.cli.progress import progress

__all__ = ["write_job"]

# Options that a job repeats: of all its steps, and of the last.
_OF_STEPS = (
    *("no_express", "no_closure", "no_head", "no_clean", "solve", "exaggeration", "gains"),
    *("asset_root", "skip_hooks", "trusted"),
)
_OF_LAST = (
    *("gltf", "figure", "sheet", "deliver", "start", "end", "handles", "rate", "cache"),
    *("output", "in_place", "overwrite", "strict"),
)


def write_job(parsed: argparse.Namespace) -> int:
    """Write the job, with the options that its steps repeat; print the report."""
    from usdface.pipeline.farm_jobs import write_pieces_job

    with progress(parsed) as step:
        result = write_pieces_job(
            parsed.shot,
            parsed.pieces,
            parsed.openjd,
            chunk=1 if parsed.chunk is None else parsed.chunk,
            words=_words(parsed, _OF_STEPS),
            last=_words(parsed, _OF_LAST),
            asset_root=parsed.asset_root,
            on_progress=step,
        )
    return report(parsed, result)


def _words(parsed: argparse.Namespace, names: Sequence[str]) -> list[str]:
    """Return options as words of the command line; without those that were not given."""
    words = []
    for name in names:
        given = name.removeprefix("no_")
        value = getattr(parsed, given)
        option = "--" + {"skip_hooks": "skip-hook"}.get(name, name.replace("_", "-"))
        if value == parsed.command.get_default(given):
            continue
        if isinstance(value, bool):
            words.append(option)
        elif isinstance(value, list):
            words += [word for each in value for word in (option, str(each))]
        else:
            # A number may be negative, so it must not look like an option.
            words.append(f"{option}={value}")
    return words
