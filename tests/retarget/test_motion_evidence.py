from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.geometry.rigid_modes import motion_basis
from usdface.options import MapOptions
from usdface.retarget.motion_evidence import MotionEvidence
from usdface.retarget.rbf import SpaceMap, fit_map

RNG = np.random.default_rng(12)
FRAMES, MARKERS, SHAPES = 60, 20, 6
TIMES = np.arange(FRAMES) / 30
FACE = RNG.normal(size=(MARKERS, 3)) * [0.07, 0.09, 0.03]
BASIS = 0.01 * RNG.normal(size=(SHAPES, MARKERS, 3))
MODEL = BlendShapeEvaluator(BASIS.reshape(SHAPES, -1))
TRUTH = np.clip(0.4 + 0.7 * np.sin(TIMES[:, None] * RNG.uniform(1, 5, SHAPES)), 0, 1)
MOVED = np.einsum("fs,smi->fmi", TRUTH, BASIS)
STRETCH = np.diag([1.0, 1.4, 0.7])


def linear_map(linear: np.ndarray, neutral: np.ndarray = FACE) -> SpaceMap:
    none = np.zeros_like(FACE)
    return SpaceMap(neutral, none, linear, np.zeros(3), "gaussian", 1.0, local=True)


def share(markers: np.ndarray, space: SpaceMap) -> float:
    return MotionEvidence(TIMES, markers).unexplained_share(space, FACE, MODEL)


def noise(size: float) -> np.ndarray:
    return size * np.random.default_rng(2).normal(size=MOVED.shape)


def test_an_exact_world_leaves_nothing() -> None:
    assert share(FACE + MOVED, linear_map(np.eye(3))) < 1e-9


def test_noise_is_taken_off() -> None:
    """Half as large as the motion it would leave a share of 0.45."""
    size = 0.5 * np.sqrt(np.mean(MOVED**2))
    assert share(FACE + MOVED + noise(size), linear_map(np.eye(3))) < 0.15


def test_the_true_map_leaves_less_than_a_wrong_one() -> None:
    """A performer that is stretched; the similarity does not know."""
    performer = (FACE + MOVED + noise(2e-5)) @ np.linalg.inv(STRETCH)
    neutral = FACE @ np.linalg.inv(STRETCH)
    true, wrong = (share(performer, linear_map(m, neutral)) for m in (STRETCH, np.eye(3)))
    assert true < 0.03 < 0.2 < wrong


def test_the_share_is_rms_by_rms() -> None:
    """Motion half of which is in the span of the shapes, half is not."""
    rigid = motion_basis(FACE, 3)
    rest = np.linalg.qr(np.vstack([MODEL.offsets, rigid.T, RNG.normal(size=(4, 60))]).T)[0]
    inside = np.linalg.qr(MODEL.offsets.T - rigid @ (rigid.T @ MODEL.offsets.T))[0]
    motion = 0.01 * np.sin(TIMES)[:, None]
    moved = (motion * inside[:, 0] + motion * rest[:, 13]).reshape(FRAMES, MARKERS, 3)
    # Of 60 numbers 54 are not the head's motion, 48 of them are left over by the shapes.
    expected = np.sqrt((1 / 48) / (2 / 54))
    assert share(FACE + moved, linear_map(np.eye(3))) == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("size", [1e-3, 0.5, 1000.0])
def test_a_map_gains_nothing_by_its_scale(size: float) -> None:
    performer = FACE + MOVED @ STRETCH + noise(1e-4)
    alone = share(performer, linear_map(np.eye(3)))
    assert share(performer, linear_map(size * np.eye(3))) == pytest.approx(alone, rel=1e-9)
    assert alone > 0.1


def test_the_unit_of_the_take_plays_no_part() -> None:
    performer, neutral = (
        FACE + MOVED @ STRETCH + noise(1e-4),
        FACE * 1.1 + 0.02 * FACE[:, [1, 2, 0]],
    )
    metres = share(performer, fit_map(neutral, FACE, MapOptions()))
    millimetres = share(1000 * performer, fit_map(1000 * neutral, FACE, MapOptions()))
    assert millimetres == pytest.approx(metres, rel=1e-6)


def test_rigid_motion_plays_no_part() -> None:
    """The performer's axes, and what a head's pose has left of small motions in each frame."""
    performer = FACE + MOVED @ STRETCH + noise(1e-4)
    alone = share(performer, linear_map(np.eye(3)))
    turn = Rotation.from_rotvec([0.3, -1.0, 0.4]).as_matrix()
    turned = linear_map(turn, FACE @ turn.T)
    assert share(performer @ turn.T, turned) == pytest.approx(alone, rel=1e-9)
    swaying = 0.01 * RNG.normal(size=(FRAMES, 6)) @ motion_basis(FACE, 3).T
    swayed = performer + swaying.reshape(FRAMES, MARKERS, 3)
    assert share(swayed, linear_map(np.eye(3))) == pytest.approx(alone, rel=1e-6)


def test_an_image_is_judged_on_its_plane() -> None:
    image = 700.0 * (FACE + MOVED)[..., :2]
    flat = linear_map(np.eye(2, 3) / 700.0, 700.0 * FACE[:, :2])
    assert share(image, flat) < 1e-9
    assert share(image * [1.0, 1.5], replace(flat, centres=flat.centres * [1.0, 1.5])) > 0.1


def test_occluded_markers_are_no_obstacle() -> None:
    performer = FACE + MOVED @ STRETCH + noise(1e-4)
    whole = share(performer, linear_map(np.eye(3)))
    performer[10:30, 3] = performer[::7, 11] = np.nan
    performer[40] = np.nan
    assert share(performer, linear_map(np.eye(3))) == pytest.approx(whole, rel=0.05)


def test_a_take_that_does_not_move_has_no_say() -> None:
    still = np.repeat(FACE[None], FRAMES, axis=0)
    assert np.isnan(share(still, linear_map(np.eye(3))))
    assert np.isnan(share(still + noise(3e-4), linear_map(np.eye(3))))


def test_shapes_that_can_explain_anything_have_no_say() -> None:
    """Of 60 numbers the head takes 6; with 49 shapes 5 are left, with 48 six."""
    many = BlendShapeEvaluator(0.01 * RNG.normal(size=(49, 60)))
    evidence = MotionEvidence(TIMES, FACE + MOVED)
    assert np.isnan(evidence.unexplained_share(linear_map(np.eye(3)), FACE, many))
    one_less = BlendShapeEvaluator(many.offsets[:48])
    assert np.isfinite(evidence.unexplained_share(linear_map(np.eye(3)), FACE, one_less))
