"""Apertures of lips and lids, against the posed mesh."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from slits import EXPRESSIONS, LID_GAP, LIP_GAP, bent_slit_face, slit_face, with_correctives

from usdface.correction.apertures import Apertures, apertures_of
from usdface.correction.contact import limit_correction
from usdface.errors import InputError
from usdface.face.bound_face import BoundFace
from usdface.face.layout import FaceLayout, find_layout
from usdface.rigs import Mesh

LAYOUT = find_layout(slit_face(), EXPRESSIONS, 0.0)


def measured(mesh: Mesh) -> Apertures:
    face = BoundFace(mesh, (), np.zeros(0, int), layout=LAYOUT)
    poses = np.array([e.pose(mesh.shape_names) for e in EXPRESSIONS])
    return apertures_of(face, mesh.shape_names, poses)


def weights(mesh: Mesh, **shapes: float) -> np.ndarray:
    return np.array([[shapes.get(name, 0.0) for name in mesh.shape_names]])


FACE, BENT = slit_face(), bent_slit_face()
APERTURES, BENT_APERTURES = measured(FACE), measured(BENT)


def test_apertures_are_those_of_the_mesh():
    rest = APERTURES.at(np.zeros((1, len(FACE.shapes))))[0]
    lips = np.array([kind == "lips" for kind in APERTURES.contact])
    np.testing.assert_allclose(rest[lips], LIP_GAP)
    np.testing.assert_allclose(rest[~lips], LID_GAP)
    some = weights(FACE, jawOpen=0.3, eyeBlinkLeft=0.5, eyeSquintLeft=0.2)
    apertures = dict(zip(APERTURES.contact, APERTURES.at(some)[0], strict=True))
    assert apertures["lips"] == pytest.approx(LIP_GAP + 0.3 * 0.020)
    assert apertures["left lids"] == pytest.approx(LID_GAP - 0.5 * 0.008 - 0.2 * 0.003)
    assert apertures["right lids"] == pytest.approx(LID_GAP)


def scaled(mesh: Mesh, factor: float) -> Mesh:
    shapes = (
        replace(
            shape,
            offsets=factor * shape.offsets,
            inbetweens=tuple(replace(b, offsets=factor * b.offsets) for b in shape.inbetweens),
        )
        for shape in mesh.shapes
    )
    return replace(mesh, points=factor * mesh.points, shapes=tuple(shapes))


def test_a_blink_that_closes_90_percent_at_half_its_weight_leaves_a_millimetre_there():
    """Of lids 10 mm apart; a line from open to closed would say 5 mm."""
    mesh = scaled(BENT, 0.010 / LID_GAP)
    apertures = measured(mesh)
    for weight, millimetres in ((0.0, 10.0), (0.5, 1.0), (0.75, 0.5), (1.0, 0.0)):
        found = dict(
            zip(apertures.contact, apertures.at(weights(mesh, eyeBlinkLeft=weight))[0], strict=True)
        )
        assert 1000 * found["left lids"] == pytest.approx(millimetres, abs=1e-9)


def test_combination_shapes_count_whatever_weight_they_are_given():
    plain = weights(BENT, jawOpen=0.5, mouthSmileLeft=1.0)
    wrong = weights(BENT, jawOpen=0.5, mouthSmileLeft=1.0, jawSmileLeft=0.9)
    found = BENT_APERTURES.at(plain)[0]
    np.testing.assert_array_equal(BENT_APERTURES.at(wrong)[0], found)
    # The jaw opens 20 % of 20 mm at 0.5, the smile 0.6 mm; both together 30 % of 20 mm less.
    assert found[5] == pytest.approx(0.0008 + 0.2 * 0.020 + 0.0006 - 0.5 * 0.3 * 0.020)


def test_slopes_make_up_the_change():
    rng = np.random.default_rng(0)
    solved, corrected = rng.random((2, 30, len(BENT.shapes)))
    slopes = BENT_APERTURES.slopes(solved, corrected)
    change = np.einsum("ft,ftk->fk", corrected - solved, slopes)
    expected = BENT_APERTURES.at(corrected) - BENT_APERTURES.at(solved)
    np.testing.assert_allclose(change, expected, atol=1e-15)
    np.testing.assert_allclose(BENT_APERTURES.change(solved, corrected), expected, atol=1e-15)
    assert not slopes[:, ~BENT_APERTURES.evaluator.moving].any()


def test_shapes_of_other_meshes_and_another_order_change_nothing():
    names = ("tongueOut", *reversed(BENT.shape_names))
    poses = np.array([e.pose(names) for e in EXPRESSIONS])
    face = BoundFace(BENT, (), np.zeros(0, int), layout=LAYOUT)
    other = apertures_of(face, names, poses)
    some = np.random.default_rng(1).random((5, len(BENT.shapes)))
    given = np.concatenate([np.ones((5, 1)), some[:, ::-1]], axis=1)
    np.testing.assert_allclose(other.at(given), BENT_APERTURES.at(some), atol=1e-15)
    np.testing.assert_allclose(other.floor, BENT_APERTURES.floor, atol=1e-15)


def test_pairs_that_the_mesh_does_not_have_are_refused():
    layout = FaceLayout(lips=np.array([[0, 99_999]]))
    face = BoundFace(FACE, (), np.zeros(0, int), layout=layout)
    with pytest.raises(InputError, match="vertex 99999"):
        apertures_of(face, FACE.shape_names, np.zeros((0, len(FACE.shapes))))


def test_contact_of_long_takes_is_kept_in_the_memory_of_a_block():
    mesh = with_correctives(BENT, 100)
    apertures = measured(mesh)
    solved = np.zeros((3000, len(mesh.shapes)))
    wanted = solved + 0.1 * np.array([name.startswith("more") for name in mesh.shape_names])
    wanted[:, mesh.shape_names.index("mouthUpperUpLeft")] = np.linspace(0.2, 0.8, 3000)
    tracemalloc.start()
    try:
        held, limited, _ = limit_correction(solved, wanted, apertures)
        # With the slopes of all frames at once: 180 MB and more.
        assert tracemalloc.get_traced_memory()[1] < 40e6
    finally:
        tracemalloc.stop()
    assert limited.any(axis=1).all()
    some = np.arange(0, 3000, 300)
    alone = limit_correction(solved[some], wanted[some], apertures)[0]
    np.testing.assert_allclose(held[some], alone, atol=1e-12)
