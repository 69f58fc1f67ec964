from dataclasses import replace

import numpy as np
import pytest
from worlds import World, make_world

from usdface.binding.marker_places import free_places
from usdface.face.bound_face import bound_face
from usdface.options import SolveOptions
from usdface.retarget.bound_points import BoundPoints
from usdface.retarget.solution import Solution
from usdface.retarget.solve_report import SolveReport, solve_report
from usdface.retarget.solve_take import solve_take
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake

WORLD = make_world(head_moves=False)
MESH = WORLD.rig.meshes[0]


def solved(
    world: World, positions: np.ndarray, without: str = "-"
) -> tuple[RetargetSetup, Solution]:
    take = MarkerTake(world.take.names, world.take.times, positions, world.take.rate)
    kept = {name: point for name, point in world.points.items() if not name.startswith(without)}
    setup = RetargetSetup(Binding(tuple(kept), np.array(list(kept.values()))), neutral=(0, 3))
    points = setup.binding.points
    solution, _ = solve_take(
        take,
        BoundPoints.linear(MESH.points[points], MESH.offsets_at(points), MESH.shape_names),
        setup,
    )
    return setup, solution


def report(positions: np.ndarray, without: str = "-") -> SolveReport:
    setup, solution = solved(WORLD, positions, without)
    free = free_places(MESH, setup.binding.points)
    return solve_report(
        bound_face(MESH, setup), setup, solution, free=free.vertices, room=free.room
    )


def test_without_a_place_for_another_marker_what_is_undetermined_is_named_all_the_same() -> None:
    noise = 3e-4 * np.random.default_rng(0).normal(size=WORLD.take.positions.shape)
    setup, solution = solved(WORLD, WORLD.take.positions + noise, without="lid")
    result = solve_report(bound_face(MESH, setup), setup, solution, free=np.zeros(0, np.int64))
    hidden = result.details["confidence"]["undetermined"]
    assert hidden == {"eyeBlinkLeft": None, "eyeBlinkRight": None}
    assert "next markers" not in result.summary


def test_symmetry_tells_of_a_side_that_no_marker_shows() -> None:
    noise = 3e-4 * np.random.default_rng(0).normal(size=WORLD.take.positions.shape)
    setup, solution = solved(WORLD, WORLD.take.positions + noise, without="lid_r")
    result = {}
    for symmetry in (0.0, 400.0):
        held = replace(setup, solve=SolveOptions(symmetry=symmetry, prior="fixed"))
        solution = replace(solution, covariance=None)
        face = bound_face(MESH, held)
        details = solve_report(face, held, solution, free=np.zeros(0, np.int64)).details
        result[symmetry] = details["confidence"]["standard_deviation"]["eyeBlinkRight"]
    assert result[400.0] < 0.5 * result[0.0]


def test_a_marker_that_jumps_is_named_with_its_frame_and_distance() -> None:
    positions = WORLD.take.positions.copy()
    positions[17, WORLD.take.names.index("forehead"), 2] += 0.02
    markers = report(positions).details["residual"]["markers_mm"]
    assert max(markers, key=lambda name: markers[name]["worst"]) == "forehead"
    assert markers["forehead"]["worst_frame"] == 17
    assert markers["forehead"]["worst"] == pytest.approx(20, rel=0.25)


def test_residuals_of_frames_and_markers_are_of_one_piece() -> None:
    noise = 1e-3 * np.random.default_rng(0).normal(size=WORLD.take.positions.shape)
    result = report(WORLD.take.positions + noise).details["residual"]
    of_markers = [marker["rms"] for marker in result["markers_mm"].values()]
    assert len(result["frames_mm"]) == len(WORLD.take.times)
    assert np.mean(np.square(of_markers)) == pytest.approx(
        np.mean(np.square(result["frames_mm"])), rel=1e-2
    )


def test_an_occluded_marker_counts_where_it_was_seen() -> None:
    positions = WORLD.take.positions.copy()
    positions[10:, WORLD.take.names.index("chin")] = np.nan
    assert report(positions).details["residual"]["markers_mm"]["chin"]["worst_frame"] < 10


def test_a_shape_that_lost_its_markers_is_said_with_the_place_that_would_show_it() -> None:
    noise = 3e-4 * np.random.default_rng(0).normal(size=WORLD.take.positions.shape)
    result = report(WORLD.take.positions + noise, without="lid")
    names = {"eyeBlinkLeft", "eyeBlinkRight"}
    hidden = result.details["confidence"]["undetermined"]
    assert names <= set(hidden)
    assert {f.code for f in result.findings} == {"SHAPE_UNDETERMINED"}
    for name in names:
        moved = np.linalg.norm(MESH.offsets_at(np.array([hidden[name]])), axis=2)[:, 0]
        assert MESH.shape_names[int(moved.argmax())] == name
    assert all(name in result.summary["least_certain"] for name in names)
    sure = report(WORLD.take.positions + noise)
    assert names.isdisjoint(sure.details["confidence"]["undetermined"])
