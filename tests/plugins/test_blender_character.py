"""The character of Blender's panel, against a stand-in for Blender."""

import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from blender_stand_in import extension_parts


# As Blender 4.5 and 5.0 export them, with Unicode allowed
@pytest.mark.parametrize(
    ("name", "exported"),
    [
        ("jaw open", "jaw_open"),
        ("2funnel", "_2funnel"),
        ("まばたき", "まばたき"),
        ("हिन्दी", "हिन्दी"),
        ("x²", "x_"),
        ("½", "_"),
        ("٣arab", "_arab"),
        ('/a"b', "_a_b"),
    ],
)
def test_a_name_is_that_of_blenders_export(
    monkeypatch: pytest.MonkeyPatch, name: str, exported: str
) -> None:
    with extension_parts(monkeypatch) as part:
        assert part("character").usd_name(name) == exported


def test_a_deleted_character_that_the_panel_holds_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    with extension_parts(monkeypatch) as part:
        character = SimpleNamespace(name="Face", users_scene=())
        scene = SimpleNamespace(usdface=SimpleNamespace(character=character))
        with pytest.raises(part("messages").FaceError, match="Face is not in the scene"):
            part("character").character_of(scene)


def test_shape_keys_with_the_same_name_in_usd_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    with extension_parts(monkeypatch) as part:
        blocks = [SimpleNamespace(name=name) for name in ("Basis", "smile.L", "jaw", "smile L")]
        keys = SimpleNamespace(key_blocks=blocks, reference_key=blocks[0])
        data = SimpleNamespace(shape_keys=keys)
        mesh = SimpleNamespace(name="head", type="MESH", data=data, children_recursive=())
        sys.modules["bpy"].data.objects = []
        message = "shape keys smile.L and smile L of head have the same name in USD, smile_L"
        with pytest.raises(part("messages").FaceError, match=message):
            part("character").export_character(mesh, Path("character.usdc"))


def test_scenes_are_looked_through_for_what_the_character_moves_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """`users_scene` takes as long as the scenes have objects: of a large set it must not be asked.

    A deleted mesh may still have the character as the target of a modifier.
    """
    blocks = [SimpleNamespace(name=name) for name in ("Basis", "jaw")]
    data = SimpleNamespace(shape_keys=SimpleNamespace(key_blocks=blocks, reference_key=blocks[0]))
    character = SimpleNamespace(name="Rig", type="ARMATURE", children_recursive=())
    modifier = SimpleNamespace(type="ARMATURE", object=character)
    head, deleted = (
        SimpleNamespace(name=name, type="MESH", data=data, modifiers=[modifier], users_scene=scenes)
        for name, scenes in (("head", ["Scene"]), ("deleted", []))
    )
    prop = SimpleNamespace(name="rock", type="MESH", modifiers=[])
    with extension_parts(monkeypatch) as part:
        sys.modules["bpy"].data.objects = [prop, deleted, head]
        assert part("character").face_meshes(character) == [head]
