"""The same weights at any frame rate, in any unit and with either up axis."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from processed import EXACT, Done, process
from pxr import Usd, UsdGeom
from worlds import animation_of, make_world, restaged


@pytest.mark.parametrize("rate", [24.0, pytest.param(60.0, marks=pytest.mark.slow), 120.0])
def test_the_clock_does_not_change_the_weights(done: Done, tmp_path: Path, rate: float) -> None:
    root = process(make_world(rate=rate).write(tmp_path))
    stage = Usd.Stage.Open(str(root))
    assert stage.GetTimeCodesPerSecond() == stage.GetFramesPerSecond() == rate
    played = animation_of(root)
    np.testing.assert_array_equal(played.times, np.arange(40))
    # But for the correction, which is blended in over a time, not over frames.
    solves = [animation_of(at, muted="express.usdc").weights for at in (root, done.root)]
    np.testing.assert_allclose(*solves, atol=EXACT)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("rig_unit", "up"),
    [
        (1.0, "Z"),
        (0.01, "Y"),
        (0.001, "Z"),
        pytest.param(1.0, "Y", marks=pytest.mark.slow),
        pytest.param(0.01, "Z", marks=pytest.mark.slow),
        pytest.param(0.001, "Y", marks=pytest.mark.slow),
    ],
)
def test_units_and_up_axis_do_not_change_the_weights(
    done: Done, tmp_path: Path, rig_unit: float, up: str
) -> None:
    world = make_world()
    other = "Z" if up == "Y" else "Y"
    take = replace(world.take, meters_per_unit=0.01 if rig_unit == 1 else 0.001, up_axis=other)
    replace(world, take=take).write(tmp_path)
    restaged(tmp_path / "rig.usda", rig_unit, up)
    root = process(tmp_path)
    stage = Usd.Stage.Open(str(root))
    assert UsdGeom.GetStageMetersPerUnit(stage) == rig_unit
    assert UsdGeom.GetStageUpAxis(stage) == up
    np.testing.assert_allclose(
        animation_of(root).weights, animation_of(done.root).weights, atol=EXACT
    )
    retarget = stage.GetPrimAtPath("/Shot/Retarget")
    markers = stage.GetPrimAtPath("/Shot/Capture/Take")
    to_world = np.array(UsdGeom.XformCache().GetLocalToWorldTransform(markers))
    for code in (0, 13, 30):
        recorded = np.array(markers.GetAttribute("points").Get(code))
        local = np.array(retarget.GetAttribute("usdface:featurePoints").Get(code))
        head = np.array(retarget.GetAttribute("usdface:head:transform").Get(code))
        np.testing.assert_allclose(
            local @ head[:3, :3] + head[3, :3],
            recorded @ to_world[:3, :3] + to_world[3, :3],
            atol=1e-6 / rig_unit,
        )
