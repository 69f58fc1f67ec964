"""A take from animated empties, read from a stage that Blender exported."""

import csv
from pathlib import Path

import bpy
import numpy as np
from pxr import Usd, UsdGeom

from .character import export_objects, usd_name
from .messages import FaceError
from .places import MARKER, empties_of, marker_name

_OBJECT = "userProperties:blender:object_name"
_LEAST = 2  # frames


def performer_empties(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Return the empties of the take.

    Raises
    ------
    FaceError
        If there are none.
    """
    empties = empties_of(scene.usdface.take_markers)
    if not empties:
        raise FaceError("choose the collection of the performer's marker empties, or a take file")
    return empties


class StageTake:
    """Marker positions of a stage: metres, Y up.

    Attributes
    ----------
    names : list of str
    codes : list of float
    positions : list of list of (x, y, z)
        For each code, for each marker.
    rate : float [Hz]
    """

    def __init__(self, stage: Usd.Stage, empties: list[bpy.types.Object]) -> None:
        prims = _prims_of(stage, empties)
        missing = [o.name for o in empties if o.name not in prims]
        if missing:
            raise FaceError(
                f"marker empties are not in the export: {', '.join(missing[:5])}; "
                "show them and their collections, and export the whole scene, empties too"
            )
        self.names = [marker_name(o) for o in empties]
        if len(set(self.names)) < len(self.names):
            raise FaceError("two empties of the take have the same marker name")
        first, last = stage.GetStartTimeCode(), stage.GetEndTimeCode()
        sampled = {
            code
            for prim in prims.values()
            for each in _with_parents(prim)
            for code in UsdGeom.Xformable(each).GetTimeSamples()
        }
        within = sorted(
            c for c in sampled if not stage.HasAuthoredTimeCodeRange() or first <= c <= last
        )
        if len(within) < _LEAST:
            raise FaceError(
                "the marker empties have no animation in the frames of the scene; "
                "import a take first, or export with Animation switched on"
            )
        # Blender exports no sample that is as the one before: frames in which all markers rest
        self.codes = np.arange(within[0], within[-1] + 1.0).tolist()
        self.rate = float(stage.GetTimeCodesPerSecond())
        unit, upright = UsdGeom.GetStageMetersPerUnit(stage), UsdGeom.GetStageUpAxis(stage)
        self.positions = []
        for code in self.codes:
            cache = UsdGeom.XformCache(code)
            places = [
                cache.GetLocalToWorldTransform(prims[o.name]).ExtractTranslation() * unit
                for o in empties
            ]
            self.positions.append([_y_up(p, upright) for p in places])

    @property
    def times(self) -> list[float]:
        """Times of the frames [s], from 0."""
        return [(code - self.codes[0]) / self.rate for code in self.codes]

    def write_csv(self, path: Path) -> None:
        """Write the take as a table that `usdface take` reads."""
        with path.open("w", newline="", encoding="utf-8") as file:
            table = csv.writer(file)
            table.writerow(["time", *(f"{name}_{axis}" for name in self.names for axis in "xyz")])
            for time, places in zip(self.times, self.positions, strict=True):
                table.writerow([repr(time), *(repr(float(v)) for p in places for v in p)])


def _prims_of(stage: Usd.Stage, empties: list[bpy.types.Object]) -> dict[str, Usd.Prim]:
    """Return the prim of each empty, by the object's name."""
    by_property, by_name = {}, {}
    for prim in stage.Traverse():
        if prim.IsA(UsdGeom.Xformable):
            attribute = prim.GetAttribute(_OBJECT)
            if attribute and attribute.HasAuthoredValue():
                by_property.setdefault(attribute.Get(), prim)
            by_name.setdefault(prim.GetName(), prim)
    found = {o.name: by_property.get(o.name) or by_name.get(usd_name(o.name)) for o in empties}
    return {name: prim for name, prim in found.items() if prim}


def _with_parents(prim: Usd.Prim) -> list[Usd.Prim]:
    chain = []
    while prim and not prim.IsPseudoRoot():
        chain.append(prim)
        prim = prim.GetParent()
    return chain


def _y_up(place, up_axis: str) -> tuple[float, float, float]:
    x, y, z = place
    return (x, z, -y) if up_axis == UsdGeom.Tokens.z else (x, y, z)


def write_take_of_empties(scene: bpy.types.Scene, folder: Path) -> tuple[Path, float]:
    """Export the performer's empties and write their take; return the table and its rate.

    The take begins where the frames of the scene do.
    """
    empties, path = performer_empties(scene), folder / "markers.usdc"
    export_objects(empties, path, {"export_animation": True, "export_materials": False})
    take = StageTake(Usd.Stage.Open(str(path)), empties)
    take.write_csv(folder / "markers.csv")
    scene.usdface.first_frame = round(take.codes[0])
    return folder / "markers.csv", take.rate


__all__ = ["MARKER", "StageTake", "performer_empties", "write_take_of_empties"]
