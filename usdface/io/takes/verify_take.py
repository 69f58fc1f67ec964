"""Takes that the readers of other packages return, held to the rules of usdface's own readers."""

from pathlib import Path

from usdface.errors import errors_at
from usdface.findings import Finding
from usdface.formats import TakeReader
from usdface.io.format_table import Registered
from usdface.io.takes.raw_take import check_size, find_occlusion
from usdface.takes import MarkerTake, WeightsTake, check_range

__all__ = ["verified_take"]


def verified_take(
    reader: Registered[TakeReader], path: Path, result: object
) -> tuple[MarkerTake | WeightsTake, list[Finding]]:
    """Return a reader's take and findings, checked.

    The types check their fields when they are made; this function checks ranges, and the size
    against that of the file; occlusion is announced as by the readers of usdface where this reader
    did not.

    Raises
    ------
    PluginError
        If `result` is no take with its findings.
    InputError
        If no marker is ever visible, values are beyond any meaning, or the take is out of all
        proportion to its file.
    """
    if not (isinstance(result, tuple) and len(result) == 2):
        raise reader.wrong(f"{type(result).__name__}; expected (take, findings)")
    take, findings = result[0], reader.findings(result[1])
    if not isinstance(take, MarkerTake | WeightsTake):
        raise reader.wrong(f"{type(take).__name__}; expected a MarkerTake or a WeightsTake")
    if not all(name.strip() for name in take.names):
        raise reader.wrong("an empty name; expected a name for each column")
    with errors_at(path):
        check_range(take)
    if isinstance(take, WeightsTake):
        return take, findings
    if path.is_file():
        check_size(path, len(take.times), len(take.names))
    seen, occlusion = find_occlusion(path, take.names, ~take.visible)
    if not seen.all():
        take = take.with_markers(seen)
    reported = {(each.code, each.where) for each in findings}
    return take, findings + [each for each in occlusion if (each.code, each.where) not in reported]
