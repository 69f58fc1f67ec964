from pathlib import Path

import pytest
from other_packages import Install, install
from worlds import make_world

from usdface.errors import InputError, PluginError
from usdface.options import ExportOptions
from usdface.pipeline import export_scene

__all__ = ["install"]

SOURCE = """
from usdface import ExportTarget

def write(rig, clips, path, options):
    {body}
    path.write_text(f"{{len(rig.shape_names)}} {{len(clips)}} {{options.clip}}")
    return []

def pack(source, path, options):
    path.write_bytes(source.read_bytes())
    return []

WRITE = ExportTarget(name="cache", suffixes=(".acache",), write=write)
PACK = ExportTarget(name="pack", suffixes=(".apack",), pack=pack)
"""
ENTRIES = {"usdface.exports": {"write": "acme:WRITE", "pack": "acme:PACK"}}


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    return make_world().write(tmp_path) / "rig.usda"


def test_a_target_of_another_package_gets_arrays(install: Install, scene: Path) -> None:
    install("acme", SOURCE.format(body=""), ENTRIES)
    output = scene.with_name("out.acache")
    result = export_scene(scene, output)
    count = result.summary["blend_shapes"]
    assert count and output.read_text() == f"{count} {result.summary['clips']} "
    assert [f.code for f in result.findings if f.where == "out.acache"] == [
        "CONVERSION_UNCERTIFIED"
    ]
    with pytest.raises(InputError, match="cache has no use for pointer = True"):
        export_scene(scene, output, options=ExportOptions(pointer=True))


def test_a_packer_of_another_package_gets_the_scene(install: Install, scene: Path) -> None:
    install("acme", SOURCE.format(body=""), ENTRIES)
    export_scene(scene, scene.with_name("out.apack"))
    assert scene.with_name("out.apack").read_bytes() == scene.read_bytes()


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        ("path.write_text('half'); 1 / 0", "acme.write failed: ZeroDivisionError"),
        (
            "path.with_name('more.bin').touch()",
            "returned having written more.bin; expected out.acache alone",
        ),
        ("return []", "returned without having written out.acache"),
        ("path.unlink(); return []", "returned without having written out.acache"),
        ("path.write_text('x'); return None", "NoneType; expected a list of findings"),
    ],
)
def test_what_was_there_stays_where_a_target_fails(
    install: Install, scene: Path, body: str, reason: str
) -> None:
    install("acme", SOURCE.format(body=body), ENTRIES)
    output = scene.with_name("out.acache")
    output.write_text("before")
    before = sorted(scene.parent.iterdir())
    with pytest.raises(PluginError) as raised:
        export_scene(scene, output)
    assert reason in str(raised.value) and "acme 1.0 (acme:WRITE)" in str(raised.value)
    assert output.read_text() == "before" and sorted(scene.parent.iterdir()) == before


def test_a_suffix_that_nobody_writes_is_refused(scene: Path) -> None:
    with pytest.raises(InputError, match=r"files of kind '\.fbx' are not written; expected glTF"):
        export_scene(scene, scene.with_name("out.fbx"))


def test_usd_is_made_by_import(scene: Path) -> None:
    with pytest.raises(InputError, match=r"'\.usda' are not .*`usdface import` makes USD"):
        export_scene(scene, scene.with_name("out.usda"))


def test_packing_follows_no_option_of_gltf(scene: Path) -> None:
    with pytest.raises(InputError, match="USDZ has no use for pointer = True"):
        export_scene(scene, scene.with_name("out.usdz"), options=ExportOptions(pointer=True))
