"""Points that change over time become blend shapes, within a stated distance."""

from pathlib import Path

import numpy as np
import pytest
from pxr import Usd, UsdGeom, Vt

import usdface
from usdface.io.usd import vertex_cache
from usdface.io.usd.rig_write import write_rig
from usdface.rigs import BlendShape, Mesh, Rig

FRAMES = 40


def cached(folder: Path, moves: np.ndarray) -> Path:
    """A patch of 5 x 5 points with a blend shape, moved by (F, 25, 3) [m], on a stage in cm."""
    row, column = np.divmod(np.arange(25), 5)
    points = 0.02 * np.stack([column, row, np.zeros(25)], 1)
    first = np.flatnonzero((row < 4) & (column < 4))
    faces = np.stack([first, first + 1, first + 6, first + 5], 1)
    shape = BlendShape("up", [12], [[0, 0, 0.01]])
    mesh = Mesh("patch", points, np.full(len(faces), 4), faces.ravel(), shapes=(shape,))
    write_rig(Rig("patch", (mesh,)), folder / "patch.usda")
    stage = Usd.Stage.Open(str(folder / "patch.usda"))
    (prim,) = (prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh))
    attribute = UsdGeom.Mesh(prim).GetPointsAttr()
    for code, frame in enumerate(moves):
        attribute.Set(Vt.Vec3fArray.FromNumpy((points + frame).astype(np.float32)), code)
    stage.Save()
    return folder / "patch.usda"


def modes(count: int) -> np.ndarray:
    rng = np.random.default_rng(3)
    return np.tensordot(rng.normal(size=(FRAMES, count)), rng.normal(size=(count, 25, 3)), 1) / 500


def test_a_sum_of_two_movements_is_two_shapes(tmp_path: Path) -> None:
    source = cached(tmp_path, modes(2) - modes(2)[:1])
    done = usdface.export_scene(source, tmp_path / "a.glb", every_frame=True)
    assert "POINTS_TO_SHAPES" in {f.code for f in done.findings}
    assert {f.severity for f in done.findings} == {"info"}
    assert done.summary["morph_targets"] == 1 + 2
    assert done.value is not None and done.value.missing == ()
    assert done.summary["frames"] == FRAMES and done.summary["vertex_error_max_mm"] < 1e-3
    again = usdface.import_scene(tmp_path / "a.glb", tmp_path / "b.usda", every_frame=True)
    assert again.summary["vertex_error_max_mm"] < 1e-3


def test_how_far_off_too_few_shapes_are_is_stated(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(vertex_cache, "_MOST_SHAPES", 3)
    source = cached(tmp_path, modes(8))
    done = usdface.export_scene(source, tmp_path / "a.glb", every_frame=True)
    (found,) = (f for f in done.findings if f.code == "FEATURE_APPROXIMATED")
    stated = float(found.message.rpartition(" within ")[2].removesuffix(" mm"))
    assert done.summary["vertex_error_max_mm"] == pytest.approx(stated, rel=0.05)


def test_points_that_come_and_go_stay_as_at_the_first(tmp_path: Path) -> None:
    source = cached(tmp_path, modes(2))
    stage = Usd.Stage.Open(str(source))
    (prim,) = (prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh))
    UsdGeom.Mesh(prim).GetPointsAttr().Set(Vt.Vec3fArray(26), 7)
    stage.Save()
    done = usdface.export_scene(source, tmp_path / "a.glb")
    assert "ANIMATION_DROPPED" in {f.code for f in done.findings}
    assert done.summary["morph_targets"] == 1


def test_a_rig_has_no_shapes_of_a_cache(tmp_path: Path) -> None:
    rig, found = usdface.read_rig(cached(tmp_path, modes(2)))
    assert rig.shape_names == ("up",)
    assert "ANIMATION_DROPPED" in {f.code for f in found}
