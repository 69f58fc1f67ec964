"""Finding the shots of a sequence: a show file, a folder, a list, or shots by name."""

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path

from usdface.errors import InputError
from usdface.show.plan import ShotPlan
from usdface.show.record import record_path
from usdface.show.show_file import read_show_file

__all__ = ["find_shots"]

_USD = (".usda", ".usdc", ".usd")
_LARGEST_LIST = 64_000_000  # bytes


def find_shots(
    sources: Iterable[Path], is_shot: Callable[[Path], bool], root: Path | None = None
) -> list[ShotPlan]:
    """Return the plans of all shots, in the order of the sources.

    Parameters
    ----------
    sources : iterable of Path
        Show files (.toml, .json), folders (searched with all below), lists (.txt, a shot a line),
        shots. Results beside their shots are left out.
    is_shot : callable
        Whether a USD file of a folder is a shot; called for files that have no result yet.
    root : Path, optional
        Folder that names in show files and lists are relative to, in place of theirs.

    Raises
    ------
    InputError
        If a source cannot be read, or there are no shots.
    """
    plans: list[ShotPlan] = []
    sources = list(sources)
    for source in sources:
        plans += _plans(source, is_shot, root)
    if not plans:
        raise InputError(
            f"no shots in {', '.join(map(str, sources))}; expected USD files that `usdface shot` "
            "wrote, or a show file that lists shots",
            "FILE_UNREADABLE",
        )
    return _uniquely_named(_without_results(plans))


def _without_results(plans: list[ShotPlan]) -> list[ShotPlan]:
    """Leave out results of shots that are in the list, too, as `shots/*.usda` of a shell has them.

    A result whose shot is not in it was meant.
    """
    shots = {plan.file.with_suffix("") for plan in plans}
    return [
        plan
        for plan in plans
        if plan.file.stem == (stem := plan.file.stem.removesuffix(".usdface"))
        or plan.file.with_name(stem) not in shots
    ]


def _plans(source: Path, is_shot: Callable[[Path], bool], root: Path | None) -> list[ShotPlan]:
    suffix = source.suffix.lower()
    if source.is_dir():
        files = [file for file in _candidates(source) if _seems_shot(file, is_shot)]
        names = [file.relative_to(source).with_suffix("").as_posix() for file in files]
    elif suffix in (".toml", ".json"):
        return read_show_file(source, root)
    elif suffix == ".txt":
        files = _listed(source, root or source.parent)
        names = [file.stem for file in files]
    elif suffix in _USD:
        files, names = [source], [source.stem]
    else:
        raise InputError(
            f"{source} is no shot, no folder, and no list of shots (.toml, .json, .txt)",
            "FILE_KIND_UNKNOWN",
        )
    return [ShotPlan(name=name, file=file) for name, file in zip(names, files, strict=True)]


def _candidates(folder: Path) -> list[Path]:
    """Return the USD files of a folder that are no results of `usdface process`."""
    found = []
    for file in sorted(folder.rglob("*")):
        places = (*file.relative_to(folder).parent.parts, file.stem)
        result = any(place.endswith(".usdface") or place.startswith(".") for place in places)
        if file.suffix.lower() in _USD and file.is_file() and not result:
            found.append(file)
    return found


def _seems_shot(file: Path, is_shot: Callable[[Path], bool]) -> bool:
    return record_path(file).is_file() or is_shot(file)


def _listed(path: Path, base: Path) -> list[Path]:
    try:
        if path.stat().st_size > _LARGEST_LIST:
            raise InputError(f"{path} is larger than any list of shots", "TOO_LARGE")
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"cannot read the list {path}: {error}", "FILE_UNREADABLE") from error
    return [base / line.strip() for line in lines if line.strip() and line.strip()[0] != "#"]


def _uniquely_named(plans: list[ShotPlan]) -> list[ShotPlan]:
    """Return the distinct plans; those with equal names are named by their whole path."""
    distinct = {(plan.name, plan.file.resolve(), repr(plan)): plan for plan in plans}
    counts = Counter(plan.name for plan in distinct.values())
    return [
        replace(plan, name=plan.file.with_suffix("").as_posix()) if counts[plan.name] > 1 else plan
        for plan in distinct.values()
    ]
