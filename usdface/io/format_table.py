"""Finding the format of a file: usdface's own formats first, then those of other packages.

Entry points are looked up only where no format of usdface itself fits, or to list them. A format of
another package never replaces one of usdface: a suffix that both claim stays usdface's, reported as
PLUGIN_CONFLICT. Nothing is skipped silently: an entry point that cannot be used is a PLUGIN_FAILED
finding if another one reads the file, else an error.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby
from pathlib import Path
from typing import Any, Generic, TypeVar

from usdface.errors import InputError, PluginError, UsdFaceError
from usdface.findings import Finding, finding
from usdface.findings.codes import CODES
from usdface.findings.values import Prose
from usdface.formats import FileFormat, suffixes_of
from usdface.plain_text import listed

__all__ = ["FormatTable", "Registered", "conflicts"]

F = TypeVar("F", bound=FileFormat)
_ERRORS = UsdFaceError.__module__
_MISTAKES = (Exception, SystemExit)  # of code that is not ours
_SHOWN = 4  # formats that an error names; a line of all that takes may have is not read
_SHOWN_FILES = 3


@dataclass(frozen=True, slots=True)
class Registered(Generic[F]):
    """A format and where it comes from.

    Attributes
    ----------
    format : FileFormat
    origin : str
        Distribution, version and entry point: ``"acme-xyz 1.0 (acme_xyz:XYZ)"``; "" = usdface.
    """

    format: F
    origin: str = ""

    @property
    def label(self) -> str:
        """The format for messages."""
        return f"{self.format.name} of {self.origin or 'usdface'}"

    def call(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """Return ``function(*arguments)``; errors of another package name it and the function.

        Raises
        ------
        UsdFaceError
            That of the function; `PluginError` where it raises anything else.
        """
        if not self.origin:
            return function(*arguments)
        name = f"{function.__module__}.{getattr(function, '__qualname__', function)}"
        try:
            return function(*arguments)
        except UsdFaceError as error:
            message = f"{_one_line(error)} ({name} of {self.origin})"
            kind = type(error) if type(error).__module__ == _ERRORS else PluginError
            raise kind(message, error.code) from error
        except _MISTAKES as error:
            raise PluginError(
                f"{self.origin}: {name} failed: {_named(error)}; report it to its authors"
            ) from error

    def wrong(self, fault: str) -> PluginError:
        """Return the error for a wrong return value of another package's format."""
        return PluginError(f"{self.label} returned {fault}; report it to its authors")

    def findings(self, given: object) -> list[Finding]:
        """Return the findings that a function of this format gave, checked.

        Raises
        ------
        PluginError
            If they are no findings with codes of usdface.
        """
        if not isinstance(given, list | tuple):
            raise self.wrong(f"{type(given).__name__}; expected a list of findings")
        for each in given:
            if not (isinstance(each, Finding) and each.code in CODES):
                code = getattr(each, "code", each)
                raise self.wrong(f"the finding {code!r}; expected usdface.finding(code, ...)")
        return list(given)


@dataclass(frozen=True, slots=True)
class FormatTable(Generic[F]):
    """The formats of one kind.

    Attributes
    ----------
    kind : type
        Of the formats.
    group : str
        Entry points that add formats.
    purpose : (str, str)
        For messages: "take files", "read".
    built_in : tuple of FileFormat
        Of usdface itself; at most one fits any file.
    remedies : mapping of str to str
        Remedies for files that are none of these, by their suffix, for messages.
    """

    kind: type[F]
    group: str
    purpose: tuple[str, str]
    built_in: tuple[F, ...]
    remedies: Mapping[str, str] = field(default_factory=dict)

    @property
    def summary(self) -> str:
        """The formats of usdface itself with their suffixes, for help texts."""
        return ", ".join(self._families())

    def _families(self) -> list[str]:
        """Return the names of formats with the same suffixes, and these."""
        families = (
            (suffixes, ", ".join(each.name for each in alike))
            for suffixes, alike in groupby(self.built_in, lambda each: each.suffixes)
        )
        return [f"{names} ({' '.join(s)})" if s else names for s, names in families]

    def find(self, path: Path) -> tuple[Registered[F], list[Finding]]:
        """Return the format of a file or folder, and findings on other packages' formats.

        Raises
        ------
        PluginError
            If formats of several packages fit, or none fits and one cannot be loaded.
        InputError
            If none fits.
        """
        own = _fitting([Registered(each) for each in self.built_in], path)
        if own:
            return own[0], []
        others, findings = self.of_other_packages()
        fitting = _fitting(others, path)
        if len(fitting) > 1:
            claims = " and ".join(each.label for each in fitting)
            raise PluginError(f"{path}: {claims} both fit; uninstall one", "PLUGIN_CONFLICT")
        if fitting:
            return fitting[0], findings
        noun, verb = self.purpose
        if path.is_dir():
            folders = [each.name for each in self.built_in if getattr(each, "folder", False)]
            kind, expected = "folders like this", ", ".join(folders) or "a file"
            files = _files(path)
            if files is not None and all(each.name.startswith(".") for each in files):
                kind = "empty folders"
        else:
            families = self._families()
            kind, expected = f"{noun} of kind {path.suffix!r}", listed(families, _SHOWN)
            if len(families) > _SHOWN:
                expected += " (`usdface formats` lists them)"
        message = f"{path}: {kind} are not {verb}; expected {expected}"
        if remedy := self._remedy(path):
            message += f"; {remedy}"
        failed = [f"{f.where} {f.message}" for f in findings if f.code == "PLUGIN_FAILED"]
        if failed:
            raise PluginError(f"{message}; {'; '.join(failed)}")
        raise InputError(message, "FILE_KIND_UNKNOWN")

    def _remedy(self, path: Path) -> str:
        """Return the remedy for a file or folder that no format fits; "" if none is known."""
        if not path.is_dir():
            return self.remedies.get(path.suffix.lower(), "")
        suffixes = suffixes_of(self.built_in)
        files = _files(path) or []
        names = sorted(each.name for each in files if each.suffix.lower() in suffixes)
        return f"name a file in it: {listed(names, _SHOWN_FILES)}" if names else ""

    def of_other_packages(self) -> tuple[list[Registered[F]], list[Finding]]:
        """Return the formats that other packages add, without suffixes that usdface has itself."""
        from importlib.metadata import entry_points  # costs more than all the tables

        reserved = suffixes_of(self.built_in)
        found: list[Registered[F]] = []
        findings: list[Finding] = []
        for entry in sorted(entry_points(group=self.group), key=lambda e: (e.value, e.name)):
            source = f"{entry.dist.name} {entry.dist.version}" if entry.dist else "unknown package"
            origin = f"{source} ({entry.value})"
            try:
                given = entry.load()
            except _MISTAKES as error:
                message = "cannot be loaded: {error}"
                findings.append(finding("PLUGIN_FAILED", origin, message, Prose(_named(error))))
                continue
            if not isinstance(given, self.kind):
                message = "is {found}; expected a usdface.{expected}"
                kinds = type(given).__name__, self.kind.__name__
                findings.append(finding("PLUGIN_FAILED", origin, message, *kinds))
                continue
            taken = [suffix for suffix in given.suffixes if suffix in reserved]
            for suffix in taken:
                owner = next(each.name for each in self.built_in if suffix in each.suffixes)
                message = "{format} claims {suffix}, which stays with {owner} of usdface"
                findings.append(
                    finding("PLUGIN_CONFLICT", origin, message, given.name, suffix, owner)
                )
            left = tuple(suffix for suffix in given.suffixes if suffix not in taken)
            if left or getattr(given, "folder", False):
                found.append(Registered(replace(given, suffixes=left), origin))
        return found, findings


def _files(folder: Path) -> list[Path] | None:
    """Return the contents of a folder; None if it cannot be looked into."""
    try:
        return list(folder.iterdir())
    except OSError:
        return None


def _fitting(formats: Iterable[Registered[F]], path: Path) -> list[Registered[F]]:
    """Return the formats that recognise a file; if none does, those that go by its name alone."""
    claiming = [each for each in formats if each.format.claims(path)]
    results = [each.call(each.format.recognises, path) for each in claiming]
    certain = [each for each, result in zip(claiming, results, strict=True) if result]
    return certain or [e for e, result in zip(claiming, results, strict=True) if result is None]


def conflicts(formats: Sequence[Registered[F]]) -> list[Finding]:
    """Return the suffixes that several packages claim, none of them by the file's content."""
    found = []
    for suffix in suffixes_of([each.format for each in formats]):
        claims = [e for e in formats if suffix in e.format.suffixes and not _sniffs(e.format)]
        if len(claims) > 1:
            message = "{suffix} is claimed by {claimed_by}"
            found.append(
                finding("PLUGIN_CONFLICT", suffix, message, suffix, [each.label for each in claims])
            )
    return found


def _sniffs(given: FileFormat) -> bool:
    return getattr(given, "sniff", None) is not None


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split())


def _named(error: BaseException) -> str:
    return f"{type(error).__name__}: {_one_line(error)}".rstrip(": ")
