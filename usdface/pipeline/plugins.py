"""Installed plug-ins of other packages, and whether each would load: `usdface plugins`."""

from typing import Any

from usdface.errors import PluginError
from usdface.findings import finding
from usdface.io.plugins import HOOKS, hook_of, host_plugins, plugins_of
from usdface.pipeline.formats import list_formats
from usdface.result import Result

__all__ = ["list_plugins"]

_FORMATS = {"takes": "take format", "rigs": "rig format", "exports": "export format"}


def list_plugins() -> Result[None]:
    """List hooks, formats and plug-ins for hosts of other packages, and whether each would load.

    Each is imported. For a plug-in of a host the result holds for this Python only: run it with the
    host's own Python.

    Returns
    -------
    Result of None
        `details` has ``plugins``, a list of mappings with ``kind`` ("hook", "take format", "rig
        format", "export format", "host"), ``name``, ``host`` (the program that it is for; ""
        = any), ``origin``, ``loads`` and ``why_not``. Hooks are in the order in which they run.
        Findings are PLUGIN_FAILED and PLUGIN_CONFLICT.

    Examples
    --------
    >>> usdface.list_plugins().details["plugins"]
    []
    """
    listed: list[dict[str, Any]] = []
    findings = []
    for plugin in plugins_of(HOOKS):
        why = ""
        try:
            hook_of(plugin)
        except PluginError as error:
            why = str(error)
        listed.append(_row("hook", plugin.name, plugin.origin, why))
    formats = list_formats()
    for kind, rows in formats.details.items():
        for each in rows:
            if each["origin"] != "usdface":
                listed.append(_row(_FORMATS[kind], each["name"], each["origin"], ""))
    for problem in formats.findings:
        if problem.code == "PLUGIN_FAILED":
            listed.append(_row("format", problem.where, problem.where, problem.message))
    for plugin, problems in host_plugins():
        why = "; ".join(problems())
        listed.append(_row("host", plugin.name, plugin.origin, why, plugin.entry.name))
    findings = [each for each in formats.findings if each.code == "PLUGIN_CONFLICT"]
    findings += [
        finding("PLUGIN_FAILED", each["name"], each["why_not"])
        for each in listed
        if not each["loads"]
    ]
    loading = sum(each["loads"] for each in listed)
    summary = {"plugins": len(listed), "would_load": loading}
    return Result(None, (), tuple(findings), summary, {"plugins": listed})


def _row(kind: str, name: str, origin: str, why_not: str, host: str = "") -> dict[str, Any]:
    return {
        "kind": kind,
        "name": name,
        "host": host,
        "origin": origin,
        "loads": not why_not,
        "why_not": why_not,
    }
