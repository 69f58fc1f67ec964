"""A written take is what a viewer expects, and always the same bytes."""

from pathlib import Path

import numpy as np
from marker_takes import marker_take
from pxr import Usd, UsdGeom

from usdface.io.usd.metrics import metrics_of
from usdface.io.usd.take_write import write_take


def test_an_occluded_marker_keeps_its_last_place_in_a_viewer(tmp_path: Path) -> None:
    take = marker_take()
    write_take(take, tmp_path / "take.usda")
    stage = Usd.Stage.Open(str(tmp_path / "take.usda"))
    prim = stage.GetPrimAtPath("/Take")
    drawn = np.array([prim.GetAttribute("points").Get(code) for code in range(12)])
    np.testing.assert_allclose(drawn[3:6, 1], drawn[[2, 2, 2], 1])
    np.testing.assert_allclose(drawn[0, 1], take.positions[1, 1], atol=1e-7)


def test_a_viewer_without_usdface_sees_points_in_their_units(tmp_path: Path) -> None:
    take = marker_take(meters_per_unit=0.001)
    write_take(take, tmp_path / "take.usda")
    stage = Usd.Stage.Open(str(tmp_path / "take.usda"))
    metrics = metrics_of(stage)
    assert (metrics.time_codes_per_second, metrics.frames_per_second) == (60, 60)
    assert (metrics.start, metrics.end, metrics.meters_per_unit) == (0, 11, 0.001)
    points = UsdGeom.Points(stage.GetPrimAtPath("/Take"))
    assert points, "the fallback makes it a UsdGeomPoints"
    millimetres = np.array(points.GetPointsAttr().Get(1))
    np.testing.assert_allclose(millimetres, take.positions[1] * 1000, rtol=1e-5)
    low, high = np.array(points.GetExtentAttr().Get(1))
    assert (low < millimetres).all() and (millimetres < high).all()


def test_two_runs_give_the_same_bytes(tmp_path: Path) -> None:
    take = marker_take()
    for suffix in ("usda", "usdc"):
        write_take(take, tmp_path / f"a.{suffix}")
        write_take(take, tmp_path / f"b.{suffix}")
        assert (tmp_path / f"a.{suffix}").read_bytes() == (tmp_path / f"b.{suffix}").read_bytes()
