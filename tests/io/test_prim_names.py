import pytest
from pxr import Sdf

from usdface.io.prim_names import prim_names


@pytest.mark.parametrize(
    ("original", "legal"),
    [
        ("jawOpen", "jawOpen"),
        ("é", "é"),
        ("口 A", "口_A"),
        ("Key 1", "Key_1"),
        ("1x", "_1x"),
        ("a.b/c", "a_b_c"),
        ("", "_"),
        ("\x00", "_"),
        ("😀", "_"),
    ],
)
def test_only_what_usd_forbids_is_changed(original, legal):
    assert prim_names([original]) == (legal,)
    assert Sdf.Path.IsValidIdentifier(legal)


def test_siblings_get_names_of_their_own_and_legal_ones_keep_theirs():
    assert prim_names(["a b", "a.b", "a_b", "a_b"]) == ("a_b_2", "a_b_3", "a_b", "a_b_1")
    assert prim_names(["Skel", "Anim"], taken=["Skel"]) == ("Skel_1", "Anim")


def test_the_same_names_give_the_same_names():
    names = [f"{a}{b}" for a in "ab .口" for b in " ._1"]
    assert prim_names(names) == prim_names(names)
    assert len(set(prim_names(names))) == len(names)
