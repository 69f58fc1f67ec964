import numpy as np
import pytest
from pxr import Sdf, Usd, Vt

from usdface.errors import InputError
from usdface.io.usd.retarget_setup import read_setup, write_setup
from usdface.schemas import tokens
from usdface.setup.binding import Binding
from usdface.setup.calibration import Calibration
from usdface.setup.performer_face import PerformerFace
from usdface.setup.retarget_setup import RetargetSetup

FACE = PerformerFace(
    ("chin", "lip"),
    [4, 9],
    [[0.0, 0.001, 0.0], [0.0, 0.0, 0.0]],
    [[0.0, 1.0, 2.0], [0.0, 1.1, 2.0]],
    30,
    ("open", "wide"),
    0.001 * np.arange(12).reshape(2, 2, 3) + 1e-9,
)


def stage_with(calibration: Calibration) -> Usd.Stage:
    stage = Usd.Stage.CreateInMemory()
    write_setup(stage, "/S", RetargetSetup(Binding(("chin",), [4]), calibration=calibration), {})
    return stage


def prim() -> Usd.Prim:
    calibration = Calibration((), np.zeros(0), np.zeros(0), FACE)
    stage = stage_with(calibration)
    prim.stage = stage  # type: ignore[attr-defined]  # a prim does not keep its stage
    return stage.GetPrimAtPath("/S")


def test_a_face_that_was_written_is_read_to_the_last_bit() -> None:
    found = read_setup(prim()).calibration
    assert found is not None and found.face is not None and found.shapes == ()
    face = found.face
    assert (face.markers, face.shapes, face.frames) == (FACE.markers, FACE.shapes, 30)
    for name in ("vertices", "shifts", "rest", "displacements"):
        np.testing.assert_array_equal(getattr(face, name), getattr(FACE, name))


def test_gains_alone_have_no_face() -> None:
    stage = stage_with(Calibration(("open",), [1.2], [0.0]))
    read = read_setup(stage.GetPrimAtPath("/S")).calibration
    assert read is not None and read.face is None


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        (tokens.CALIBRATION_DISPLACEMENTS, Vt.Vec3dArray(3), "expected 4, of 2 shapes"),
        (tokens.CALIBRATION_REST, Vt.Vec3dArray(1), "rest"),
        (tokens.CALIBRATION_POINTS, Vt.IntArray([1]), "vertices"),
        (tokens.CALIBRATION_MARKERS, Vt.TokenArray(["a", "a"]), "twice"),
        (tokens.CALIBRATION_FRAMES, -1, "frames"),
    ],
)
def test_arrays_that_do_not_belong_together_are_said(
    name: str, value: object, message: str
) -> None:
    face = prim()
    face.GetAttribute(name).Set(value)
    with pytest.raises(InputError, match=message):
        read_setup(face)


def test_an_attribute_without_a_value_is_empty() -> None:
    face = prim()
    face.GetAttribute(tokens.CALIBRATION_REST).Set(Sdf.ValueBlock())
    with pytest.raises(InputError, match="rest"):
        read_setup(face)
