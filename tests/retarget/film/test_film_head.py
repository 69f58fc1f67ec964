from dataclasses import replace

import numpy as np
from filmed import (
    CAMERA,
    COUNT,
    FOCAL,
    MESH,
    NEUTRAL,
    PLACES,
    SURFACE,
    WORLD,
    filmed,
    found,
    placed,
    true_weights,
)

from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.face.marker_surface import MarkerSurface
from usdface.retarget.film.dot_centres import dot_centre_offsets
from usdface.retarget.film.film_head import film_head
from usdface.retarget.film.filmed_take import as_they_are


def test_the_head_moves_as_it_did_and_its_markers_stand_still() -> None:
    take, motion = filmed(WORLD, 20.0)
    head, codes = found(replace(take, focal_length=FOCAL))
    assert codes == []
    np.testing.assert_allclose(head.motion.rotations, motion.rotations, atol=1e-6)
    np.testing.assert_allclose(head.motion.translations, motion.translations, atol=1e-6)
    still = head.still(take).positions
    np.testing.assert_allclose(still, WORLD.take.positions[..., :2], atol=1e-6)


def test_hidden_markers_stay_hidden_and_cost_nothing() -> None:
    take, motion = filmed(WORLD, 15.0)
    positions = take.positions.copy()
    positions[5:20, 3] = np.nan
    head, _ = found(replace(take, positions=positions, focal_length=FOCAL))
    assert np.isnan(head.still(replace(take, positions=positions)).positions[5:20, 3]).all()
    np.testing.assert_allclose(head.motion.rotations, motion.rotations, atol=1e-6)


def test_of_a_performer_who_moves_more_the_head_moves_as_it_did() -> None:
    """Else larger motion of the face is taken for the head's."""
    positions = WORLD.take.positions
    larger = positions[:1] + 1.25 * (positions - positions[:1])
    performer = replace(WORLD, take=replace(WORLD.take, positions=larger))
    take, motion = filmed(performer, 20.0)
    take = replace(take, focal_length=FOCAL)

    def sized(shapes: BlendShapeEvaluator) -> BlendShapeEvaluator:
        return replace(shapes, offsets=1.25 * shapes.offsets)

    off = []
    for given in (sized, as_they_are):
        face, _ = film_head(
            take, take.names, SURFACE, NEUTRAL, true_weights, sized=given, refined=False
        )
        assert face is not None
        off.append(np.abs(face.head.motion.rotations - motion.rotations).max())
    assert off[0] < 1e-6 < 1e-3 < off[1]


def test_five_markers_are_too_few() -> None:
    take, _ = filmed(WORLD, 15.0)
    names = take.names[:5]
    few = replace(take, names=names, positions=take.positions[:, :5])
    surface = SURFACE.select(np.arange(5))
    found, findings = film_head(few, names, surface, NEUTRAL, true_weights)
    assert found is None and [each.code for each in findings] == ["HEAD_IN_PLANE"]


def test_of_a_dot_the_middle_is_filmed_and_the_mean_of_its_skin_is_solved() -> None:
    take, motion = filmed(WORLD, 20.0)
    surface = MarkerSurface(MESH, PLACES, np.full(len(PLACES), 0.006))
    dots = surface.skin
    pose = placed(motion)
    weights = np.array(WORLD.weights)
    moved = dots.marker_evaluator.displacements(weights).reshape(COUNT, -1, 3)
    means = dots.rest + moved
    middles = CAMERA.image(pose.to_take(means)) + dot_centre_offsets(dots, weights, pose, CAMERA)
    film = replace(take, positions=middles, focal_length=FOCAL)
    off = [
        np.abs(found(film, each)[0].motion.rotations - motion.rotations).max()
        for each in (SURFACE, surface)
    ]
    assert off[1] < 1e-5 < 1e-3 < off[0]
    np.testing.assert_allclose(
        found(film, surface)[0].still(film).positions, means[..., :2], atol=1e-5
    )
