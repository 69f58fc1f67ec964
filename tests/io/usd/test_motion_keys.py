from pathlib import Path

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom
from sheets import sheet

from usdface.io.transforms import along, compose
from usdface.io.usd.motion_keys import continuous_parts, motion_keys
from usdface.pipeline import export_scene


def spun(angles: np.ndarray, scale: np.ndarray) -> np.ndarray:
    half = np.stack([0 * angles, np.sin(angles / 2), 0 * angles, np.cos(angles / 2)], 1)
    return compose(np.zeros((len(angles), 3)), half, scale)


def test_a_mirror_on_the_way_turns_nothing() -> None:
    height = np.linspace(1, -1, 21)  # 0 in the middle
    scale = np.stack([np.ones(21), height, np.ones(21)], 1)
    moves, turns, sizes = continuous_parts(spun(np.linspace(0, 1, 21), scale))
    np.testing.assert_allclose(sizes, scale, atol=1e-12)
    assert np.abs((turns[1:] * turns[:-1]).sum(axis=1)).min() > 0.999
    np.testing.assert_allclose(compose(moves, turns, sizes), spun(np.linspace(0, 1, 21), scale))


@pytest.mark.slow
def test_arcs_need_no_more_keys_and_curves_do() -> None:
    def turned(code: float) -> np.ndarray:
        return spun(np.array([0.7 * code]), np.ones((1, 3)))[0]

    def about_a_pivot(code: float) -> np.ndarray:
        pivot = np.eye(4)
        pivot[3, :3] = (5, 0, 0)
        return np.linalg.inv(pivot) @ turned(code) @ pivot

    ends = np.array([0.0, 2.0])
    assert motion_keys(turned, ends).tolist() == [0, 2]
    keys = motion_keys(about_a_pivot, ends)
    assert 10 < len(keys) < 600 and keys[0] == 0 and keys[-1] == 2


@pytest.mark.parametrize("angle", [45, 90, 100, 180, 200, 360, 720])
@pytest.mark.parametrize("scale", [1.0, -1.0])
def test_a_turn_by_any_angle_between_two_samples_is_one(angle: float, scale: float) -> None:
    """And no mirroring of two axes, which shows a half turn alike."""

    def turned(code: float) -> np.ndarray:
        return spun(np.radians([angle * code]), np.array([[scale, 1.0, 1.0]]))[0]

    codes = motion_keys(turned, np.array([0.0, 1.0]))
    moves, turns, sizes = continuous_parts(np.array([turned(code) for code in codes]))
    for code in np.linspace(0, 0.999, 50):
        k = int(np.searchsorted(codes, code, side="right")) - 1
        share = (code - codes[k]) / (codes[k + 1] - codes[k])
        arc = along(turns, np.array([k]), np.array([share]))
        size = (1 - share) * sizes[[k]] + share * sizes[[k + 1]]
        np.testing.assert_allclose(compose(moves[[k]], arc, size)[0], turned(code), atol=1e-5)


@pytest.mark.slow
def test_a_prim_that_turns_about_a_pivot_goes_as_usd_shows_it(tmp_path: Path) -> None:
    stage = sheet()
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/R/M"))
    pivot = mesh.AddTranslateOp(opSuffix="pivot")
    pivot.Set(Gf.Vec3d(2, 0, 0))
    turn = mesh.AddRotateXYZOp()
    for code, angles in ((0, (0, 0, 0)), (48, (90, 200, 30))):
        turn.Set(Gf.Vec3f(*angles), code)
    mesh.AddTranslateOp(opSuffix="pivot", isInverseOp=True)
    stage.Export(str(tmp_path / "a.usda"))
    done = export_scene(tmp_path / "a.usda", tmp_path / "a.glb", every_frame=True)
    assert done.summary["frames"] > 20
    # Between the keys, too: the certificate compares at the keys of a stage with finer samples.
    fine = Usd.Stage.Open(str(tmp_path / "a.usda"))
    turned = fine.GetAttributeAtPath("/R/M.xformOp:rotateXYZ")
    for code in np.arange(0, 48.5, 0.5):
        turned.Set(turned.Get(code), code)
    fine.Export(str(tmp_path / "fine.usda"))
    from usdface.io.compare_conversion import certify_conversion
    from usdface.io.usd.stage import open_stage

    certificate, _ = certify_conversion(
        open_stage(tmp_path / "fine.usda"), tmp_path / "a.glb", exported=True, every_frame=True
    )
    assert certificate is not None and certificate.frames > 97
    assert certificate.vertex_largest < 1e-4
