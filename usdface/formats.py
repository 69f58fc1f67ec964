"""File formats: how a reader of takes or rigs, or an export target, is described.

Each format is one object. Those of usdface itself are listed in `usdface.io.takes.formats`,
`usdface.io.rigs.formats` and `usdface.io.export_targets`; other packages add theirs by entry points
of the groups ``usdface.takes``, ``usdface.rigs`` and ``usdface.exports`` (docs/extending.md).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias

from usdface.errors import InputError
from usdface.options import ExportOptions, RigOptions, TakeOptions

if TYPE_CHECKING:  # numpy is not loaded for a table of formats
    from usdface.clips import Clip
    from usdface.findings import Finding
    from usdface.rigs import Rig
    from usdface.takes import MarkerTake, WeightsTake

__all__ = ["ExportTarget", "FileFormat", "RigReader", "TakeReader", "suffixes_of"]

Take: TypeAlias = "MarkerTake | WeightsTake"
ReadTake: TypeAlias = "Callable[[Path, TakeOptions], tuple[Take, Sequence[Finding]]]"
ReadRig: TypeAlias = "Callable[[Path, RigOptions], tuple[Rig, Sequence[Finding]]]"
WriteScene: TypeAlias = "Callable[[Rig, Sequence[Clip], Path, ExportOptions], Sequence[Finding]]"
PackStage: TypeAlias = "Callable[[Path, Path, ExportOptions], Sequence[Finding]]"


@dataclass(frozen=True, kw_only=True)
class FileFormat:
    """Name, suffixes and options of a format.

    Attributes
    ----------
    name : str
        For people: ``"C3D"``.
    suffixes : tuple of str
        Lower case, with the dot: ``(".c3d",)``.
    options : tuple of str
        Names of the options that it follows. Any other that is not at its default is refused
        before the file is touched.
    """

    name: str
    suffixes: tuple[str, ...] = ()
    options: tuple[str, ...] = ()
    options_type: ClassVar[Any] = None

    def __post_init__(self) -> None:
        where = f"{type(self).__name__} {self.name!r}"
        if not (isinstance(self.name, str) and self.name.strip()):
            raise InputError(f"{where}: expected a name", "SETTING_WRONG")
        self._check_kinds(where)
        for suffix in self.suffixes:
            text = suffix if isinstance(suffix, str) else ""
            if not text.startswith(".") or len(text) < 2 or text != text.lower():
                raise InputError(
                    f"{where}: suffix {suffix!r}; expected lower case with its dot, like '.xyz'",
                    "SETTING_WRONG",
                )
        known = [field.name for field in fields(self.options_type)]
        for option in self.options:
            if option not in known:
                raise InputError(
                    f"{where}: unknown option {option!r}; expected some of {', '.join(known)}",
                    "SETTING_WRONG",
                )

    def _check_kinds(self, where: str) -> None:
        for field in fields(self):
            given = getattr(self, field.name)
            if field.name in ("suffixes", "options") and isinstance(given, str):
                raise InputError(
                    f"{where}: {field.name} is {given!r}; expected a tuple, ({given!r},)",
                    "SETTING_WRONG",
                )
            function = field.name in ("read", "sniff", "write", "pack")
            if function and not callable(given) and (given is not None or field.name == "read"):
                raise InputError(
                    f"{where}: {field.name} is {given!r}; expected a function", "SETTING_WRONG"
                )

    def claims(self, path: Path) -> bool:
        """Return whether the name of a file has one of the suffixes."""
        return path.suffix.lower() in self.suffixes

    def recognises(self, path: Path) -> bool | None:
        """Return whether a file that it claims is of this format; None = only its name tells."""
        return None

    def follows(self, option: str) -> bool:
        """Return whether an option has an effect."""
        return option in self.options

    def check_options(self, path: Path, options: Any) -> None:
        """Refuse options that this format does not follow.

        Raises
        ------
        InputError
            If one of them is not at its default.
        """
        default = self.options_type()
        for field in fields(options):
            given = getattr(options, field.name)
            if given != getattr(default, field.name) and not self.follows(field.name):
                shown = str(given) if isinstance(given, Path) else repr(given)
                raise InputError(
                    f"{path}: {self.name} has no use for {field.name} = {shown}; leave it out",
                    "SETTING_WRONG",
                )


@dataclass(frozen=True, kw_only=True)
class Reader(FileFormat):
    """A format that is read.

    Attributes
    ----------
    sniff : callable, path -> bool, optional
        Whether a file with such a suffix, or a folder, is of this format. Where formats share a
        suffix, those that recognise the file come first, and the one without `sniff` last.
    folder : bool
        It reads folders; then it needs a `sniff`.
    """

    sniff: Callable[[Path], bool] | None = None
    folder: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        where = f"{type(self).__name__} {self.name!r}"
        if self.folder and self.sniff is None:
            raise InputError(f"{where}: a reader of folders needs a sniff", "SETTING_WRONG")
        if not (self.folder or self.suffixes):
            raise InputError(f"{where}: expected a suffix", "SETTING_WRONG")

    def claims(self, path: Path) -> bool:
        """Return whether it reads folders, of a folder; of a file, whether it has a suffix."""
        return self.folder if path.is_dir() else super().claims(path)

    def recognises(self, path: Path) -> bool | None:
        """Return the answer of `sniff`; None = only the name tells."""
        return None if self.sniff is None else bool(self.sniff(path))


@dataclass(frozen=True, kw_only=True)
class TakeReader(Reader):
    """A format of takes.

    Attributes
    ----------
    name : str
        For people: ``"XYZ"``.
    suffixes : tuple of str
        Lower case, with the dot.
    options : tuple of str
        Names of the options that it follows; any other is refused.
    sniff : callable, path -> bool, optional
        Whether a file with such a suffix, or a folder, is of this format.
    folder : bool
        It reads folders; then it needs a `sniff`.
    read : callable
        (path, `TakeOptions`) -> (`MarkerTake` or `WeightsTake`, findings).

    Raises
    ------
    InputError
        If a suffix or an option is not valid.

    Examples
    --------
    >>> XYZ = usdface.TakeReader(name="XYZ", suffixes=(".xyz",), read=lambda path, options: ...)
    """

    read: ReadTake
    options_type: ClassVar[Any] = TakeOptions

    def follows(self, option: str) -> bool:
        """Return whether an option has an effect: a start timecode has one for every format."""
        return option == "start_timecode" or super().follows(option)


@dataclass(frozen=True, kw_only=True)
class RigReader(Reader):
    """A format of characters.

    Attributes
    ----------
    name : str
        For people: ``"XYZ"``.
    suffixes : tuple of str
        Lower case, with the dot.
    options : tuple of str
        Names of the options that it follows; any other is refused.
    sniff : callable, path -> bool, optional
        Whether a file with such a suffix, or a folder, is of this format.
    folder : bool
        It reads folders; then it needs a `sniff`.
    read : callable
        (path, `RigOptions`) -> (`Rig`, findings).

    Raises
    ------
    InputError
        If a suffix or an option is not valid.

    Examples
    --------
    >>> HEAD = usdface.RigReader(name="Head", suffixes=(".head",), read=lambda path, options: ...)
    """

    read: ReadRig
    options_type: ClassVar[Any] = RigOptions


@dataclass(frozen=True, kw_only=True)
class ExportTarget(FileFormat):
    """A format that scenes are exported to, by one of two functions.

    Attributes
    ----------
    name : str
        For people: ``"XYZ"``.
    suffixes : tuple of str
        Lower case, with the dot.
    options : tuple of str
        Names of the options that it follows; any other is refused.
    write : callable, optional
        (`Rig`, clips, path, `ExportOptions`) -> findings. The options `clip` and `asset_root`
        are followed before, as the scene is read.
    pack : callable, optional
        (path of the USD scene, path, `ExportOptions`) -> findings: packs the scene as it is.

    Raises
    ------
    InputError
        If a suffix or an option is not valid.

    Examples
    --------
    >>> FACE = usdface.ExportTarget(
    ...     name="Face", suffixes=(".face",), write=lambda rig, clips, path, options: []
    ... )
    """

    write: "WriteScene | None" = None
    pack: "PackStage | None" = None
    options_type: ClassVar[Any] = ExportOptions

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.write is None) == (self.pack is None) or not self.suffixes:
            raise InputError(
                f"ExportTarget {self.name!r}: expected a suffix, and either write or pack",
                "SETTING_WRONG",
            )

    def follows(self, option: str) -> bool:
        """Return whether an option has an effect, on the format or while the scene is read."""
        reading = ("clip", "asset_root", "purpose") if self.write is not None else ()
        return option in (*self.options, *reading)


def suffixes_of(formats: Sequence[FileFormat]) -> tuple[str, ...]:
    """Return the suffixes of several formats, each once, in their order."""
    return tuple(dict.fromkeys(suffix for each in formats for suffix in each.suffixes))
