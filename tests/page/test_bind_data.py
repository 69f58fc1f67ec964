import json

import numpy as np
import pytest
from worlds import NEUTRAL, make_world

from usdface.geometry.marker_spread import marker_spread
from usdface.io.bind_file import bind_json
from usdface.page.bind_data import bind_data, mirror_vertices, motion_curve
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup


def binding(points, confidence=None):
    share = None if confidence is None else np.array(confidence)
    return Binding(tuple(points), np.array([*points.values()], dtype=np.int64), "", share)


def test_each_marker_has_its_place_state_and_partner() -> None:
    world = make_world()
    points = dict(world.points)
    unsure = {"chin": points.pop("chin")}
    del points["forehead"]
    setup = RetargetSetup(
        binding(points, [0.9] * len(points)),
        unsure=binding(unsure, [0.2]),
        neutral=(0, NEUTRAL - 1),
    )
    mesh = world.rig.meshes[0]
    data = bind_data(world.take, mesh, setup, bind_json(setup))
    rows = {row["name"]: row for row in data["markers"]}
    assert [row["name"] for row in data["markers"]] == list(world.take.names)
    assert rows["chin"] == {
        "name": "chin",
        "point": world.points["chin"],
        "confidence": 0.2,
        "state": "unsure",
    }
    assert (rows["forehead"]["point"], rows["forehead"]["state"]) == (-1, "out")
    assert (rows["nose"]["confidence"], rows["nose"]["state"]) == (0.9, "bound")
    names = world.take.names
    for name, partner in zip(names, data["partners"], strict=True):
        other = name[:-1] + {"l": "r", "r": "l"}.get(name[-1], name[-1])
        assert names[partner] == (other if name.endswith(("_l", "_r")) else name)
    assert data["document"] == json.loads(bind_json(setup))


def test_a_few_unsure_places_on_one_spot_do_not_shrink_the_performer() -> None:
    world = make_world(head_moves=False)
    mesh = world.rig.meshes[0]
    names = list(world.points)[:5]
    spot = np.argsort(np.linalg.norm(mesh.points - mesh.points[world.points["nose"]], axis=1))
    unsure = dict(zip(names, spot[:5].tolist(), strict=True))
    nothing = binding({})
    sizes = []
    for setup in (
        RetargetSetup(nothing, unsure=binding(unsure, [0.0] * 5), neutral=(0, 0)),
        RetargetSetup(nothing, neutral=(0, 0)),
    ):
        data = bind_data(world.take, mesh, setup, bind_json(setup))
        sizes.append(marker_spread(data["positions"].values[0]))
    assert sizes[0] == pytest.approx(sizes[1])


def test_the_head_stands_still_and_the_motion_is_that_from_rest() -> None:
    moving, still = make_world(), make_world(head_moves=False)
    setup = RetargetSetup(binding(still.points), neutral=(0, NEUTRAL - 1))
    mesh = still.rig.meshes[0]
    curves = [
        bind_data(w.take, mesh, setup, bind_json(setup))["motion_mm"].values
        for w in (moving, still)
    ]
    rest = still.take.positions[:NEUTRAL].mean(axis=0)
    away = ((still.take.positions - rest) ** 2).sum(axis=2).mean(axis=1)
    np.testing.assert_allclose(curves[1], 1000 * np.sqrt(away), atol=0.3)
    np.testing.assert_allclose(curves[0], curves[1], atol=0.6)


def test_occluded_markers_do_not_count_for_the_motion() -> None:
    positions = np.zeros((4, 2, 3))
    positions[2, 0, 1] = 0.01
    positions[3, 1] = np.nan
    positions[3, 0, 1] = 0.02
    np.testing.assert_allclose(motion_curve(positions, (0, 1)), [0, 0, 0.01 / 2**0.5, 0.02])
    positions[3] = np.nan
    assert np.isnan(motion_curve(positions, (0, 1))[3]), "a frame without markers is no rest"


def test_a_vertex_has_its_image_on_the_other_side() -> None:
    mesh = make_world().rig.meshes[0]
    other = mirror_vertices(mesh, 0.0)
    np.testing.assert_allclose(mesh.points[other], mesh.points * (-1, 1, 1), atol=2e-3)
    assert (other[other] == np.arange(len(other))).mean() > 0.9
