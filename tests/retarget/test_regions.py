from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from ict_face import ict_mesh, landmarks
from worlds import make_world

from usdface.retarget.regions import place_names, region_errors, region_residuals, regions_of
from usdface.retarget.solve_take import solve_take
from usdface.retarget_setup import Binding, RetargetSetup
from usdface.rigs import BlendShape

WORLD = make_world(head_moves=False)
MESH = WORLD.rig.face()
BINDING = Binding(tuple(WORLD.points), np.array(list(WORLD.points.values())))


def test_markers_are_in_the_region_of_the_shapes_around_them() -> None:
    found = dict(zip(BINDING.markers, regions_of(MESH, BINDING.points), strict=True))
    for region, names in {
        "brows": ("forehead", "brow_in_l", "brow_out_r"),
        "eyes": ("lid_l", "lid_r"),
        "mouth": ("lip_upper", "lip_lower", "corner_l", "corner_r"),
        "jaw": ("chin",),
    }.items():
        assert {found[name] for name in names} == {region}


def test_the_landmarks_of_a_real_face_are_where_they_are_said_to_be(shared_data: Path) -> None:
    """The 68 landmarks come in groups (iBUG): jaw line, brows, nose, eyes, mouth."""
    mesh = ict_mesh(shared_data)
    found = np.array(regions_of(mesh, landmarks(shared_data)))
    assert (found[17:27] == "brows").all()
    assert (found[31:36] == "nose").all()
    assert (found[36:48] == "eyes").all()
    assert (found[48:68] == "mouth").all()
    assert (found[4:13] == "jaw").all()


def test_a_face_whose_shapes_have_no_telling_names_is_one_region() -> None:
    named = (replace(s, name=f"s{k}") for k, s in enumerate(MESH.shapes))
    mesh = replace(MESH, shapes=tuple(named))
    assert set(regions_of(mesh, BINDING.points)) == {"face"}
    empty = replace(MESH, shapes=(BlendShape("jawOpen", np.zeros(0, int), np.zeros((0, 3))),))
    assert set(regions_of(empty, BINDING.points)) == {"face"}


def test_residuals_of_regions_make_up_that_of_the_face() -> None:
    setup = RetargetSetup(BINDING, head="stabilised", neutral=(0, 3))
    noise = 1e-3 * np.random.default_rng(0).normal(size=WORLD.take.positions.shape)
    positions = WORLD.take.positions + noise
    positions[5:9, WORLD.take.names.index("lid_l")] = np.nan
    positions[20, WORLD.take.names.index("chin"), 2] += 0.03
    take = replace(WORLD.take, positions=positions)
    offsets = MESH.offsets_at(BINDING.points)
    solution, _ = solve_take(take, MESH.points[BINDING.points], offsets, MESH.shape_names, setup)
    curves = region_residuals(MESH, BINDING, solution)
    regions = np.array(regions_of(MESH, BINDING.points))
    seen = ~np.isnan(solution.distances)
    total = sum(
        curve**2 * seen[:, regions == region].sum(axis=1) for region, curve in curves.items()
    )
    assert np.sqrt(total / seen.sum(axis=1)) == pytest.approx(solution.residual)
    said = region_errors(MESH, BINDING, solution)
    assert max(said, key=lambda region: said[region]["worst"]) == "jaw"
    assert said["jaw"]["worst_frame"] == 20
    assert sum(entry["markers"] for entry in said.values()) == len(BINDING.markers)


def test_places_are_told_by_region_side_and_the_nearest_marker() -> None:
    vertex = dict(zip(BINDING.markers, BINDING.points.tolist(), strict=True))
    pair = np.array([vertex["brow_mid_l"], vertex["brow_mid_r"]])
    left, right = place_names(MESH, pair, BINDING)
    assert left.startswith("left brow, 0 mm from marker brow_mid_l")
    assert right.startswith("right brow")
    nobody, chin = Binding((), np.zeros(0, int)), vertex["chin"]
    assert place_names(MESH, np.array([chin]), nobody) == (f"middle of the jaw (vertex {chin})",)
