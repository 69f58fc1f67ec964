from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from worlds import camera_pixels, make_world

from usdface.errors import InputError
from usdface.retarget.bound_points import BoundPoints
from usdface.retarget.prepared_markers import PreparedMarkers, prepare_markers
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake

WORLD = make_world()
MESH = WORLD.rig.meshes[0]
NAMES, VERTICES = tuple(WORLD.points), np.array(list(WORLD.points.values()))
SETUP = RetargetSetup(Binding(NAMES, VERTICES), neutral=(0, 3))


def prepared(take: MarkerTake, setup: RetargetSetup = SETUP) -> tuple[PreparedMarkers, set[str]]:
    points, offsets = MESH.points[VERTICES], MESH.offsets_at(VERTICES)
    found, _, findings = prepare_markers(
        take, BoundPoints.linear(points, offsets, MESH.shape_names), setup, None
    )
    return found, {finding.code for finding in findings}


def test_a_marker_that_rests_unseen_does_not_count() -> None:
    positions = WORLD.take.positions.copy()
    own = WORLD.take.names.index(NAMES[2])
    positions[:4, own] = np.nan
    found, _ = prepared(replace(WORLD.take, positions=positions))
    assert found.names == tuple(name for name in NAMES if name != NAMES[2])
    kept = [k for k, name in enumerate(NAMES) if name in found.names]
    np.testing.assert_array_equal(found.points, MESH.points[VERTICES[kept]])
    assert found.model.offsets.shape == (len(MESH.shapes), 3 * len(kept))
    assert found.neutral_counts is not None and (found.neutral_counts == 4).all()


def test_a_stated_deviation_is_that_on_the_character() -> None:
    larger = replace(WORLD.take, positions=2.0 * WORLD.take.positions, deviation=0.001)
    assert prepared(larger)[0].least_noise == pytest.approx(0.0005, rel=1e-3)
    assert prepared(WORLD.take)[0].least_noise == 0.0
    with pytest.raises(InputError, match="more than they are apart"):
        prepared(replace(WORLD.take, deviation=1.0))


def test_named_head_markers_carry_the_face() -> None:
    head = NAMES[:3]
    turns = Rotation.from_euler("xyz", np.linspace([0, 0, 0], [0.2, -0.3, 0.1], 6)).as_matrix()
    turns[:4] = np.eye(3)
    positions = MESH.points[VERTICES] @ turns.transpose(0, 2, 1) + [0.1, 0.0, -0.2]
    take = MarkerTake(NAMES, np.arange(6) / 30.0, positions, 30.0)
    found, _ = prepared(take, replace(SETUP, head="markers", head_markers=head))
    still = found.pose.to_head(found.positions)
    np.testing.assert_allclose(still, np.broadcast_to(still[0], still.shape), atol=1e-12)
    np.testing.assert_allclose(found.head_neutral, positions[0, :3], atol=1e-12)
    np.testing.assert_array_equal(found.evidence(take.times).markers, still)


def test_an_image_leaves_blend_shapes_out_that_it_cannot_show() -> None:
    points, offsets = MESH.points[VERTICES], MESH.offsets_at(VERTICES)
    forward = offsets.copy()
    forward[0, :, :2] = 0.0
    take = camera_pixels(WORLD.take)
    found, _, findings = prepare_markers(
        take, BoundPoints.linear(points, forward, MESH.shape_names), SETUP, None
    )
    assert [f.where for f in findings if f.code == "SHAPE_UNSEEN"] == [MESH.shape_names[0]]
    assert not found.model.offsets[0].any() and found.model.offsets[1].any()
    assert found.head_neutral.shape == (0, 2)


def test_neutral_weights_are_taken_off() -> None:
    name = MESH.shape_names[0]
    shown = 0.5 * MESH.offsets_at(VERTICES)[0]
    positions = np.tile(MESH.points[VERTICES] + shown, (6, 1, 1))
    take = MarkerTake(NAMES, np.arange(6) / 30.0, positions, 30.0)
    found, _ = prepared(take, replace(SETUP, neutral_weights={name: 0.5}))
    off = np.abs(found.neutral - MESH.points[VERTICES]).max()
    assert off < 0.05 * np.abs(shown).max()
    with pytest.raises(InputError, match="a blend shape the bound mesh has not"):
        prepared(take, replace(SETUP, neutral_weights={"no shape": 0.5}))
