"""Solved lids: known weights, known openings."""

import numpy as np
from closing_world import TIMES, markers, performance, shot_of, with_human_lids
from slits import slit_face

from usdface.closure.lid_apertures import lid_apertures_of
from usdface.closure.solved_lids import SolvedLids, solved_lids
from usdface.takes import WeightsTake

MESH = with_human_lids(slit_face())
NAMES = MESH.shape_names
FACE = shot_of(markers(MESH, performance(NAMES)), MESH).face
APERTURES = lid_apertures_of(FACE, NAMES)


def lids_of(curve: np.ndarray, **others: np.ndarray) -> SolvedLids:
    weights = performance(NAMES, eyeBlinkLeft=curve, **others)
    return solved_lids(FACE, APERTURES, WeightsTake(NAMES, TIMES, weights, 60.0))


def test_all_of_the_opening_is_gone_at_full_weight_and_nothing_at_rest() -> None:
    curve = np.linspace(0, 1, len(TIMES))
    lids = lids_of(curve)
    np.testing.assert_allclose(lids.closed[[0, -1], 0], [0.0, 1.0], atol=0.02)
    assert (np.diff(lids.closed[:, 0]) > 0).all()
    np.testing.assert_array_equal(lids.by_closer[:, 0], curve)


def test_what_another_shape_closes_is_not_by_the_closer() -> None:
    half = np.full(len(TIMES), 0.3)
    squinted, without = lids_of(half, eyeSquintLeft=half), lids_of(half)
    assert (squinted.closed[:, 0] > without.closed[:, 0] + 0.05).all()
    np.testing.assert_array_equal(squinted.by_closer, without.by_closer)


def test_an_eye_without_lids_is_unknown() -> None:
    lids = solved_lids(
        FACE, {"left": APERTURES["left"]}, WeightsTake(NAMES, TIMES, performance(NAMES), 60.0)
    )
    assert np.isnan(lids.closed[:, 1]).all() and np.isfinite(lids.closed[:, 0]).all()


def test_lids_that_move_markers_unlike_people_are_not_solved() -> None:
    mesh = with_human_lids(slit_face(), 2.0)
    face = shot_of(markers(mesh, performance(NAMES)), mesh).face
    weights = WeightsTake(NAMES, TIMES, performance(NAMES), 60.0)
    assert np.isnan(solved_lids(face, lid_apertures_of(face, NAMES), weights).closed).all()
