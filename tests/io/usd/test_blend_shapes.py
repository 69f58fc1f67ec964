import numpy as np
import pytest
from pxr import UsdSkel
from sheets import codes, sheet

from usdface.io.usd.check import check_stage
from usdface.io.usd.rig import rig_of_stage


def test_dense_offsets_become_sparse():
    stage = sheet(offsets=((0, 0, 0), (0, 1, 0), (0, 0, 0)), indices=None)
    shape = rig_of_stage(stage)[0].meshes[0].shapes[0]
    assert list(shape.indices) == [1]
    np.testing.assert_array_equal(shape.offsets, [(0, 1, 0)])


def test_unsorted_and_repeated_indices_mean_what_usdskel_makes_of_them():
    offsets = ((0, 1, 0), (0, 2, 0), (0, 4, 0))
    rig, findings = rig_of_stage(sheet(offsets, (2, 0, 2)))
    shape = rig.meshes[0].shapes[0]
    assert list(shape.indices) == [0, 2]
    np.testing.assert_array_equal(shape.offsets, [(0, 2, 0), (0, 5, 0)])
    assert codes(findings) == ["POINT_INDICES_UNSORTED", "POINT_INDICES_REPEATED"]


@pytest.mark.parametrize(
    ("wrong", "code"),
    [
        ({"indices": (99,)}, "SHAPE_SKIPPED"),
        ({"indices": (-1,)}, "SHAPE_SKIPPED"),
        ({"indices": None}, "SHAPE_SKIPPED"),
        ({"indices": (0, 1)}, "SHAPE_SKIPPED"),
        ({"offsets": ((0, float("nan"), 0),)}, "SHAPE_SKIPPED"),
        ({"targets": ("nowhere",)}, "SHAPE_TARGET_MISSING"),
    ],
)
def test_a_shape_that_cannot_move_is_left_out_with_a_finding(wrong, code):
    rig, findings = rig_of_stage(sheet(**wrong))
    assert rig.shape_names == () and codes(findings) == [code]


def test_an_inactive_shape_is_left_out_as_one_that_is_missing():
    stage = sheet(names=("up", "other"), targets=("up", "other"))
    UsdSkel.BlendShape.Define(stage, "/R/M/other").CreateOffsetsAttr([(9, 9, 9)] * 3)
    stage.GetPrimAtPath("/R/M/up").SetActive(False)
    rig, findings = rig_of_stage(stage)
    assert rig.shape_names == ("other",) and codes(findings) == ["SHAPE_TARGET_MISSING"]
    assert "SHAPE_TARGET_MISSING" in codes(check_stage(stage))


def test_a_token_named_twice_keeps_its_first_target():
    stage = sheet(names=("up", "up"), targets=("up", "other"))
    UsdSkel.BlendShape.Define(stage, "/R/M/other").CreateOffsetsAttr([(9, 9, 9)] * 3)
    rig, findings = rig_of_stage(stage)
    np.testing.assert_array_equal(rig.meshes[0].shapes[0].offsets, [(0, 1, 0)])
    assert codes(findings) == ["SHAPE_SKIPPED"]


@pytest.mark.parametrize("weight", [0.0, 1.0, None])
def test_an_inbetween_without_a_place_is_dropped(weight):
    stage = sheet()
    between = UsdSkel.BlendShape(stage.GetPrimAtPath("/R/M/up")).CreateInbetween("half")
    between.SetOffsets([(1, 1, 1)])
    if weight is not None:
        between.SetWeight(weight)
    rig, findings = rig_of_stage(stage)
    assert rig.meshes[0].shapes[0].inbetweens == () and codes(findings) == ["INBETWEEN_DROPPED"]
