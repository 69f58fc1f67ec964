"""A folder where every command finds inputs that bring in more files than they are."""

import json
import shutil
from pathlib import Path

from usdface.io.fuzzy_formats.files import write_fuzzy_file
from usdface.rule_design.paper_system import paper_system

__all__ = ["GLTF", "LAYERS", "PICTURES", "RIG", "SHOT", "compose", "image"]

LAYERS = [f"lay/{name}.usda" for name in ("ref", "pay", "var", "clip", "deep", "c.1", "c.2", "v")]
PICTURES = ["tex/skin.png", "tex/nails.1001.png", "tex/nails.1011.png", "tex/unseen.png"]
RIG = ["lay/rig.usda", "rig.usda", *LAYERS, *PICTURES]
SHOT = ["shot.usda", "take.usda", *RIG]
GLTF = ["face.gltf", "face.bin", "face_textures/0.png"]

_EMPTY = '#usda 1.0\n(defaultPrim = "A")\ndef "A"\n{\n}\n'
_DEEP = '#usda 1.0\n(defaultPrim = "A")\ndef "A" (references = @./deep.usda@)\n{\n}\n'
_RIG = """#usda 1.0
(
    defaultPrim = "Asset"
    expressionVariables = { string WHICH = "unseen" }
    metersPerUnit = 1
    subLayers = [@../rig.usda@]
    upAxis = "Y"
)
over "Asset"
{
    def "More" (
        references = @ref.usda@
        payload = @pay.usda@
        clips = {
            dictionary own = {
                asset[] assetPaths = [@clip.usda@]
                string primPath = "/A"
                double2[] active = [(0, 0)]
            }
            dictionary many = {
                string templateAssetPath = "./c.#.usda"
                double templateStartTime = 1
                double templateEndTime = 2
                double templateStride = 1
                string primPath = "/A"
            }
        }
        variants = { string kind = "a" }
        prepend variantSets = "kind"
    )
    {
        asset skin = @../tex/skin.png@
        asset[] nails = [@../tex/nails.<UDIM>.png@]
        asset unseen = @`"../tex/${WHICH}.png"`@
        asset gone = @../tex/gone.png@
        variantSet "kind" = {
            "a" (references = @v.usda@) {
            }
            "b" (references = [@var.usda@, @broken.usda@, @none.usda@]) {
            }
        }
    }
}
"""


def image(name: str) -> bytes:
    """Bytes that pass for a PNG, other ones for each name."""
    return b"\x89PNG\r\n\x1a\n" + bytes(24) + name.encode()


def compose(folder: Path) -> None:
    """Put more files around rig.usda, take.usda and bind.json, which are there."""
    (folder / "lay").mkdir()
    (folder / "tex").mkdir()
    for name in LAYERS:
        (folder / name).write_text(_DEEP if "ref" in name else _EMPTY)
    for name in PICTURES:
        (folder / name).write_bytes(image(name))
    (folder / "lay/broken.usda").write_text("#usda 1.0\ndef {{")
    (folder / "lay/rig.usda").write_text(_RIG)
    write_fuzzy_file(folder / "system.fis", paper_system())
    (folder / "poses.json").write_text('{"contempt": {"shapes": {"mouthSmileLeft": 0.8}}}')
    (folder / "who.json").write_text('{"shapes": {"jawOpen": {"gain": 0.8}}}')
    labels = "take,start_frame,end_frame,emotion\ntake.usda,9,12,joy\n"
    (folder / "labels.csv").write_text(labels)
    (folder / "take.csv").write_text("time,a_x,a_y,a_z\n0,0,0,0\n1,0,0,1\n")
    (folder / "cut.edl").write_text("TITLE: cut\n")
    _write_gltf(folder)
    _write_folders(folder)


def _write_gltf(folder: Path) -> None:
    (folder / "face_textures").mkdir()
    (folder / "face_textures/0.png").write_bytes(image("0"))
    (folder / "face.bin").write_bytes(bytes(36))
    document = {
        "asset": {"version": "2.0"},
        "buffers": [{"uri": "face.bin", "byteLength": 36}, {"uri": "data:;base64,AAAA"}],
        "images": [{"uri": "face_textures/0.png"}, {"uri": "../outside.png"}],
    }
    (folder / "face.gltf").write_text(json.dumps(document))


def _write_folders(folder: Path) -> None:
    (folder / "heads").mkdir()
    for name in ("neutral", "smile"):
        (folder / f"heads/{name}.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (folder / "heads/combinations.json").write_text("{}")
    (folder / "human/targets").mkdir(parents=True)
    shutil.copy(folder / "heads/neutral.obj", folder / "human/base.obj")
    (folder / "human/targets/smile.target").write_text("0 1 0 0\n")
