"""Plug-ins of other packages by entry points: those installed, those that load.

Entry points are looked up only by jobs that call hooks, and to list them.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from usdface.arguments import checked
from usdface.errors import InputError, PluginError, did_you_mean
from usdface.findings import Finding, finding
from usdface.hooks import Hook
from usdface.plain_text import error_line

__all__ = [
    "HOOKS",
    "HOSTS",
    "Plugin",
    "check_skipped",
    "hook_report",
    "host_plugins",
    "installed_hooks",
    "plugins_of",
]

HOOKS, HOSTS = "usdface.hooks", "usdface.hosts"
_MISTAKES = (Exception, SystemExit)  # of code that is not ours


@dataclass(frozen=True, slots=True)
class Plugin:
    """An entry point of another package.

    Attributes
    ----------
    group : str
        ``"usdface.hooks"``, ``"usdface.hosts"``, ``"usdface.takes"``, ...
    name : str
        Distribution and entry point: ``"acme-jaw:weights_solved"``.
    origin : str
        ``"acme-jaw 1.0 (acme_jaw:softer)"``.
    entry : EntryPoint
    """

    group: str
    name: str
    origin: str
    entry: EntryPoint

    @property
    def distribution(self) -> str:
        """The name of the distribution."""
        return self.name.partition(":")[0]

    def load(self) -> Any:
        """Return the object that it names.

        Raises
        ------
        PluginError
            If it cannot be imported; the message names the distribution and why.
        """
        try:
            return self.entry.load()
        except _MISTAKES as error:
            why = error_line(error)
            raise PluginError(f"{self.origin} cannot be loaded: {why}") from error


def plugins_of(group: str) -> list[Plugin]:
    """Return the entry points of a group, sorted by entry point, then by distribution."""
    found = []
    for entry in entry_points(group=group):
        distribution = entry.dist.name if entry.dist else "unknown package"
        version = f" {entry.dist.version}" if entry.dist else ""
        origin = f"{distribution}{version} ({entry.value})"
        found.append(Plugin(group, f"{distribution}:{entry.name}", origin, entry))
    return sorted(found, key=lambda plugin: (plugin.entry.name, plugin.name, plugin.entry.value))


@checked
def installed_hooks(skip: Sequence[str] = ()) -> tuple[tuple[Hook, ...], list[Finding]]:
    """Return the hooks of other packages, in the order in which they run.

    Parameters
    ----------
    skip : sequence of str
        Distributions, or single hooks ("distribution:entry point"), that are left out and not
        imported.

    Returns
    -------
    tuple of Hook
    list of Finding
        HOOK_SKIPPED for each that is left out.

    Raises
    ------
    InputError
        If a hook that is to be left out is not installed.
    PluginError
        If a hook cannot be loaded: a result without it would differ from the installation's.

    Examples
    --------
    >>> usdface.installed_hooks()
    ((), [])
    """
    check_skipped(skip)
    hooks, found = [], []
    for plugin in plugins_of(HOOKS):
        if plugin.name in skip or plugin.distribution in skip:
            message = "{origin} is left out, as requested"
            found.append(finding("HOOK_SKIPPED", plugin.name, message, plugin.origin))
            continue
        hooks.append(hook_of(plugin))
    return tuple(hooks), found


def check_skipped(names: Iterable[str]) -> None:
    """Refuse names of hooks that are not installed.

    Raises
    ------
    InputError
        If a name is neither a distribution with hooks nor a single hook.
    """
    known = {name for each in plugins_of(HOOKS) for name in (each.name, each.distribution)}
    for name in sorted(set(names) - known):
        there = ", ".join(sorted(known)) or "none"
        raise InputError(
            f"--skip-hook {name}: there is no such hook; installed: {there}"
            f"{did_you_mean(name, known)}",
            "SETTING_WRONG",
        )


def hook_report(hooks: Sequence[Hook]) -> dict[str, Any]:
    """Return the hooks of a job for the details of its result; {} without any."""
    return {"hooks": [{"name": h.name, "origin": h.origin} for h in hooks]} if hooks else {}


def hook_of(plugin: Plugin) -> Hook:
    """Return the hook that a plug-in of the group `HOOKS` names.

    The entry point's name is the hook's point, with anything after a dot: ``take_read.10_gaps``.

    Raises
    ------
    PluginError
        If it cannot be loaded, is not callable, or there is no such point.
    """
    try:
        function = plugin.load()
        if not callable(function):
            raise PluginError(f"{plugin.origin} is {type(function).__name__}; expected a function")
        point: Any = plugin.entry.name.partition(".")[0]
        return Hook(point, plugin.name, function, plugin.origin)
    except (PluginError, InputError) as error:
        raise PluginError(
            f"{error}; --skip-hook {plugin.name} leaves it out", "HOOK_FAILED"
        ) from error


def host_plugins() -> Iterator[tuple[Plugin, Callable[[], Sequence[str]]]]:
    """Yield the plug-ins for programs, each with a function that returns why it would not load.

    The function imports the plug-in's check: an error of that is its one reason.
    """
    for plugin in plugins_of(HOSTS):

        def problems(plugin: Plugin = plugin) -> Sequence[str]:
            try:
                return [str(each) for each in plugin.load()()]
            except PluginError as error:
                return [str(error)]
            except _MISTAKES as error:
                return [error_line(error)]

        yield plugin, problems
