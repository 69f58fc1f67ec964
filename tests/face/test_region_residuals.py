from dataclasses import replace

import numpy as np
import pytest
from worlds import make_world

from usdface.face.bound_face import bound_face
from usdface.face.region_residuals import region_errors, region_residuals
from usdface.face.regions import regions_of
from usdface.retarget.bound_points import BoundPoints
from usdface.retarget.solve_take import solve_take
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup

WORLD = make_world(head_moves=False)
MESH = WORLD.rig.face()
BINDING = Binding(tuple(WORLD.points), np.array(list(WORLD.points.values())))
FACE = bound_face(MESH, RetargetSetup(BINDING))


def test_residuals_of_regions_make_up_that_of_the_face() -> None:
    setup = RetargetSetup(BINDING, head="stabilised", neutral=(0, 3))
    noise = 1e-3 * np.random.default_rng(0).normal(size=WORLD.take.positions.shape)
    positions = WORLD.take.positions + noise
    positions[5:9, WORLD.take.names.index("lid_l")] = np.nan
    positions[20, WORLD.take.names.index("chin"), 2] += 0.03
    take = replace(WORLD.take, positions=positions)
    offsets = MESH.offsets_at(BINDING.points)
    solution, _ = solve_take(
        take, BoundPoints.linear(MESH.points[BINDING.points], offsets, MESH.shape_names), setup
    )
    curves = region_residuals(FACE, solution.markers, solution.distances)
    regions = np.array(regions_of(MESH, BINDING.points))
    seen = ~np.isnan(solution.distances)
    total = sum(
        curve**2 * seen[:, regions == region].sum(axis=1) for region, curve in curves.items()
    )
    assert np.sqrt(total / seen.sum(axis=1)) == pytest.approx(solution.residual)
    result = region_errors(FACE, solution.markers, solution.distances)
    assert max(result, key=lambda region: result[region]["worst"]) == "jaw"
    assert result["jaw"]["worst_frame"] == 20
    assert sum(entry["markers"] for entry in result.values()) == len(BINDING.markers)
