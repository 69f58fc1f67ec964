"""Options of a run: steps that are left out or done otherwise, factors on the performance."""

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
        If a factor is no number, is of nothing, or is given twice.
    """
    given = settings(parsed, ProcessOptions)
    factors = {
        "exaggeration": _factors("exaggeration", parsed.exaggeration, EXAGGERATION_PARTS[0]),
        "gains": _factors("gains", parsed.gains),
    }
    return ProcessOptions(**given | factors)


def _factors(option: str, text: str, otherwise: str = "") -> dict[str, float]:
    """Return the factors of a list such as 1.2,brows=1.5; a number alone is that of `otherwise`.

    It stands first: one behind others is a part of a decimal with a comma.
    """
    factors: dict[str, float] = {}
    for word in text.split(",") if text else ():
        part, _, number = word.rpartition("=")
        name = part.strip() or otherwise
        try:
            if not name:
                raise ValueError(word)
            factor = float(number)
        except ValueError as error:
            expected = "a number, or a region and a number: brows=1.5" if otherwise else "joy=0.5"
            raise InputError(f"--{option} {word}: expected {expected}", "SETTING_WRONG") from error
        if factors and not part:
            expected = f"the factor of the {otherwise} before others, and decimals with a point"
            raise InputError(f"--{option} {text}: expected {expected}", "SETTING_WRONG")
        if name in factors:
            message = f"--{option} {text}: {name} occurs twice; expected one factor for each"
            raise InputError(message, "SETTING_WRONG")
        factors[name] = factor
    return factors
