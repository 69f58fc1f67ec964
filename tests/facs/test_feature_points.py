from dataclasses import replace

import numpy as np
import pytest
from spoilt_shapes import renamed, silenced

from usdface.errors import InputError
from usdface.facs.feature_points import find_feature_points
from usdface.facs.movements import POINTS, SIDED
from usdface.rigs import BlendShape, Mesh, Rig

MM = 0.001


def test_points_are_where_the_example_has_them(head: Rig) -> None:
    """The example is sculpted about eyes at 35.6 mm and a mouth at -66 mm."""
    points = find_feature_points(head)
    assert set(points.patches) == set(POINTS)
    at = {name: place / MM for name, place in points.centres(head).items()}
    assert abs(at["left eyeball"][0] - 35.6) < 1.0
    assert at["left lip corner"][1] == pytest.approx(-65.0, abs=3.0)
    assert at["left upper lid"][1] > at["left lower lid"][1] + 10.0
    # Lips touch at rest; they are two skins nevertheless.
    moved = points.moved(head, ("jawOpen",))[0, :, 1]
    assert moved[POINTS.index("middle lower lip")] < moved[POINTS.index("middle upper lip")] - 20.0
    heights = ["glabella", "nose root", "nose tip", "philtrum", "lip groove", "chin boss", "chin"]
    assert np.all(np.diff([at[name][1] for name in heights]) < 0)


def test_left_and_right_are_mirror_images(head: Rig) -> None:
    at = find_feature_points(head).centres(head)
    for point in SIDED:
        left, right = at[f"left {point}"], at[f"right {point}"]
        assert left[0] > 0
        assert np.allclose(left * (-1, 1, 1), right, atol=2 * MM), point


def test_names_move_no_point(head: Rig) -> None:
    names = head.shape_names
    shuffled = dict(zip(names, np.random.default_rng(5).permutation(names).tolist(), strict=True))
    here, there = find_feature_points(head), find_feature_points(renamed(head, shuffled))
    for point in POINTS:
        assert np.array_equal(here.patches[point][1], there.patches[point][1]), point


@pytest.mark.slow
def test_a_dead_blink_hides_no_eye(head: Rig) -> None:
    blind = find_feature_points(silenced(head, "eyeBlinkLeft"))
    at, usual = blind.centres(head), find_feature_points(head).centres(head)
    assert np.linalg.norm(at["left upper lid"] - usual["left upper lid"]) < 2 * MM


def test_lengths_are_those_of_a_human_head(head: Rig) -> None:
    """A head of ten times the size moves as far in millimetres of a human one."""
    large = replace(
        head,
        meshes=tuple(
            replace(
                m,
                points=10 * m.points,
                shapes=tuple(replace(s, offsets=10 * s.offsets) for s in m.shapes),
            )
            for m in head.meshes
        ),
    )
    names = head.shape_names
    moved = find_feature_points(head).moved(head, names)
    assert np.allclose(find_feature_points(large).moved(large, names), moved, atol=1e-6)


def test_shapes_alone_and_together_move_alike(head: Rig) -> None:
    points, names = find_feature_points(head), head.shape_names
    weights = np.eye(len(names))
    moved = points.moved(head, names)
    assert np.allclose(points.displaced(head, names, weights), moved, atol=1e-9)
    assert np.allclose(
        points.displaced(head, names, weights.sum(axis=0, keepdims=True)),
        moved.sum(axis=0),
        atol=1e-9,
    )


def widened(mesh: Mesh) -> Mesh:
    """Return an eye of which no shape is left but one that widens its pupil."""
    at = mesh.points - mesh.points.mean(axis=0)
    pupil = at[:, 2] > 0.8 * at[:, 2].max()
    offsets = np.where(pupil[:, None], 0.3 * at * (1, 1, 0), 0.0)
    return replace(mesh, shapes=(BlendShape.from_dense("pupil", offsets),))


def test_an_eyeball_counts_where_a_shape_turns_it(head: Rig) -> None:
    eyes = {index for index, _ in _eyeballs_of(head).values()}
    assert len(eyes) == 2
    still = tuple(widened(m) if i in eyes else m for i, m in enumerate(head.meshes))
    assert not eyes & {index for index, _ in _eyeballs_of(replace(head, meshes=still)).values()}


def _eyeballs_of(rig: Rig) -> dict[str, tuple[int, np.ndarray]]:
    patches = find_feature_points(rig).patches
    return {name: patch for name, patch in patches.items() if name.endswith("eyeball")}


def test_a_face_without_blinks_is_refused(head: Rig) -> None:
    kept = ("jawOpen", "mouthSmileLeft", "mouthSmileRight")
    meshes = tuple(
        replace(m, shapes=tuple(s for s in m.shapes if s.name in kept)) for m in head.meshes
    )
    with pytest.raises(InputError, match="no lids and lips"):
        find_feature_points(replace(head, meshes=meshes))
