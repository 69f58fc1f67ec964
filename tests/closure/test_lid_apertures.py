"""Gaps between the lids, against a mesh whose lids are known to the millimetre."""

from dataclasses import replace

import numpy as np
import pytest
from slits import LID_GAP, bent_slit_face, slit_face

from usdface.closure.lid_apertures import LidApertures, lid_apertures_of
from usdface.face.bound_face import BoundFace
from usdface.rigs import BlendShape, Mesh


def apertures_on(mesh: Mesh) -> dict[str, LidApertures]:
    face = BoundFace(mesh, (), np.zeros(0, int)).with_layout(())
    return dict(lid_apertures_of(face, mesh.shape_names))


def weights(mesh: Mesh, **values: float) -> np.ndarray:
    return np.array([[values.get(name, 0.0) for name in mesh.shape_names]])


def test_each_eye_has_its_closer_its_lower_lid_and_its_raiser() -> None:
    mesh = slit_face()
    names, found = mesh.shape_names, apertures_on(mesh)
    assert set(found) == {"left", "right"}
    for eye, apertures in found.items():
        side = eye.capitalize()
        assert names[apertures.closer] == f"eyeBlink{side}"
        assert [names[k] for k in apertures.tighteners] == [f"eyeSquint{side}"]
        assert [names[k] for k in apertures.raisers] == [f"eyeWide{side}"]
        assert apertures.opening == pytest.approx(LID_GAP)


@pytest.mark.parametrize("mesh", [slit_face(), bent_slit_face()], ids=["linear", "bent"])
def test_closed_lids_meet_and_weights_beyond_cross(mesh: Mesh) -> None:
    apertures = apertures_on(mesh)["left"]
    least, widest = apertures.ends(weights(mesh, eyeBlinkLeft=1.0))
    np.testing.assert_allclose([least, widest], 0.0, atol=1e-9)
    assert apertures.least(weights(mesh, eyeBlinkLeft=1.0, eyeSquintLeft=1.0)) == pytest.approx(
        -0.003, rel=0.15
    )
    assert apertures.widest(weights(mesh, eyeBlinkRight=1.0)) > 0.8 * LID_GAP


def test_inbetweens_count() -> None:
    mesh = bent_slit_face()
    apertures = apertures_on(mesh)["right"]
    half = apertures.widest(weights(mesh, eyeBlinkRight=0.5))
    np.testing.assert_allclose(half, 0.1 * apertures.widest(weights(mesh)), rtol=1e-6)


def test_of_shapes_that_close_an_eye_the_one_for_this_eye_is_taken() -> None:
    mesh = slit_face()
    moves = dict(zip(mesh.shape_names, mesh.offsets_at(np.arange(len(mesh.points))), strict=True))
    both = BlendShape.from_dense("blink", moves["eyeBlinkLeft"] + moves["eyeBlinkRight"])
    wider = replace(mesh, shapes=(both, *mesh.shapes))
    assert wider.shape_names[apertures_on(wider)["left"].closer] == "eyeBlinkLeft"
    vertices = np.arange(len(mesh.points))  # as programs write that list those at rest, too
    dense = [
        BlendShape(s.name, vertices, wider.offsets_at(vertices)[k])
        for k, s in enumerate(wider.shapes)
    ]
    listed = replace(wider, shapes=tuple(dense))
    assert listed.shape_names[apertures_on(listed)["left"].closer] == "eyeBlinkLeft"
    lone = replace(mesh, shapes=(both, *(s for s in mesh.shapes if "Blink" not in s.name)))
    assert {lone.shape_names[apertures.closer] for apertures in apertures_on(lone).values()} == {
        "blink"
    }


def test_without_a_shape_that_closes_there_are_none() -> None:
    mesh = slit_face()
    shapes = tuple(shape for shape in mesh.shapes if "Blink" not in shape.name)
    assert not apertures_on(replace(mesh, shapes=shapes))


def test_shapes_that_the_mesh_lacks_move_nothing() -> None:
    mesh = slit_face()
    face = BoundFace(mesh, (), np.zeros(0, int)).with_layout(())
    names = ("unknown", *mesh.shape_names)
    apertures = lid_apertures_of(face, names)["left"]
    assert names[apertures.closer] == "eyeBlinkLeft"
    assert not apertures.evaluator.offsets[0].any()
