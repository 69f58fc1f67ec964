"""How far apart markers show the performer's lips."""

import numpy as np
import pytest
from closing_world import TIMES, markers, performance, result, slit_markers
from slits import slit_face

from usdface.closure.lip_contact import lip_apertures_of
from usdface.closure.lip_signal import LipDistances, lip_distances, lip_pairs
from usdface.face.bound_face import BoundFace
from usdface.shot.shot import ShotResult

MESH = slit_face()
NAMES = MESH.shape_names
INNER = {"inner_up": (0.0, 0.0044), "inner_down": (0.0, -0.0044)}
CHIN = {f"chin_{k}": (x, -0.0044) for k, x in enumerate((-0.0188, -0.0125, 0.0125, 0.0188))}
OPEN = 0.3 * np.clip(np.sin(2 * np.pi * TIMES), 0, None)


def distances_of(shot: ShotResult) -> LipDistances | None:
    face = shot.shot.face
    apertures = lip_apertures_of(face, NAMES)
    assert apertures is not None and shot.solution is not None
    return lip_distances(face, shot.solved, shot.solution, apertures.across, apertures.x)


def test_markers_above_and_below_the_mouth_are_a_pair_and_others_are_none() -> None:
    own = slit_markers(MESH)
    face = BoundFace(MESH, tuple(own), np.array(list(own.values()))).with_layout(())
    pairs = [[face.markers[k] for k in pair] for pair in lip_pairs(face, face.markers)]
    assert pairs == [["mouth_up", "mouth_down"]]
    assert not len(lip_pairs(face, ("brow_left", "mouth_up")))


def test_they_are_as_far_apart_as_the_jaw_opens() -> None:
    shot = result(markers(MESH, performance(NAMES, jawOpen=OPEN)))
    distances = distances_of(shot)
    assert distances is not None
    np.testing.assert_allclose(distances.seen[30:, 0], 0.02 * OPEN[30:], atol=0.0006)
    np.testing.assert_allclose(distances.seen, distances.shown, atol=0.0006)


@pytest.mark.slow
def test_a_pair_that_does_not_open_with_the_mouth_is_not_believed() -> None:
    take = markers(MESH, performance(NAMES, jawOpen=OPEN))
    positions = take.positions.copy()
    down, up = take.names.index("mouth_down"), take.names.index("mouth_up")
    positions[:, down, 1] = positions[0, down, 1] + positions[:, up, 1] - positions[0, up, 1]
    frozen = type(take)(take.names, take.times, positions, take.rate)
    assert distances_of(result(frozen)) is None


@pytest.mark.parametrize("crossed", [False, True])
def test_markers_bound_to_the_wrong_lip_are_in_no_pair_that_is_used(crossed: bool) -> None:
    """Nearest to the mouth, as landmarks of the inner rims are; two further away show the touch."""
    own = slit_markers(MESH)
    for name, place in {**INNER, **CHIN}.items():
        own[name] = int(np.linalg.norm(MESH.points - np.array([*place, 0.01]), axis=1).argmin())
    bound = dict(own)
    if crossed:
        bound["inner_up"], bound["inner_down"] = own["inner_down"], own["inner_up"]
    shot = result(markers(MESH, performance(NAMES, jawOpen=OPEN), at=own), at=bound)
    distances = distances_of(shot)
    assert distances is not None
    np.testing.assert_allclose(distances.seen[30:, 0], 0.02 * OPEN[30:], atol=0.001)
