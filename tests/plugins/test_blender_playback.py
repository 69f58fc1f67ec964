"""A result as actions in Blender, against a stand-in for it."""

import sys
from types import SimpleNamespace
from typing import Any

import pytest
from blender_stand_in import extension_parts


class Messages(list[Any]):
    """The messages of the panel."""

    def add(self) -> SimpleNamespace:
        self.append(SimpleNamespace())
        return self[-1]


@pytest.mark.parametrize("library", ["char.blend", None])
def test_what_blender_does_not_save_is_reported(
    monkeypatch: pytest.MonkeyPatch, library: str | None
) -> None:
    basis, key = SimpleNamespace(name="Basis"), SimpleNamespace(name="jawOpen")
    keys = SimpleNamespace(key_blocks=[basis, key], reference_key=basis, library=library)
    mesh = SimpleNamespace(
        name="head", type="MESH", data=SimpleNamespace(shape_keys=keys), children_recursive=()
    )
    settings = SimpleNamespace(character=mesh, messages=Messages())
    scene = SimpleNamespace(usdface=settings)
    mesh.users_scene = [scene]
    with extension_parts(monkeypatch) as part:
        sys.modules["bpy"].data.objects = []
        part("playback")._report_linked(scene)
    assert [m.severity for m in settings.messages] == ["warning"] * bool(library)
    assert all("head are linked" in m.text and "Make Local" in m.remedy for m in settings.messages)
