"""The formats that scenes are exported to; loads no library, so that help texts can list them."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from usdface.findings import Finding, finding
from usdface.formats import ExportTarget
from usdface.io.atomic import atomic_path
from usdface.io.format_table import FormatTable, Registered
from usdface.lazy import lazy_function
from usdface.options import ExportOptions

if TYPE_CHECKING:
    from usdface.clips import Clip
    from usdface.rigs import Rig

__all__ = ["EXPORT_TARGETS", "GLTF", "pack_stage", "write_scene"]


def _write_gltf(
    rig: "Rig",
    clips: "Sequence[Clip]",
    path: Path,
    options: ExportOptions,
    read: Iterable[Path] = (),
    metadata: Mapping[str, str] = MappingProxyType({}),
) -> list[Finding]:
    from usdface.io.gltf.write import write_gltf

    return write_gltf(rig, path, clips, options, read, metadata)


GLTF = ExportTarget(
    name="glTF",
    suffixes=(".glb", ".gltf"),
    options=("pointer", "quantize", "influences"),
    write=_write_gltf,
)
EXPORT_TARGETS = FormatTable(
    ExportTarget,
    "usdface.exports",
    ("files", "written"),
    (
        GLTF,
        ExportTarget(
            name="USDZ",
            suffixes=(".usdz",),
            options=("clip", "asset_root"),
            pack=lazy_function("usdface.io.usd.usdz", "write_usdz"),
        ),
    ),
)


def write_scene(
    target: Registered[ExportTarget],
    rig: "Rig",
    clips: "Sequence[Clip]",
    path: Path,
    options: ExportOptions,
    read: Iterable[Path],
    metadata: Mapping[str, str],
) -> list[Finding]:
    """Write a rig and its clips by a target that has `write`.

    Files beside the output, which only glTF has, replace none of `read`; its asset gets `metadata`.

    Raises
    ------
    PluginError
        If the target of another package fails or writes nothing.
    OutputError
        If the file cannot be written.
    """
    write = target.format.write
    assert write is not None
    if target.format is GLTF:
        return _write_gltf(rig, clips, path, options, read, metadata)
    return _written(target, path, lambda place: target.call(write, rig, clips, place, options))


def pack_stage(
    target: Registered[ExportTarget], source: Path, path: Path, options: ExportOptions
) -> list[Finding]:
    """Pack a USD scene by a target that has `pack`; raises as `write_scene`."""
    pack = target.format.pack
    assert pack is not None
    return _written(target, path, lambda place: target.call(pack, source, place, options))


def _written(
    target: Registered[ExportTarget], path: Path, write: Callable[[Path], object]
) -> list[Finding]:
    """Write by usdface's own target, or by another package's to a temporary file."""
    if not target.origin:
        return target.findings(write(path))
    with atomic_path(path) as temporary:
        present = {temporary, *temporary.parent.iterdir()}
        findings = target.findings(write(temporary))
        if not temporary.is_file() or not temporary.stat().st_size:
            raise target.wrong(f"without having written {path.name}")
        if more := sorted(each.name for each in set(temporary.parent.iterdir()) - present):
            raise target.wrong(f"having written {', '.join(more)}; expected {path.name} alone")
    message = "{format} is not read back; compare it with its source by other means"
    return [*findings, finding("CONVERSION_UNCERTIFIED", path.name, message, target.format.name)]
