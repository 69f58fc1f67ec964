"""Lips and lids that touch go on touching, measured on the mesh itself."""

from dataclasses import replace

import numpy as np
import pytest
from deformed import deformed
from scipy.optimize import minimize
from slits import EXPRESSIONS, bent_slit_face, slit_face

from usdface.correction.apertures import apertures_of
from usdface.correction.contact import limit_correction
from usdface.face.bound_face import BoundFace
from usdface.face.layout import FaceLayout, find_layout

FACE = slit_face()
PARTS = find_layout(FACE, EXPRESSIONS, 0.0)
BOUND = BoundFace(FACE, (), np.zeros(0, int), layout=PARTS)
NAMES = FACE.shape_names
POSES = np.array([e.pose(NAMES) for e in EXPRESSIONS])
APERTURES = apertures_of(BOUND, NAMES, POSES)
TOLERANCE = PARTS.tolerance
ROUNDING = 2e-6


def weights(**shapes: float) -> np.ndarray:
    return np.array([[shapes.get(name, 0.0) for name in NAMES]])


def raised(solved: np.ndarray, **shapes: float) -> np.ndarray:
    return np.maximum(solved, weights(**shapes))


def lid_aperture(w: np.ndarray) -> np.ndarray:
    upper, lower = deformed(FACE, w[0])[PARTS.lids].swapaxes(0, 1)
    return upper[:, 1] - lower[:, 1]


def random_corrections(frames: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(3)
    solved = rng.uniform(size=(frames, len(NAMES))) * (rng.uniform(size=(frames, len(NAMES))) > 0.6)
    drive = rng.uniform(size=(frames, len(POSES), 1)) * (rng.uniform(size=(frames, 4, 1)) > 0.4)
    return solved, np.maximum(solved, (drive * POSES).max(axis=1))


def test_a_smile_does_not_open_a_closed_mouth():
    smile = {"mouthSmileLeft": 1.0, "mouthSmileRight": 1.0, "mouthUpperUpLeft": 0.5}
    solved = weights()
    held, limited, excess = limit_correction(solved, raised(solved, **smile), APERTURES)
    assert limited.any() and excess.max() > 0.002
    places = APERTURES.at(held) - APERTURES.at(solved)
    assert places[0, :6].max() <= TOLERANCE + ROUNDING
    # The smile itself hardly parts the lips and stays; what draws them apart goes.
    kept = dict(zip(NAMES, held[0], strict=True))
    assert kept["mouthSmileRight"] > 0.75 and kept["mouthUpperUpLeft"] < 0.1


def test_a_smile_that_parts_nothing_is_left_alone():
    solved = weights()
    wanted = raised(solved, mouthSmileLeft=0.5, browInnerUp=1.0)
    held, limited, _ = limit_correction(solved, wanted, APERTURES)
    np.testing.assert_array_equal(held, wanted)
    assert not limited.any()


def test_an_open_mouth_may_open_further():
    solved = weights(jawOpen=0.4)
    wanted = raised(solved, jawOpen=1.0)
    np.testing.assert_array_equal(limit_correction(solved, wanted, APERTURES)[0], wanted)


def test_closed_lids_are_neither_opened_nor_pushed_into_each_other():
    closed = weights(eyeBlinkLeft=1.0, eyeBlinkRight=1.0)
    for wanted in (
        raised(closed, eyeWideLeft=0.9, eyeWideRight=0.9),
        raised(closed, eyeSquintLeft=1.0, eyeSquintRight=1.0),
    ):
        held, limited, _ = limit_correction(closed, wanted, APERTURES)
        assert limited.any()
        assert np.abs(lid_aperture(held)).max() <= TOLERANCE + ROUNDING
    # Half closed lids may go where they like, as far as the other.
    half = weights(eyeBlinkLeft=0.5)
    squint = raised(half, eyeSquintLeft=1.0)
    np.testing.assert_array_equal(limit_correction(half, squint, APERTURES)[0], squint)


def test_every_aperture_changes_as_it_may_and_every_weight_stays_between():
    solved, wanted = random_corrections(400)
    held, limited, _ = limit_correction(solved, wanted, APERTURES)
    before, after = APERTURES.at(solved), APERTURES.at(held)
    low, high = APERTURES.limits(before)
    assert (after - before <= high + ROUNDING).all() and (after - before >= low - ROUNDING).all()
    shut = before <= APERTURES.touch
    assert 0.1 < shut.mean() < 0.9
    assert (after[shut] <= (APERTURES.touch + TOLERANCE + ROUNDING)[np.nonzero(shut)[1]]).all()
    assert (held >= solved).all() and (held <= wanted).all()
    untouched = ~limited.any(axis=1)
    assert 0.1 < untouched.mean() < 0.95
    np.testing.assert_array_equal(held[untouched], wanted[untouched])


def test_little_more_is_taken_back_than_a_solver_of_quadratic_programs_takes():
    pytest.importorskip("daqp", reason="the extra `bench` is not installed")
    qpsolvers = pytest.importorskip("qpsolvers", reason="the extra `bench` is not installed")
    solved, wanted = random_corrections(120)
    held, limited, _ = limit_correction(solved, wanted, APERTURES)
    before = APERTURES.at(solved)
    low, high = APERTURES.limits(before)
    ratios = []
    for f in np.flatnonzero(limited.any(axis=1)):
        d = (wanted - solved)[f]
        way = 1000 * np.concatenate([APERTURES.evaluator.offsets.T, -APERTURES.evaluator.offsets.T])
        room = 1000 * np.concatenate([high[f], -low[f]])
        one = np.eye(len(d))
        bounds = {"lb": np.zeros(len(d)) - 1e-9, "ub": d + 1e-9}
        best = qpsolvers.solve_qp(one, -d, way, room, solver="daqp", **bounds)
        ratios.append(np.linalg.norm(held[f] - wanted[f]) / np.linalg.norm(best - d))
    assert len(ratios) > 30
    assert np.median(ratios) < 1.02 and max(ratios) < 1.5


def test_holding_what_is_held_changes_nothing():
    solved, wanted = random_corrections(200)
    held, _, _ = limit_correction(solved, wanted, APERTURES)
    np.testing.assert_array_equal(limit_correction(solved, held, APERTURES)[0], held)


def test_correcting_twice_parts_closed_lips_by_the_tolerance_once_more_at_most():
    solved, wanted = random_corrections(400)
    solved[:, [not name.startswith("mouthPress") for name in NAMES]] = 0.0
    wanted = np.maximum(solved, wanted)
    once, limited, _ = limit_correction(solved, wanted, APERTURES)
    assert limited.any(axis=1).mean() > 0.3
    twice, _, _ = limit_correction(once, np.maximum(once, wanted), APERTURES)
    lips = np.array([kind == "lips" for kind in APERTURES.contact])
    opened = (APERTURES.at(once) - APERTURES.touch)[:, lips]
    again = (APERTURES.at(twice) - APERTURES.touch)[:, lips]
    assert opened.max() <= TOLERANCE + ROUNDING and again.max() <= 2 * TOLERANCE + ROUNDING


def test_a_mirrored_correction_is_held_in_mirror_image():
    solved, wanted = random_corrections(200)
    swap = {"Left": "Right", "Right": "Left"}
    mirror = [
        NAMES.index(next((n[: -len(s)] + swap[s] for s in swap if n.endswith(s)), n)) for n in NAMES
    ]
    held, _, _ = limit_correction(solved, wanted, APERTURES)
    mirrored, _, _ = limit_correction(solved[:, mirror], wanted[:, mirror], APERTURES)
    np.testing.assert_allclose(mirrored, held[:, mirror], atol=1e-9)


def test_a_correction_that_grows_smoothly_is_held_smoothly():
    t = np.linspace(0, 1, 200)[:, None]
    solved = weights(jawOpen=0.15) * np.sin(3 * t) ** 2
    wanted = np.maximum(solved, t * weights(mouthUpperUpLeft=1.0, mouthUpperUpRight=1.0, jawOpen=1))
    held = limit_correction(solved, wanted, APERTURES)[0]
    assert np.abs(np.diff(held, axis=0)).max() < 4 * np.abs(np.diff(wanted, axis=0)).max()


def test_a_face_without_seams_is_not_held():
    nothing = apertures_of(replace(BOUND, layout=FaceLayout()), NAMES, POSES)
    solved, wanted = random_corrections(20)
    np.testing.assert_array_equal(limit_correction(solved, wanted, nothing)[0], wanted)


BENT = bent_slit_face()
BENT_NAMES = BENT.shape_names
BENT_POSES = np.array([e.pose(BENT_NAMES) for e in EXPRESSIONS])
BENT_APERTURES = apertures_of(replace(BOUND, mesh=BENT), BENT_NAMES, BENT_POSES)


def bent_corrections(frames: int) -> tuple[np.ndarray, np.ndarray]:
    """As `random_corrections`; combination shapes follow their parents."""
    plain = random_corrections(frames)
    none = np.zeros((frames, len(BENT_NAMES) - len(NAMES)))
    combined = BENT_APERTURES.evaluator.combined
    solved, wanted = (combined(np.concatenate([w, none], axis=1)) for w in plain)
    return solved, wanted


def posed(w: np.ndarray) -> np.ndarray:
    """The points of the bent face at weights (T,), shape by shape: (V, 3) [m]."""
    weight = dict(zip(BENT_NAMES, w.tolist(), strict=True))
    for shape in BENT.shapes:
        if shape.combination is not None:
            parents = [weight[name] for name in shape.combination.of]
            product = shape.combination.rule == "product"
            weight[shape.name] = np.prod(parents) if product else min(parents)
    points = BENT.points.copy()
    for shape in BENT.shapes:
        knots = {0.0: 0.0 * shape.offsets, 1.0: shape.offsets}
        knots |= {b.weight: b.offsets for b in shape.inbetweens}
        at, w = sorted(knots), weight[shape.name]
        right = int(np.searchsorted(at, w).clip(1, len(at) - 1))
        part = (w - at[right - 1]) / (at[right] - at[right - 1])
        points[shape.indices] += (1 - part) * knots[at[right - 1]] + part * knots[at[right]]
    return points


def test_on_a_rig_with_inbetweens_every_aperture_changes_as_it_may():
    solved, wanted = bent_corrections(400)
    held, limited, _ = limit_correction(solved, wanted, BENT_APERTURES)
    assert 0.1 < limited.any(axis=1).mean() < 0.95
    low, high = BENT_APERTURES.limits(BENT_APERTURES.at(solved))
    change = BENT_APERTURES.at(held) - BENT_APERTURES.at(solved)
    assert (change <= high + ROUNDING).all() and (change >= low - ROUNDING).all()
    assert (held >= solved).all() and (held <= wanted).all()
    untouched = ~limited.any(axis=1)
    np.testing.assert_array_equal(held[untouched], wanted[untouched])
    np.testing.assert_array_equal(limit_correction(solved, held, BENT_APERTURES)[0], held)
    # As if the shapes were linear, apertures would change by millimetres more.
    linear = wanted.copy()
    linear[:, : len(NAMES)] = limit_correction(
        solved[:, : len(NAMES)], wanted[:, : len(NAMES)], APERTURES
    )[0]
    assert (BENT_APERTURES.at(linear) - BENT_APERTURES.at(solved) - high).max() > 0.001


def test_on_a_rig_with_inbetweens_closed_lips_stay_closed_on_the_posed_mesh():
    """All of jaw, lips and smiles is asked for over a closed mouth; the mesh itself is measured."""
    wanted = np.array([[float(n.startswith(("jaw", "mouthU", "mouthS"))) for n in BENT_NAMES]])
    solved = np.zeros_like(wanted)
    held, limited, _ = limit_correction(solved, wanted, BENT_APERTURES)
    assert limited.any() and held.max() > 0.05
    upper, lower = posed(held[0])[PARTS.lips].swapaxes(0, 1)
    rest = FACE.points[PARTS.lips][:, 0, 1] - FACE.points[PARTS.lips][:, 1, 1]
    assert (upper[:, 1] - lower[:, 1] - rest).mean() <= TOLERANCE + ROUNDING


def test_lids_that_an_inbetween_has_closed_are_not_pushed_into_each_other():
    """At 0.6 a blink leaves 0.64 mm; a squint of 3 mm would cross the lids."""
    solved = np.array([[0.6 * (name == "eyeBlinkLeft") for name in BENT_NAMES]])
    wanted = np.maximum(solved, [[float(name == "eyeSquintLeft") for name in BENT_NAMES]])
    held, limited, _ = limit_correction(solved, wanted, BENT_APERTURES)
    assert limited.any()
    upper, lower = posed(held[0])[PARTS.lids].swapaxes(0, 1)
    gaps = (upper - lower)[FACE.points[PARTS.lids][:, 0, 0] > 0, 1]
    assert gaps == pytest.approx(-TOLERANCE, abs=ROUNDING)


@pytest.mark.slow
def test_on_a_rig_with_inbetweens_little_more_is_taken_back_than_a_solver_takes():
    solved, wanted = bent_corrections(60)
    held, limited, _ = limit_correction(solved, wanted, BENT_APERTURES)
    low, high = BENT_APERTURES.limits(BENT_APERTURES.at(solved))
    free = BENT_APERTURES.evaluator.moving
    ratios = []
    for f in np.flatnonzero(limited.any(axis=1))[:12]:
        moving = free & (wanted[f] > solved[f])

        def full(d: np.ndarray, f=f, moving=moving) -> np.ndarray:
            w = wanted[f].copy()
            w[moving] = solved[f, moving] + d
            return w[None]

        def room(d: np.ndarray, f=f, full=full) -> np.ndarray:
            change = BENT_APERTURES.change(solved[f : f + 1], full(d))[0]
            return 1000 * np.concatenate([high[f] - change, change - low[f]])

        most = (wanted - solved)[f, moving]
        found = [
            minimize(
                lambda d, most=most: ((d - most) ** 2).sum(),
                start,
                method="SLSQP",
                bounds=[(0.0, m) for m in most],
                constraints={"type": "ineq", "fun": room},
            )
            for start in ((held - solved)[f, moving], 0.3 * most)
        ]
        best = min(r.fun for r in found if room(r.x).min() > -2e-3)
        ratios.append(np.linalg.norm(held[f] - wanted[f]) / np.sqrt(best))
    assert len(ratios) == 12
    assert np.median(ratios) < 1.1 and max(ratios) < 2.0


def test_on_a_rig_with_inbetweens_a_correction_that_grows_smoothly_is_held_smoothly():
    t = np.linspace(0, 1, 200)[:, None]
    solved = 0.15 * np.sin(3 * t) ** 2 * [[float(name == "jawOpen") for name in BENT_NAMES]]
    pose = [[float(n.startswith(("mouthUpper", "jawOpen"))) for n in BENT_NAMES]]
    wanted = np.maximum(solved, t * pose)
    held = limit_correction(solved, wanted, BENT_APERTURES)[0]
    assert np.abs(np.diff(held, axis=0)).max() < 4 * np.abs(np.diff(wanted, axis=0)).max()
