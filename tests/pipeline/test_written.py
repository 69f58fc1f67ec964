"""Every file that a command writes is listed, and none is that it reads."""

import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from composed import image
from worlds import make_world

from usdface.cli import main
from usdface.io.gltf.read import read_gltf
from usdface.io.gltf.write import write_gltf
from usdface.io.usd.rig_write import write_rig
from usdface.materials import Material, Texture
from usdface.pipeline import export_scene, make_shot
from usdface.rigs import Rig


def written_files(folder: Path) -> dict[Path, tuple[int, int]]:
    files = (path for path in folder.rglob("*") if path.is_file())
    return {path: (path.stat().st_ino, path.stat().st_mtime_ns) for path in files}


def worn(*materials: Material) -> Rig:
    """The rig of the small world, which shows the first of `materials`."""
    rig = make_world().rig
    shown = (replace(mesh, material=materials[0].name) for mesh in rig.meshes)
    return replace(rig, meshes=tuple(shown), materials=materials)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A world whose rig has two textures, a shot of it, and the rig as glTF."""
    folder = tmp_path_factory.mktemp("made")
    make_world().write(folder)
    bytes_of = [Texture(data=image(name), suffix=".png") for name in ("colour", "bumps")]
    skin = Material("skin", base_color_texture=bytes_of[0], normal_texture=bytes_of[1])
    rig = worn(skin)
    write_rig(rig, folder / "rig.usda")
    write_gltf(rig, folder / "face.glb")
    (folder / "sub").mkdir()
    write_gltf(rig, folder / "sub/face.gltf")
    names = ("rig.usda", "take.usda", "shot.usda")
    make_shot(*(folder / name for name in names), bind=folder / "bind.json")
    return folder


@pytest.fixture
def place(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


SHOT = "--rig rig.usda --take take.usda"
COMMANDS = [
    "rig face.glb -o new.usda --report r.json",
    "rig sub/face.gltf -o new.usdc",
    "rig rig.usda -o new/rig.usda",
    "rig rig.usda -o beside.usda",
    "import sub/face.gltf -o sub/face.usda",
    "import face.glb -o new.usda --report r.json",
    "export rig.usda -o new/face.gltf --report r.json",
    "export shot.usda -o rig.gltf",
    "export shot.usda -o new.glb",
    "export shot.usda -o new.usdz",
    "process shot.usda --gltf new.gltf --report r.json",
    "process shot.usda --gltf new.glb --figure new.png",
    "process shot.usda --in-place",
    f"shot {SHOT} --bind bind.json -o new.usda --write-bind w.json --bind-figure b.svg",
    "markers rig.usda -n 1 -o m.json --figure m.svg",
    "calibrate shot.usda -o who.json --report r.json",
    "check rig.usda --report r.json",
    "fuzzy explain shot.usda --figure why.svg --report r.json",
    "fuzzy neutral shot.usda --report r.json",
    "fuzzy paper -o paper.fis --report r.json",
    "fuzzy fit --shot shot.usda -o f.usda --expressions e.json --figure f.svg --report r.json",
    "bench papers --report r.json",
]


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS)
def test_what_is_written_is_listed(
    place: Path, capfd: pytest.CaptureFixture[str], command: str
) -> None:
    before = written_files(place)
    assert main(command.split()) == 0
    after = written_files(place)
    printed = [
        line[6:] for line in capfd.readouterr().out.splitlines() if line.startswith("wrote ")
    ]
    changed = {path for path, state in after.items() if before.get(path) != state}
    assert {place / name for name in printed} == changed
    assert len(printed) == len(changed)


def worn_scene(folder: Path, first: str, second: str) -> None:
    """Write face.usda, whose textures lie where `export -o face.gltf` puts its own."""
    (folder / "face_textures").mkdir()
    for name in ("0", "1"):
        (folder / f"face_textures/{name}.png").write_bytes(image(name))
    skin = Material(
        "skin",
        base_color_texture=Texture(str(folder / f"face_textures/{first}.png"), suffix=".png"),
        normal_texture=Texture(str(folder / f"face_textures/{second}.png"), suffix=".png"),
    )
    write_rig(worn(skin), folder / "face.usda")


@pytest.mark.parametrize(
    ("first", "second", "new"), [("0", "1", []), ("1", "0", ["2.png"]), ("1", "1", ["0.png"])]
)
def test_textures_in_our_own_layout_stay_and_are_right(
    tmp_path: Path, first: str, second: str, new: list[str]
) -> None:
    worn_scene(tmp_path, first, second)
    for _ in range(2):
        outcome = export_scene(tmp_path / "face.usda", tmp_path / "face.gltf")
        (skin,) = read_gltf(tmp_path / "face.gltf")[0].materials
        assert skin.base_color_texture is not None and skin.normal_texture is not None
        assert Path(skin.base_color_texture.path).read_bytes() == image(first)
        assert Path(skin.normal_texture.path).read_bytes() == image(second)
        for name in (first, second):
            assert (tmp_path / f"face_textures/{name}.png").read_bytes() == image(name)
        places = [tmp_path / f"face_textures/{name}" for name in new]
        assert outcome.written == (tmp_path / "face.gltf", tmp_path / "face.bin", *places)


def test_a_texture_that_another_prim_shows_stays(tmp_path: Path) -> None:
    worn_scene(tmp_path, "1", "1")
    (tmp_path / "face_textures/0.png").write_bytes(image("hair"))
    text = (tmp_path / "face.usda").read_text()
    hair = '\ndef "Hair"\n{\n    asset file = @./face_textures/0.png@\n}\n'
    (tmp_path / "face.usda").write_text(text + hair)
    export_scene(tmp_path / "face.usda", tmp_path / "face.gltf")
    assert (tmp_path / "face_textures/0.png").read_bytes() == image("hair")
    (skin,) = read_gltf(tmp_path / "face.gltf")[0].materials
    assert skin.base_color_texture is not None
    assert Path(skin.base_color_texture.path).name == "1.png"


def test_a_copied_texture_goes_beside_one_that_is_read(tmp_path: Path) -> None:
    """An embedded image has the place of a file that another material shows."""
    (tmp_path / "a_textures").mkdir()
    kept = tmp_path / "a_textures/skin_baseColor.png"
    kept.write_bytes(image("kept"))
    skin = Material("skin", base_color_texture=Texture(data=image("new"), suffix=".png"))
    hair = Material("hair", base_color_texture=Texture(str(kept), suffix=".png"))
    write_rig(worn(skin, hair), tmp_path / "a.usda")
    assert kept.read_bytes() == image("kept")
    assert (tmp_path / "a_textures/skin_baseColor_1.png").read_bytes() == image("new")


def test_tiles_that_are_read_stay(tmp_path: Path) -> None:
    (tmp_path / "far").mkdir()
    (tmp_path / "near/a_textures").mkdir(parents=True)
    (tmp_path / "far/s.1001.png").write_bytes(image("far"))
    kept = tmp_path / "near/a_textures/skin_baseColor.1001.png"
    kept.write_bytes(image("kept"))
    tiled = Texture(str(tmp_path / "far/s.<UDIM>.png"), suffix=".png")
    near = Texture(str(kept), suffix=".png")
    skin = Material("skin", base_color_texture=tiled, normal_texture=near)
    write_rig(worn(skin), tmp_path / "near/a.usda")
    assert kept.read_bytes() == image("kept")
    moved = tmp_path / "near/a_textures/skin_baseColor_1.1001.png"
    assert moved.read_bytes() == image("far")
