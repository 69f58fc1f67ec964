"""Files that are missing, cut off, or not what they should be."""

import pytest
from pxr import Sdf
from spoilt import Place, Refused

PNG = b"\x89PNG\r\n\x1a\n" + bytes(range(256))


@pytest.mark.parametrize("command", ["rig", "take", "import", "export", "check", "process"])
@pytest.mark.parametrize("name", ["none.glb", "none.usda", "none.c3d", "none.csv", "none/none.trc"])
def test_a_missing_file(place: Place, refused: Refused, command: str, name: str) -> None:
    output = ["-o", place / ("x.glb" if command == "export" else "x.usda")]
    message = refused([command, place / name, *([] if command in ("check", "process") else output)])
    assert name in message


@pytest.mark.parametrize(
    ("command", "name"),
    [
        ("rig", "a.glb"),
        ("rig", "a.gltf"),
        ("rig", "a.usda"),
        ("rig", "a.usdc"),
        ("rig", "a.usd"),
        ("rig", "a.usdz"),
        ("rig", "a.fbx"),
        ("rig", "a.png"),
        ("take", "a.c3d"),
        ("take", "a.trc"),
        ("take", "a.csv"),
        ("take", "a.bvh"),
        ("take", "a.png"),
        ("take", "a.usda"),
        ("import", "a.glb"),
        ("import", "a.png"),
        ("export", "a.usda"),
        ("export", "a.usdc"),
        ("process", "a.usda"),
        ("process", "a.png"),
        ("check", "a.usda"),
        ("check", "a.glb"),
        ("check", "a.png"),
    ],
)
@pytest.mark.parametrize("content", [b"", b"hello world\n", PNG, b"\xff\xfe" + bytes(64)])
def test_a_file_of_another_kind(
    place: Place, refused: Refused, command: str, name: str, content: bytes
) -> None:
    (place / name).write_bytes(content)
    output = ["-o", place / ("x.glb" if command == "export" else "x.usda")]
    message = refused([command, place / name, *([] if command in ("check", "process") else output)])
    assert name in message


def test_usd_is_not_imported(place: Place, refused: Refused) -> None:
    """The two directions are easily mistaken."""
    said = refused(["import", place / "rig.usda", "-o", place / "x.usda"])
    assert "rig.usda is USD; `usdface import` reads glTF" in said


@pytest.mark.parametrize("share", [0.02, 0.3, 0.6, 0.95])
@pytest.mark.parametrize("name", ["rig.usda", "take.usda", "shot.usda", "bind.json"])
def test_a_truncated_text(place: Place, refused: Refused, name: str, share: float) -> None:
    content = (place / name).read_bytes()
    (place / name).write_bytes(content[: int(share * len(content))])
    message = refused(place.process if name == "shot.usda" else place.shot)
    assert name in message


@pytest.mark.parametrize("share", [0.01, 0.3, 0.6, 0.95])
@pytest.mark.parametrize("name", ["rig", "take"])
def test_a_truncated_crate(place: Place, refused: Refused, name: str, share: float) -> None:
    assert Sdf.Layer.FindOrOpen(str(place / f"{name}.usda")).Export(str(place / f"{name}.usdc"))
    content = (place / f"{name}.usdc").read_bytes()
    (place / f"{name}.usdc").write_bytes(content[: int(share * len(content))])
    command = [str(a).replace(f"{name}.usda", f"{name}.usdc") for a in place.shot]
    assert f"{name}.usdc" in refused(command)


def test_a_shot_that_lacks_its_rig(place: Place, refused: Refused) -> None:
    (place / "rig.usda").unlink()
    message = refused(place.process)
    assert "rig.usda" in message and "shot.usda" in message


def test_a_shot_whose_take_has_another_name_now(place: Place, refused: Refused) -> None:
    (place / "take.usda").rename(place / "take_2.usda")
    assert "take.usda" in refused(place.process)


@pytest.mark.parametrize("name", ["rig.usda", "take.usda"])
def test_a_stage_that_is_no_shot(place: Place, refused: Refused, name: str) -> None:
    message = refused(["process", place / name])
    assert name in message and "UsdFaceRetarget" in message and "usdface shot" in message
