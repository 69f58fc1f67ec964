"""Options of a run: steps that are left out or done otherwise, factors on what is played."""

import argparse

from usdface.cli.command import settings
from usdface.errors import InputError
from usdface.options import EXAGGERATION_PARTS, ProcessOptions

__all__ = ["add_run_options", "run_options"]


def add_run_options(command: argparse.ArgumentParser) -> None:
    """Add those that `process` and `fuzzy explain` share: both show the same result."""
    command.add_argument(
        "--no-closure",
        dest="closure",
        action="store_false",
        help="no completed closures: eyes and lips stay as solved and corrected",
    )
    command.add_argument(
        "--no-clean",
        dest="clean",
        action="store_false",
        help="solve the markers as recorded, without clean-up",
    )
    command.add_argument(
        "--solve",
        choices=("take", "frame"),
        help="all frames together or each alone (default: as the shot says)",
    )
    command.add_argument(
        "--exaggeration",
        default="",
        metavar="FACTORS",
        help="play the solve larger or smaller, 1 = as solved: 1.2, or brows=1.5,eyes=1.3",
    )
    command.add_argument(
        "--gains",
        default="",
        metavar="FACTORS",
        help="raise emotions to more or less of their poses, 1 = as designed: joy=0.8,anger=0",
    )


def run_options(parsed: argparse.Namespace) -> ProcessOptions:
    """Return the options of a run.

    Raises
    ------
    InputError
        If a factor is no number, or is of nothing.
    """
    given = settings(parsed, ProcessOptions)
    factors = {
        "exaggeration": _factors("exaggeration", parsed.exaggeration, EXAGGERATION_PARTS[0]),
        "gains": _factors("gains", parsed.gains),
    }
    return ProcessOptions(**given | factors)


def _factors(option: str, text: str, otherwise: str = "") -> dict[str, float]:
    """Return the factors of a list such as 1.2,brows=1.5; a number alone is that of `otherwise`."""
    factors = {}
    for word in text.split(",") if text else ():
        part, _, number = word.rpartition("=")
        try:
            if not (part or otherwise):
                raise ValueError(word)
            factors[part or otherwise] = float(number)
        except ValueError as error:
            expected = "a number, or a region and a number: brows=1.5" if otherwise else "joy=0.5"
            raise InputError(f"--{option} {word}: expected {expected}", "SETTING_WRONG") from error
    return factors
