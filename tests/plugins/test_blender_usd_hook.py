"""The USD hook of Blender's extension, against a stand-in for Blender."""

from types import SimpleNamespace

import pytest
from blender_stand_in import extension_parts
from pxr import Sdf


@pytest.mark.parametrize("made_of", ["/root/head/head", "/root/head"])
def test_the_bound_mesh_is_found_where_blender_made_one_object_of_two_prims(
    monkeypatch: pytest.MonkeyPatch, made_of: str
) -> None:
    head, empty = SimpleNamespace(type="MESH"), SimpleNamespace(type="EMPTY")
    objects = {"/root": empty, made_of: head}
    with extension_parts(monkeypatch) as part:
        found = part("usd_hook")._object_of
        assert found(objects, Sdf.Path("/root/head/head")) is head
        assert found(objects, Sdf.Path("/root/other")) is None and found(objects, None) is None
