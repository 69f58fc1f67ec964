"""The file formats that usdface and other packages read and write: `usdface formats`."""

from usdface.io.export_targets import EXPORT_TARGETS
from usdface.io.format_table import FormatTable, Registered, conflicts
from usdface.io.rigs.formats import RIG_READERS
from usdface.io.takes.formats import TAKE_READERS
from usdface.result import Result

__all__ = ["list_formats"]

_TABLES: dict[str, FormatTable] = {  # type: ignore[type-arg]
    "takes": TAKE_READERS,
    "rigs": RIG_READERS,
    "exports": EXPORT_TARGETS,
}


def list_formats() -> Result[None]:
    """List every reader of takes and rigs and every export target, and where each comes from.

    Returns
    -------
    Result of None
        `details` has ``takes``, ``rigs`` and ``exports``, each a list of mappings with ``name``,
        ``suffixes`` and ``origin`` ("usdface", or distribution and entry point). Findings are
        PLUGIN_FAILED and PLUGIN_CONFLICT.

    Examples
    --------
    >>> [each["name"] for each in usdface.list_formats().details["exports"]]
    ['glTF', 'USDZ']
    """
    details = {}
    findings = []
    for kind, table in _TABLES.items():
        others, problems = table.of_other_packages()
        own = [Registered(each) for each in table.built_in]
        details[kind] = [
            {
                "name": each.format.name,
                "suffixes": list(each.format.suffixes),
                "origin": each.origin or "usdface",
            }
            for each in [*own, *others]
        ]
        findings += problems + conflicts(others)
    summary = {kind: len(listed) for kind, listed in details.items()}
    return Result(None, (), tuple(findings), summary, details)
