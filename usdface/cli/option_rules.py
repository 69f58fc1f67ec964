"""Rules between the options of a command: an option without effect is refused, not ignored."""

import argparse
from collections.abc import Collection, Mapping

from usdface.errors import InputError

__all__ = ["check_together"]


def check_together(
    parsed: argparse.Namespace,
    needs: Mapping[str, str],
    excludes: Mapping[str, Collection[str]],
) -> None:
    """Refuse options without the one that they belong to, or beside one that ignores them.

    Parameters
    ----------
    parsed : argparse.Namespace
        Options that are None, "" or False were not given.
    needs : mapping of str to str
        For an option, by its name in `parsed`, the words that must be given with it:
        ``{"chunk": "--openjd DIR"}``.
    excludes : mapping of str to collection of str
        For an option the names of those that it ignores.

    Raises
    ------
    InputError
    """
    given = {
        name: value
        for name, value in vars(parsed).items()
        if value is not None and value is not False and value != ""
    }
    for name, words in needs.items():
        other = words.split()[0][2:].replace("-", "_")
        if name in given and other not in given:
            raise InputError(f"{_option(name)} {given[name]} needs {words}", "SETTING_WRONG")
    for name, ignored in excludes.items():
        idle = sorted(given.keys() & set(ignored))
        if name in given and idle:
            names = ", ".join(map(_option, idle))
            raise InputError(f"{_option(name)} takes no {names}; leave it out", "SETTING_WRONG")


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"
