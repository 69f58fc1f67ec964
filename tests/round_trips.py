"""One file to the other format and back, and what was lost on the way."""

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pxr import Usd, UsdValidation
from usd_validators import all_validators

from usdface.errors import UsdFaceError
from usdface.io.check import check_file
from usdface.io.gltf.read import read_gltf
from usdface.io.usd.clips import animated_rig
from usdface.io.usd.rig import rig_of_stage
from usdface.io.usd.stage import open_stage
from usdface.pipeline import export_scene, import_scene

GLTF = (".glb", ".gltf")
USD = (".usd", ".usda", ".usdc")
FOLDERS = (
    "gltf_morph",
    "robotexpressive",
    "tinyusdz_blendshape",
    "mayausd_morpher",
    "openusd_usdskel",
)


@dataclass(frozen=True, slots=True)
class Leg:
    """One conversion: the certificate as a report has it, and the findings' codes."""

    certificate: dict[str, Any] | None
    codes: tuple[str, ...]
    judged: tuple[str, ...]  # errors of the Khronos validator, or of UsdValidation and our check

    @property
    def vertices(self) -> float:
        """Largest vertex error as a share of the bounding diagonal."""
        found = self.certificate
        assert found is not None
        return found["vertex_error_max_mm"] / max(found["bounding_diagonal_mm"], 1e-9)


@dataclass(frozen=True, slots=True)
class RoundTrip:
    """There and back, or why not."""

    refused: str  # code of the error
    why: str
    legs: tuple[Leg, ...]
    names: tuple[Any, ...]  # of meshes and their shapes: of the source, and of what came back


def sources(shared_data: Path) -> list[Path]:
    """Every glTF and USD file of the folders that are converted as a whole."""
    files = (path for folder in FOLDERS for path in (shared_data / folder).rglob("*"))
    return sorted(path for path in files if path.suffix in (*GLTF, *USD))


def round_trip(source: Path, folder: Path, khronos: Callable[[Path], dict[str, Any]]) -> RoundTrip:
    """Convert `source` to the other format and back, in `folder`.

    `khronos` gives the report of the Khronos validator on a file.
    """

    def to_usd(one: Path, other: Path) -> Leg:
        outcome = import_scene(one, other, every_frame=True)
        judged = [f.code for f in check_file(other) if f.severity == "error"]
        return _leg(outcome, [*judged, *usd_errors(other)])

    def to_gltf(one: Path, other: Path) -> Leg:
        outcome = export_scene(one, other, every_frame=True)
        issues = khronos(other)["issues"]["messages"]
        return _leg(outcome, [issue["code"] for issue in issues if issue["severity"] == 0])

    try:
        if source.suffix in GLTF:
            legs = (
                to_usd(source, folder / "one.usda"),
                to_gltf(folder / "one.usda", folder / "two.glb"),
            )
            names = (_names(read_gltf(source)[0]), _names(read_gltf(folder / "two.glb")[0]))
        else:
            legs = (
                to_gltf(source, folder / "one.glb"),
                to_usd(folder / "one.glb", folder / "two.usda"),
            )
            stages = (open_stage(source), open_stage(folder / "two.usda"))
            rigs = (animated_rig(stages[0])[0], rig_of_stage(stages[1])[0])  # with vertex caches
            names = tuple(map(_names, rigs))
    except UsdFaceError as error:
        shutil.rmtree(folder)
        folder.mkdir()
        return RoundTrip(error.code, str(error), (), ())
    return RoundTrip("", "", legs, names)


def usd_errors(path: Path) -> list[str]:
    """Return what UsdValidation calls an error in a file."""
    context = UsdValidation.ValidationContext(all_validators())
    kind = UsdValidation.ValidationErrorType.Error
    errors = context.Validate(Usd.Stage.Open(str(path)))
    return [f"{e.GetName()}: {e.GetMessage()}" for e in errors if e.GetType() == kind]


def _leg(outcome: Any, judged: list[str]) -> Leg:
    codes = tuple(dict.fromkeys(f.code for f in outcome.findings))
    return Leg(outcome.details.get("certificate"), codes, tuple(judged))


def _names(rig: Any) -> tuple[Any, ...]:
    return tuple((mesh.name, mesh.shape_names) for mesh in rig.meshes)
