"""Lips and lids that touch go on touching, measured on the mesh itself."""

import numpy as np
import pytest
from slits import EXPRESSIONS, LID_GAP, LIP_GAP, slit_face

from usdface.correction.contact import gaps_of, hold
from usdface.errors import InputError
from usdface.face.layout import FaceLayout, find_layout

FACE = slit_face()
PARTS = find_layout(FACE, EXPRESSIONS, 0.0)
NAMES = FACE.shape_names
POSES = np.array([e.pose(NAMES) for e in EXPRESSIONS])
GAPS = gaps_of(FACE, PARTS, NAMES, POSES)
TOLERANCE = PARTS.tolerance
ROUNDING = 2e-6


def weights(**shapes: float) -> np.ndarray:
    return np.array([[shapes.get(name, 0.0) for name in NAMES]])


def raised(solved: np.ndarray, **shapes: float) -> np.ndarray:
    return np.maximum(solved, weights(**shapes))


def lip_gap(w: np.ndarray) -> np.ndarray:
    """The gap of each pair of lip vertices on the deformed mesh: (P,) [m]."""
    points = FACE.deformed(w[0])
    upper, lower = points[PARTS.lips].swapaxes(0, 1)
    return upper[:, 1] - lower[:, 1]


def lid_gap(w: np.ndarray) -> np.ndarray:
    upper, lower = FACE.deformed(w[0])[PARTS.lids].swapaxes(0, 1)
    return upper[:, 1] - lower[:, 1]


def random_corrections(frames: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(3)
    solved = rng.uniform(size=(frames, len(NAMES))) * (rng.uniform(size=(frames, len(NAMES))) > 0.6)
    drive = rng.uniform(size=(frames, len(POSES), 1)) * (rng.uniform(size=(frames, 4, 1)) > 0.4)
    return solved, np.maximum(solved, (drive * POSES).max(axis=1))


def test_gaps_are_those_of_the_mesh():
    rest = GAPS.at(np.zeros((1, len(NAMES))))[0]
    lips = np.array([seam == "lips" for seam in GAPS.seam])
    np.testing.assert_allclose(rest[lips], LIP_GAP)
    np.testing.assert_allclose(rest[~lips], LID_GAP)
    some = weights(jawOpen=0.3, eyeBlinkLeft=0.5, eyeSquintLeft=0.2)
    gaps = dict(zip(GAPS.seam, GAPS.at(some)[0], strict=True))
    assert gaps["lips"] == pytest.approx(LIP_GAP + 0.3 * 0.020)
    assert gaps["left lids"] == pytest.approx(LID_GAP - 0.5 * 0.008 - 0.2 * 0.003)
    assert gaps["right lids"] == pytest.approx(LID_GAP)


def test_a_smile_does_not_open_a_closed_mouth():
    smile = {"mouthSmileLeft": 1.0, "mouthSmileRight": 1.0, "mouthUpperUpLeft": 0.5}
    solved = weights()
    held, limited, excess = hold(solved, raised(solved, **smile), GAPS)
    assert limited.any() and excess.max() > 0.002
    places = GAPS.at(held) - GAPS.at(solved)
    assert places[0, :6].max() <= TOLERANCE + ROUNDING
    # The smile itself hardly parts the lips and stays; what draws them apart goes.
    shown = dict(zip(NAMES, held[0], strict=True))
    assert shown["mouthSmileRight"] > 0.75 and shown["mouthUpperUpLeft"] < 0.1


def test_a_smile_that_parts_nothing_is_left_alone():
    solved = weights()
    wanted = raised(solved, mouthSmileLeft=0.5, browInnerUp=1.0)
    held, limited, _ = hold(solved, wanted, GAPS)
    np.testing.assert_array_equal(held, wanted)
    assert not limited.any()


def test_an_open_mouth_may_open_further():
    solved = weights(jawOpen=0.4)
    wanted = raised(solved, jawOpen=1.0)
    np.testing.assert_array_equal(hold(solved, wanted, GAPS)[0], wanted)


def test_closed_lids_are_neither_opened_nor_pushed_into_each_other():
    closed = weights(eyeBlinkLeft=1.0, eyeBlinkRight=1.0)
    for wanted in (
        raised(closed, eyeWideLeft=0.9, eyeWideRight=0.9),
        raised(closed, eyeSquintLeft=1.0, eyeSquintRight=1.0),
    ):
        held, limited, _ = hold(closed, wanted, GAPS)
        assert limited.any()
        assert np.abs(lid_gap(held)).max() <= TOLERANCE + ROUNDING
    # Half closed lids may go where they like, as far as the other.
    half = weights(eyeBlinkLeft=0.5)
    squint = raised(half, eyeSquintLeft=1.0)
    np.testing.assert_array_equal(hold(half, squint, GAPS)[0], squint)


def test_every_gap_changes_as_it_may_and_every_weight_stays_between():
    solved, wanted = random_corrections(400)
    held, limited, _ = hold(solved, wanted, GAPS)
    before, after = GAPS.at(solved), GAPS.at(held)
    low, high = GAPS.room(before)
    assert (after - before <= high + ROUNDING).all() and (after - before >= low - ROUNDING).all()
    shut = before <= GAPS.touch
    assert 0.1 < shut.mean() < 0.9
    assert (after[shut] <= (GAPS.touch + TOLERANCE + ROUNDING)[np.nonzero(shut)[1]]).all()
    assert (held >= solved).all() and (held <= wanted).all()
    untouched = ~limited.any(axis=1)
    assert 0.1 < untouched.mean() < 0.95
    np.testing.assert_array_equal(held[untouched], wanted[untouched])


def test_little_more_is_taken_back_than_a_solver_of_quadratic_programs_takes():
    pytest.importorskip("daqp", reason="the extra `bench` is not installed")
    qpsolvers = pytest.importorskip("qpsolvers", reason="the extra `bench` is not installed")
    solved, wanted = random_corrections(120)
    held, limited, _ = hold(solved, wanted, GAPS)
    before = GAPS.at(solved)
    low, high = GAPS.room(before)
    ratios = []
    for f in np.flatnonzero(limited.any(axis=1)):
        d = (wanted - solved)[f]
        way = 1000 * np.concatenate([GAPS.moves.T, -GAPS.moves.T])
        room = 1000 * np.concatenate([high[f], -low[f]])
        one = np.eye(len(d))
        bounds = {"lb": np.zeros(len(d)) - 1e-9, "ub": d + 1e-9}
        best = qpsolvers.solve_qp(one, -d, way, room, solver="daqp", **bounds)
        ratios.append(np.linalg.norm(held[f] - wanted[f]) / np.linalg.norm(best - d))
    assert len(ratios) > 30
    assert np.median(ratios) < 1.02 and max(ratios) < 1.5


def test_holding_what_is_held_changes_nothing():
    solved, wanted = random_corrections(200)
    held, _, _ = hold(solved, wanted, GAPS)
    np.testing.assert_array_equal(hold(solved, held, GAPS)[0], held)


def test_correcting_twice_parts_closed_lips_by_the_tolerance_once_more_at_most():
    solved, wanted = random_corrections(400)
    solved[:, [not name.startswith("mouthPress") for name in NAMES]] = 0.0
    wanted = np.maximum(solved, wanted)
    once, limited, _ = hold(solved, wanted, GAPS)
    assert limited.any(axis=1).mean() > 0.3
    twice, _, _ = hold(once, np.maximum(once, wanted), GAPS)
    lips = np.array([seam == "lips" for seam in GAPS.seam])
    opened = (GAPS.at(once) - GAPS.touch)[:, lips]
    again = (GAPS.at(twice) - GAPS.touch)[:, lips]
    assert opened.max() <= TOLERANCE + ROUNDING and again.max() <= 2 * TOLERANCE + ROUNDING


def test_a_mirrored_correction_is_held_in_mirror_image():
    solved, wanted = random_corrections(200)
    swap = {"Left": "Right", "Right": "Left"}
    mirror = [
        NAMES.index(next((n[: -len(s)] + swap[s] for s in swap if n.endswith(s)), n)) for n in NAMES
    ]
    held, _, _ = hold(solved, wanted, GAPS)
    mirrored, _, _ = hold(solved[:, mirror], wanted[:, mirror], GAPS)
    np.testing.assert_allclose(mirrored, held[:, mirror], atol=1e-9)


def test_a_correction_that_grows_smoothly_is_held_smoothly():
    t = np.linspace(0, 1, 200)[:, None]
    solved = weights(jawOpen=0.15) * np.sin(3 * t) ** 2
    wanted = np.maximum(solved, t * weights(mouthUpperUpLeft=1.0, mouthUpperUpRight=1.0, jawOpen=1))
    held = hold(solved, wanted, GAPS)[0]
    assert np.abs(np.diff(held, axis=0)).max() < 4 * np.abs(np.diff(wanted, axis=0)).max()


def test_a_face_without_seams_is_not_held():
    nothing = gaps_of(FACE, FaceLayout(), NAMES, POSES)
    solved, wanted = random_corrections(20)
    np.testing.assert_array_equal(hold(solved, wanted, nothing)[0], wanted)


def test_pairs_that_the_mesh_does_not_have_are_refused():
    parts = FaceLayout(lips=np.array([[0, 99_999]]))
    with pytest.raises(InputError, match="vertex 99999"):
        gaps_of(FACE, parts, NAMES, POSES)
