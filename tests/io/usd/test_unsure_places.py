import numpy as np
import pytest
from pxr import Usd, Vt

from usdface.errors import InputError
from usdface.io.usd.unsure_places import read_unsure, write_unsure
from usdface.schemas import tokens
from usdface.setup.binding import Binding

UNSURE = Binding(("chin", "brow"), np.array([640, 7]), "/Head", np.array([0.25, 0.0]))
BOUND = Binding(("nose",), np.array([3]), "/Head")


@pytest.fixture
def stage() -> Usd.Stage:
    stage = Usd.Stage.CreateInMemory()
    write_unsure(stage.DefinePrim("/Retarget", tokens.RETARGET), UNSURE)
    return stage


def test_unsure_places_survive_usd(stage: Usd.Stage) -> None:
    back = read_unsure(stage.GetPrimAtPath("/Retarget"), BOUND)
    assert (back.markers, back.mesh) == (UNSURE.markers, "/Head")
    np.testing.assert_array_equal(back.points, UNSURE.points)
    np.testing.assert_array_equal(back.confidence, UNSURE.confidence)


def test_one_that_is_bound_since_is_unsure_no_more(stage: Usd.Stage) -> None:
    bound = Binding(("nose", "chin"), np.array([3, 641]), "/Head")
    back = read_unsure(stage.GetPrimAtPath("/Retarget"), bound)
    assert back.markers == ("brow",) and back.points.tolist() == [7]
    assert back.confidence is not None and back.confidence.tolist() == [0.0]


def test_without_any_there_is_no_attribute() -> None:
    stage = Usd.Stage.CreateInMemory()
    prim = stage.DefinePrim("/Retarget", tokens.RETARGET)
    write_unsure(prim, Binding((), np.zeros(0, dtype=np.int64)))
    assert not prim.GetAuthoredAttributes()
    assert read_unsure(prim, BOUND).markers == ()


def test_nothing_unsure_replaces_what_was(stage: Usd.Stage) -> None:
    prim = stage.GetPrimAtPath("/Retarget")
    write_unsure(prim, Binding(("chin",), np.array([640])))
    back = read_unsure(prim, BOUND)
    assert back.markers == ("chin",) and back.confidence is None
    write_unsure(prim, Binding((), np.zeros(0, dtype=np.int64)))
    assert read_unsure(prim, BOUND).markers == ()


def test_counts_that_differ_are_refused(stage: Usd.Stage) -> None:
    prim = stage.GetPrimAtPath("/Retarget")
    prim.GetAttribute(tokens.BIND_UNSURE_POINTS).Set(Vt.IntArray([640]))
    with pytest.raises(InputError, match="1 points for 2 markers"):
        read_unsure(prim, BOUND)
